"""The day of each run: by folder, or by a pattern of its file name."""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Sequence
from pathlib import Path

from axisight.errors import InputError

FOLDER = "folder"
_PLACE = "{day}"


def days_of(paths: Sequence[Path], by: str = FOLDER) -> list[str]:
    """Return the day of each log, from the ``paths`` of the logs.

    ``by``: ``"folder"``, the name of the folder that holds the log; or a pattern of the file name with
    ``{day}`` where the day stands, as in ``"{day}_run*"``; ``*`` and ``?`` stand for any text and any
    character. Raises InputError for another value, and for names that the pattern does not fit.
    """
    if by == FOLDER:
        return _folders(paths)
    if by.count(_PLACE) != 1:
        raise InputError(
            f'by: expected "{FOLDER}" or a pattern with one {_PLACE}, as {_PLACE}_run*, got {by!r}'
        )
    before, after = (_as_regex(part) for part in by.split(_PLACE))
    pattern = re.compile(f"{before}(?P<day>.+?){after}", re.DOTALL)
    return [_day(path, pattern, by) for path in paths]


def _folders(paths: Sequence[Path]) -> list[str]:
    """Return the names of the folders of logs, with as many parents as tell all folders apart."""
    folders = [path.resolve().parent for path in paths]
    different = set(folders)
    for length in range(1, max(len(f.parts) for f in folders) + 1):
        names = {folder: Path(*folder.parts[-length:]).as_posix() for folder in different}
        if len(set(names.values())) == len(different):
            break
    return [names[folder] for folder in folders]


def _as_regex(glob: str) -> str:
    """Return the regular expression of a glob pattern, without its anchors."""
    return fnmatch.translate(glob).removeprefix("(?s:").removesuffix(r")\Z")


def _day(path: Path, pattern: re.Pattern[str], by: str) -> str:
    found = pattern.fullmatch(path.name) or pattern.fullmatch(path.stem)
    if found is None:
        raise InputError(f"by: expected file names that fit {by!r}, got {path.name}")
    return found["day"]
