"""Read Parquet files; a column with a list per sample becomes one column per list entry."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute
import pyarrow.parquet as pq
from numpy.typing import NDArray

from axisight.errors import LogError
from axisight.logs.budget import Budget
from axisight.logs.lazy import Reader, refusing
from axisight.logs.parquet_footer import chunks

# A list with more entries per sample than this does not hold signals of axes.
_MOST_ENTRIES = 4096


def load_parquet(path: Path, budget: Budget, filters: Any = None) -> dict[str, Reader]:
    """Return a reader for every column, by name; ``filters`` (see pyarrow) select rows.

    A column `q` with lists of equal length becomes `q[0]`, `q[1]`, ... Raises LogError for a damaged footer;
    a reader raises LogError for values that are not numbers and for lists of unequal length.
    """
    with pq.ParquetFile(path) as file:
        metadata, schema = file.metadata, file.schema_arrow
    leaves = _leaves(path)
    readers: dict[str, Reader] = {}
    for field in schema:
        if schema.names.count(field.name) > 1:
            said = f"expected one column of that name, got {schema.names.count(field.name)}"
            readers[field.name] = refusing(said)
            continue
        values, size = leaves.get(field.name, (0, 0))
        one = _Column(path, budget, filters, field, values, size)
        entries = _entries(field.type, values, metadata.num_rows)
        if entries:
            matrix = cache(one.matrix)
            readers |= {f"{field.name}[{k}]": _entry(matrix, entries, k) for k in range(entries)}
        else:
            readers[field.name] = one.plain
    return readers


def _leaves(path: Path) -> dict[str, tuple[int, int]]:
    """Return, by column, the declared number of values and of uncompressed bytes."""
    found: dict[str, tuple[int, int]] = {}
    for chunk in chunks(path):
        for own in {chunk.path, *_column_of(chunk.path)}:
            values, size = found.get(own, (0, 0))
            found[own] = values + chunk.values, size + chunk.unpacked_bytes
    return found


def _column_of(path: str) -> Iterator[str]:
    """Yield all columns that a leaf may belong to, as names of columns may contain dots."""
    while "." in path:
        path = path.rpartition(".")[0]
        yield path


def _entries(kind: Any, values: int, rows: int) -> int:
    """Return the entries per sample of a column whose lists may have equal length; 0 for other columns."""
    lists = pa.types.is_list(kind) or pa.types.is_large_list(kind)
    if not (lists or pa.types.is_fixed_size_list(kind)) or not rows:
        return 0
    if not (pa.types.is_floating(kind.value_type) or pa.types.is_integer(kind.value_type)):
        return 0
    entries, rest = divmod(values, rows)
    return 0 if rest or entries > _MOST_ENTRIES else entries


def _entry(matrix: Any, entries: int, k: int) -> Reader:
    def read() -> NDArray[Any]:
        values = matrix()
        if values.shape[1] != entries:
            raise LogError(f"expected lists of {entries} numbers, got {values.shape[1]}")
        return np.asarray(values[:, k])

    return read


class _Column:
    """One column of a file, with its declared size."""

    def __init__(
        self, path: Path, budget: Budget, filters: Any, field: Any, values: int, size: int
    ) -> None:
        self._path = path
        self._budget = budget
        self._filters = filters
        self._field = field
        self._declared = max(8 * values, size)

    def _read(self) -> Any:
        self._budget.take(self._declared)
        # Not pandas.read_parquet, which does not return a stored index such as time_s as a column.
        table = pq.read_table(
            self._path, columns=[self._field.name], filters=self._filters, partitioning=None
        )
        return table.column(self._field.name)

    def plain(self) -> NDArray[Any]:
        """Return the values (n,) of a column with one value per sample."""
        kind = self._field.type
        numbers = (pa.types.is_integer, pa.types.is_floating, pa.types.is_boolean)
        fixed = (pa.types.is_decimal, pa.types.is_temporal, pa.types.is_null)
        # Text is refused: many rows may share one stored text, so no declared size bounds the memory.
        if not any(is_kind(kind) for is_kind in (*numbers, *fixed)):
            raise LogError(f"expected numbers, got values of type {kind}")
        return np.asarray(self._read().to_numpy())

    def matrix(self) -> NDArray[Any]:
        """Return a column with lists of equal length as an array (samples, entries)."""
        column = self._read()
        if column.null_count:
            raise LogError(f"expected a list for every sample, got {column.null_count} without one")
        lengths = pa.compute.list_value_length(column).unique().to_pylist()
        if len(lengths) > 1:
            raise LogError(
                f"expected lists that are all as long, got lengths {sorted(lengths)[:8]}"
            )
        if not len(column):
            return np.empty((0, 0))
        values = pa.concat_arrays([chunk.flatten() for chunk in column.chunks])
        return np.asarray(values.to_numpy(zero_copy_only=False)).reshape(len(column), -1)
