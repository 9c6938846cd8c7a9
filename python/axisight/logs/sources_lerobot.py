"""Read LeRobot folders, versions 2 and 3: ``meta/info.json`` and Parquet files with episodes in ``data``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from axisight.documents import read_text
from axisight.errors import LogError
from axisight.logs.budget import Budget
from axisight.logs.columns import describe_validation
from axisight.logs.lazy import Reader
from axisight.logs.sources_parquet import load_parquet

_INFO = Path("meta") / "info.json"
_EPISODE = "episode_index"


class _Info(BaseModel):
    """The part of ``meta/info.json`` that is used; the rest is about videos and tasks."""

    model_config = ConfigDict(extra="ignore", frozen=True)

    total_episodes: Annotated[int, Field(ge=0)]


def split_episode(path: Path) -> tuple[Path, int | None]:
    """Return the folder and the episode of ``folder#3``; the episode is None if the path has none."""
    head, mark, number = path.name.rpartition("#")
    if mark and head and number.isdecimal() and not path.exists():
        return path.with_name(head), int(number)
    return path, None


def is_lerobot(path: Path) -> bool:
    """Whether a path is a LeRobot folder, with or without an episode after ``#``."""
    return (split_episode(path)[0] / _INFO).is_file()


def files_of_episode(path: Path) -> list[Path]:
    """Return ``meta/info.json`` and the files that may hold the episode of a path."""
    folder, episode = split_episode(path)
    found = sorted((folder / "data").rglob("*.parquet"))
    # Version 2 has one file per episode; in version 3 episodes share files.
    own = [file for file in found if file.stem == f"episode_{episode or 0:06d}"]
    return [folder / _INFO, *(own or found)]


def check_episode(path: Path) -> None:
    """Raise LogError, naming the folder, if the episode is missing or several exist and none is chosen."""
    folder, episode = split_episode(path)
    total = _info(folder / _INFO).total_episodes
    if total == 0:
        raise LogError(f"{folder}: total_episodes: expected at least one episode, got none")
    if episode is None and total > 1:
        raise LogError(
            f"{folder}: expected the choice of an episode, {folder.name}#0 to {folder.name}#{total - 1}, "
            f"got a folder with {total} of them"
        )
    if episode is not None and episode >= total:
        raise LogError(
            f"{folder}: expected an episode from 0 to {total - 1} after #, got {episode}"
        )


def load_lerobot(path: Path, budget: Budget) -> dict[str, Reader]:
    """Return readers of the columns of one episode; `observation.state` becomes `observation.state[0]`, ...

    Without a choice in the path, this is episode 0. Raises LogError for an episode without rows, and
    whatever the Parquet reader raises on a damaged file.
    """
    number = split_episode(path)[1] or 0
    filters = [(_EPISODE, "=", number)]
    parts = [load_parquet(file, budget, filters) for file in files_of_episode(path)[1:]]
    parts = [part for part in parts if _EPISODE in part and part[_EPISODE]().size]
    if not parts:
        raise LogError(f"expected rows with {_EPISODE} {number} below data, got none")
    shared = [name for name in parts[0] if all(name in part for part in parts)]
    return {name: _joined([part[name] for part in parts]) for name in shared}


def _joined(readers: list[Reader]) -> Reader:
    return lambda: np.concatenate([read() for read in readers])


def _info(path: Path) -> _Info:
    try:
        return _Info.model_validate_json(read_text(path))
    except (OSError, UnicodeDecodeError) as error:
        raise LogError(f"{path}: cannot be read: {error}") from error
    except ValidationError as error:
        raise LogError(f"{path}: {describe_validation(error, _Info)}") from error
