"""Opening a file of any format as named arrays, whatever they mean."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
from numpy.typing import NDArray

from axisight.errors import LogError, MissingExtraError
from axisight.logs.columns import CsvOptions
from axisight.logs.sources_bag import BAG_SUFFIXES, is_bag, load_bag
from axisight.logs.sources_hdf5 import load_hdf5
from axisight.logs.sources_mat import load_mat

Arrays = dict[str, NDArray[Any]]


def load_arrays(path: Path, csv: CsvOptions | None = None) -> Arrays:
    """Return every array of the file by (dotted) name; scalars are 0-dimensional.

    The suffix chooses the format: .parquet, .csv, .mat (v5 or v7.3), .h5, .hdf5, .npz, or a recording of
    ROS (.mcap, .bag, .db3, or the folder of a rosbag2). Raises MissingExtraError for one without the
    library that reads it, LogError for a missing file, an unknown suffix, and a truncated or corrupt file.
    """
    loaders: dict[str, Callable[[Path], Arrays]] = {
        ".parquet": _load_parquet,
        ".csv": lambda file: _load_csv(file, csv or CsvOptions()),
        ".mat": load_mat,
        ".h5": load_hdf5,
        ".hdf5": load_hdf5,
        ".npz": _load_npz,
        **dict.fromkeys(BAG_SUFFIXES, load_bag),
    }
    folder_of_bag = path.is_dir() and is_bag(path)
    suffix = ".db3" if folder_of_bag else path.suffix.lower()
    if suffix not in loaders:
        raise LogError(f"{path}: suffix: expected one of {', '.join(loaders)}, got {suffix!r}")
    if not path.is_file() and not folder_of_bag:
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


def _load_parquet(path: Path) -> Arrays:
    # Not pandas.read_parquet: that turns a stored index such as time_s into no column at all
    table = pq.read_table(path)
    return {
        name: np.asarray(column.to_numpy())
        for name, column in zip(table.column_names, table.columns, strict=True)
    }


def _load_csv(path: Path, options: CsvOptions) -> Arrays:
    frame = pd.read_csv(
        path,
        sep=options.separator,
        decimal=options.decimal,
        header=0 if options.header else None,
        skiprows=options.skip_rows,
        skipinitialspace=True,
        index_col=False,
    )
    return {str(name).strip(): frame[name].to_numpy() for name in frame.columns}


def _load_npz(path: Path) -> Arrays:
    # np.load leaks its own file handle when the archive is damaged
    with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
        return {name: archive[name] for name in archive.files}
