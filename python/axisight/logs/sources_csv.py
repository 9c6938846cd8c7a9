"""CSV files, as text or packed by gzip: a header of names, then rows of numbers."""

from __future__ import annotations

import gzip
import io
import warnings
from collections import Counter
from pathlib import Path
from typing import IO, Any, TextIO, cast

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from axisight.errors import LogError
from axisight.logs.budget import Budget
from axisight.logs.columns import CsvOptions
from axisight.logs.lazy import LazyArrays, Reader, given, refusing

# Wider tables are matrices of something else.
_MOST_COLUMNS = 10_000
_BLOCK = 2**20
UNENDED = "expected a line end behind the last row, as behind the others, got none: its last value may be cut"


def load_csv(path: Path, budget: Budget, options: CsvOptions, *, exact: bool = False) -> LazyArrays:
    """Return the columns of a CSV file by name; columns that share a name cannot be read.

    ``exact``: parse numbers to the last bit, which takes longer.

    A last line without a line end becomes a doubt, because the file may be cut inside its last number.
    Of a file packed by gzip, the text counts against the budget, too. Raises LogError for a table that is too
    wide or too large, or whose rows are longer than its header.
    """
    lines, ended = _lines(path, budget)
    with _text(path) as file:
        separator = _settle(file, options)
        first = pd.read_csv(
            file, sep=separator, header=None, nrows=1, dtype=str, skipinitialspace=True,
            index_col=False,
        )  # fmt: skip
    n_columns = first.shape[1]
    if n_columns > _MOST_COLUMNS:
        raise LogError(f"expected at most {_MOST_COLUMNS} columns, got {n_columns}")
    budget.take_values((lines, n_columns), 8)
    with _text(path) as file:
        _settle(file, options)
        frame = _whole(file, separator, options, exact)
    raw = [str(name).strip() for name in (first.iloc[0] if options.header else range(n_columns))]
    counts = Counter(raw)
    readers: dict[str, Reader] = {}
    for k, name in enumerate(raw):
        if counts[name] > 1:
            readers[name] = refusing(f"expected one column of that name, got {counts[name]}")
        elif k < frame.shape[1]:
            readers[name] = given(_column(frame, k))
    return LazyArrays(readers, () if ended else (UNENDED,))


def _whole(file: TextIO, separator: str, options: CsvOptions, exact: bool) -> pd.DataFrame:
    with warnings.catch_warnings():
        # pandas silently drops the end of rows that are longer than the header.
        warnings.filterwarnings("error", "Length of header", pd.errors.ParserWarning)
        try:
            return pd.read_csv(
                file,
                sep=separator,
                decimal=options.decimal,
                header=0 if options.header else None,
                skipinitialspace=True,
                index_col=False,
                float_precision="round_trip" if exact else None,
            )
        except pd.errors.ParserWarning:
            raise LogError(
                "expected as many values in every row as names in the header, got more: a comma may be the "
                "decimal mark (decimal, separator of the column map)"
            ) from None


def _column(frame: pd.DataFrame, k: int) -> NDArray[Any]:
    return np.asarray(frame.iloc[:, k].to_numpy())


def _settle(file: TextIO, options: CsvOptions) -> str:
    """Move the file past the lines to skip, and return the separator."""
    for _ in range(options.skip_rows):
        if not file.readline():
            break
    if options.separator != "auto":
        return options.separator
    start = file.tell()
    header = file.readline()
    file.seek(start)
    return next((mark for mark in "\t;," if mark in header), " ")


def header_line(path: Path) -> str:
    """Return the first line of a CSV file, packed or not."""
    with _text(path) as file:
        return file.readline()


def is_packed(path: Path) -> bool:
    """Whether a file is packed by gzip, by its suffix."""
    return path.suffix.lower() == ".gz"


def _bytes(path: Path) -> IO[bytes]:
    return cast(IO[bytes], gzip.open(path, "rb")) if is_packed(path) else path.open("rb")


def _text(path: Path) -> TextIO:
    return io.TextIOWrapper(cast(Any, _bytes(path)), encoding="utf-8", newline="")


def _lines(path: Path, budget: Budget) -> tuple[int, bool]:
    """Return an upper bound on the number of lines, and whether the last line ends as the others do.

    Raises LogError for a line that is too long, and for a packed text that exceeds the budget.
    """
    count, last = 0, b""
    with _bytes(path) as file:
        while block := file.read(_BLOCK):
            if is_packed(path):
                budget.take(len(block))
            ends = block.count(b"\n") + block.count(b"\r") - block.count(b"\r\n")
            if len(block) == _BLOCK and not ends:
                raise LogError("expected lines of at most 1 MiB, got a longer one")
            count += ends
            last = block[-1:]
    return count + 1, last in (b"\n", b"\r", b"") or count < 2
