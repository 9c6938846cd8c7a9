"""Parquet files; columns that hold a list per sample become one column for each of its entries."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray


def load_parquet(path: Path, filters: Any = None) -> dict[str, NDArray[Any]]:
    """Return the columns of a file by name; ``filters``, those of pyarrow, choose rows.

    A column `q` of lists that are all as long becomes `q[0]`, `q[1]`, ...
    """
    # Not pandas.read_parquet: that turns a stored index such as time_s into no column at all
    table = pq.read_table(path, filters=filters, partitioning=None)
    out: dict[str, NDArray[Any]] = {}
    for name, column in zip(table.column_names, table.columns, strict=True):
        matrix = _matrix(column)
        if matrix is None:
            out[name] = np.asarray(column.to_numpy())
        else:
            out |= {f"{name}[{k}]": values for k, values in enumerate(matrix.T)}
    return out


def _matrix(column: Any) -> NDArray[Any] | None:
    """Return a column of lists of numbers that are all as long as (samples, entries)."""
    kind = column.type
    lists = pa.types.is_list(kind) or pa.types.is_large_list(kind)
    if not (lists or pa.types.is_fixed_size_list(kind)) or column.null_count or not len(column):
        return None
    if not (pa.types.is_floating(kind.value_type) or pa.types.is_integer(kind.value_type)):
        return None
    lengths = np.unique([len(entry) for entry in column])
    if lengths.size != 1 or lengths[0] == 0:
        return None
    values = pa.concat_arrays([chunk.flatten() for chunk in column.chunks])
    return np.asarray(values.to_numpy(zero_copy_only=False)).reshape(len(column), -1)
