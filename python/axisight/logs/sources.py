"""Opening a file of any format as named arrays, whatever they mean."""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from axisight.errors import LogError, MissingExtraError
from axisight.logs.columns import CsvOptions
from axisight.logs.sources_bag import BAG_SUFFIXES, is_bag, load_bag
from axisight.logs.sources_hdf5 import load_hdf5
from axisight.logs.sources_lerobot import (
    check_episode,
    files_of_episode,
    is_lerobot,
    load_lerobot,
)
from axisight.logs.sources_mat import load_mat
from axisight.logs.sources_parquet import load_parquet

Arrays = dict[str, NDArray[Any]]


def is_folder_log(path: Path) -> bool:
    """Whether a path is a log though it may be no file: a recording of ROS, an episode of LeRobot."""
    return is_bag(path) or is_lerobot(path)


def files_of(path: Path) -> list[Path]:
    """Return the files that a log consists of."""
    if is_lerobot(path):
        return files_of_episode(path)
    return sorted(p for p in path.iterdir() if p.is_file()) if path.is_dir() else [path]


def load_arrays(path: Path, csv: CsvOptions | None = None) -> Arrays:
    """Return every array of the file by (dotted) name; scalars are 0-dimensional.

    The suffix chooses the format: .parquet, .csv, .mat (v5 or v7.3), .h5, .hdf5, .npz, or a recording of
    ROS (.mcap, .bag, .db3, or the folder of a rosbag2). A folder of LeRobot is another log, of one
    episode (`folder#3`). Raises MissingExtraError for one without the library that reads it, LogError for
    a missing file, an unknown suffix, an episode that is not there, and a truncated or corrupt file.
    """
    loaders: dict[str, Callable[[Path], Arrays]] = {
        ".parquet": load_parquet,
        ".csv": lambda file: _load_csv(file, csv or CsvOptions()),
        ".mat": load_mat,
        ".h5": load_hdf5,
        ".hdf5": load_hdf5,
        ".npz": _load_npz,
        **dict.fromkeys(BAG_SUFFIXES, load_bag),
    }
    folder = path.is_dir() and is_bag(path)
    suffix = ".db3" if folder else path.suffix.lower()
    if is_lerobot(path):
        check_episode(path)
        folder, suffix, loaders = True, ".parquet", {".parquet": load_lerobot}
    if suffix not in loaders:
        raise LogError(f"{path}: suffix: expected one of {', '.join(loaders)}, got {suffix!r}")
    if not path.is_file() and not folder:
        raise LogError(f"{path}: expected a file, got {'a folder' if path.is_dir() else 'nothing'}")
    try:
        return loaders[suffix](path)
    except MissingExtraError:
        raise
    except MemoryError:
        raise LogError(f"{path}: truncated, corrupt or too large for memory") from None
    except Exception as error:  # corrupt files make the readers raise nearly anything
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise LogError(
            f"{path}: expected a readable {suffix[1:]} file, got one that is truncated, corrupt or "
            f"of another format ({reason}) [file_unreadable]"
        ) from error


def _load_csv(path: Path, options: CsvOptions) -> Arrays:
    separator = options.separator
    frame = pd.read_csv(
        path,
        sep=_separator(path, options.skip_rows) if separator == "auto" else separator,
        decimal=options.decimal,
        header=0 if options.header else None,
        skiprows=options.skip_rows,
        skipinitialspace=True,
        index_col=False,
    )
    return {str(name).strip(): frame[name].to_numpy() for name in frame.columns}


def _separator(path: Path, skip_rows: int) -> str:
    """Return what stands between the names of a header: a tab or semicolon, comma, or else a space."""
    with path.open(encoding="utf-8") as file:
        header = next(islice(file, skip_rows, None), "")
    return next((mark for mark in "\t;," if mark in header), " ")


def _load_npz(path: Path) -> Arrays:
    # np.load leaks its own file handle when the archive is damaged
    with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
        return {name: archive[name] for name in archive.files}
