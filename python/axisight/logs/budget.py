"""The memory limit for reading a log, checked against the declared sizes before reading."""

from __future__ import annotations

from collections.abc import Iterable
from math import prod
from pathlib import Path

from axisight.arguments import whole
from axisight.errors import LogError

BASE_BYTES = 64 * 2**20
"""Bytes that every log may take."""
BYTES_PER_BYTE = 16
"""Further bytes that a log may take per byte of its files; measured data compress by a smaller factor."""

_MOST = 2**62


class Budget:
    """The bytes that one log may take: `max_bytes`, or by default a limit from the size of its files.

    Arrays count when they are read, and signals count again when they are made from them. Reading takes at
    most twice the limit on top of the memory in use before. Raises InputError for a `max_bytes` that is not a
    whole number from 1.
    """

    def __init__(self, max_bytes: int | None = None) -> None:
        self._given = None if max_bytes is None else whole("max_bytes", max_bytes, most=_MOST)
        self._grown = BASE_BYTES
        self._taken = 0

    @property
    def limit(self) -> int:
        """The largest number of bytes that may be taken."""
        return self._grown if self._given is None else self._given

    def grow(self, files: Iterable[Path]) -> None:
        """Raise the limit by the sizes of files that belong to the log."""
        self._grown += BYTES_PER_BYTE * sum(file.stat().st_size for file in files if file.is_file())

    def take(self, declared_bytes: int) -> None:
        """Count bytes before they are taken; raise LogError if the total exceeds the limit."""
        taken = self._taken + declared_bytes
        if taken > self.limit:
            raise LogError(
                f"expected at most {_megabytes(self.limit)} MB to be needed for a log of this size, got "
                f"{_megabytes(taken)} MB by what the file declares; max_bytes (--max-bytes) raises "
                f"the limit"
            )
        self._taken = taken

    def take_values(self, shape: Iterable[int], item_bytes: int) -> None:
        """Count an array by its shape and its bytes per item; raise LogError as `take`."""
        self.take(prod(map(int, shape)) * int(item_bytes))


def _megabytes(size: int) -> str:
    return f"{size / 1e6:.6g}" if size < _MOST else "more than 4e12"
