"""Open a file of any format as named arrays, without regard to their meaning."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from axisight.arguments import short, usable_path
from axisight.errors import LogError, MissingExtraError
from axisight.logs.budget import Budget
from axisight.logs.columns import CsvOptions
from axisight.logs.lazy import LazyArrays, Reader, unreadable
from axisight.logs.sources_bag import BAG_SUFFIXES, is_bag, load_bag
from axisight.logs.sources_csv import is_packed, load_csv
from axisight.logs.sources_hdf5 import load_hdf5
from axisight.logs.sources_json import load_json, load_json_lines
from axisight.logs.sources_lerobot import (
    check_episode,
    files_of_episode,
    is_lerobot,
    load_lerobot,
)
from axisight.logs.sources_mat import load_mat
from axisight.logs.sources_npz import load_npy, load_npz
from axisight.logs.sources_parquet import load_parquet

Arrays = Mapping[str, NDArray[Any]]


def is_folder_log(path: Path) -> bool:
    """Whether a path is a log that may be a folder: a recording, or an episode of LeRobot."""
    return is_bag(path) or is_lerobot(path)


def files_of(path: Path) -> list[Path]:
    """Return the files that a log consists of."""
    if is_lerobot(path):
        return files_of_episode(path)
    return sorted(p for p in path.iterdir() if p.is_file()) if path.is_dir() else [path]


def load_arrays(
    path: Path, csv: CsvOptions | None = None, budget: Budget | None = None
) -> LazyArrays:
    """Return the arrays of a file by (dotted) name, each read at the first access; scalars are 0-dimensional.

    The suffix chooses the format: .parquet, .csv, .tsv (both also with .gz), .json, .jsonl, .ndjson, .mat (v5
    or v7.3), .h5, .hdf5, .npy, .npz, or a recording (.mcap, .bag, .db3, or the folder of a rosbag2). A LeRobot
    folder is read by episode (`folder#3`).
    Declared sizes count against `budget`; the default budget follows from the size of the file.
    Raises LogError for a missing file, an unknown suffix, a missing episode, a truncated or corrupt file, and
    a file that is too large. Raises MissingExtraError if the library for the format is not installed.
    """
    budget = Budget() if budget is None else budget
    usable_path(path, LogError)
    folder = path.is_dir() and is_bag(path)
    suffix = ".db3" if folder else suffix_of(path)
    if is_lerobot(path):
        check_episode(path)
        folder, suffix = True, ".lerobot"
    loaders = _loaders(csv or CsvOptions())
    if suffix not in loaders:
        listed = ", ".join(known for known in loaders if known != ".lerobot")
        raise LogError(f"{path}: suffix: expected one of {listed}, got {short(suffix)!r}")
    if not path.is_file() and not folder:
        raise LogError(f"{path}: expected a file, got {'a folder' if path.is_dir() else 'nothing'}")
    budget.grow(files_of(path))
    try:
        found = loaders[suffix](path, budget)
    except MissingExtraError:
        raise
    except LogError as error:
        raise LogError(f"{path}: {error}") from error
    except Exception as error:  # corrupt files make the readers raise nearly anything
        kind = "parquet" if suffix == ".lerobot" else suffix[1:]
        raise LogError(f"{path}: {unreadable(error, kind)}") from error
    return found if isinstance(found, LazyArrays) else LazyArrays(found)


_Loader = Callable[[Path, Budget], LazyArrays | dict[str, Reader]]


def _loaders(csv: CsvOptions) -> dict[str, _Loader]:
    # The separator of a column map comes before that of the suffix.
    tabs = (
        csv if "separator" in csv.model_fields_set else csv.model_copy(update={"separator": "\t"})
    )

    def commas_separated(file: Path, budget: Budget) -> LazyArrays:
        return load_csv(file, budget, csv)

    def tabs_separated(file: Path, budget: Budget) -> LazyArrays:
        return load_csv(file, budget, tabs)

    return {
        ".parquet": load_parquet,
        **dict.fromkeys((".csv", ".csv.gz"), commas_separated),
        **dict.fromkeys((".tsv", ".tsv.gz"), tabs_separated),
        ".json": load_json,
        **dict.fromkeys((".jsonl", ".ndjson"), load_json_lines),
        ".mat": load_mat,
        **dict.fromkeys((".h5", ".hdf5"), load_hdf5),
        ".npy": load_npy,
        ".npz": load_npz,
        ".lerobot": load_lerobot,
        **dict.fromkeys(BAG_SUFFIXES, load_bag),
    }


LOG_SUFFIXES = frozenset(_loaders(CsvOptions())) - {".lerobot"}
"""Suffixes of files that can be logs."""


def suffix_of(path: Path) -> str:
    """Return the suffix that chooses the format, in lower case; of a file packed by gzip the last two."""
    suffix = path.suffix.lower()
    return Path(path.stem).suffix.lower() + suffix if is_packed(path) else suffix


def log_name(path: Path) -> str:
    """Return the name of a log: that of its file without the suffix, or that of its folder."""
    # A folder name has no suffix, even if it contains a dot.
    return path.name if is_lerobot(path) else path.name[: len(path.name) - len(suffix_of(path))]
