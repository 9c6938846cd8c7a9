"""How much memory the reading of a log may take: what a file declares is held against it beforehand."""

from __future__ import annotations

from collections.abc import Iterable
from math import prod
from pathlib import Path

from axisight.arguments import whole
from axisight.errors import LogError

BASE_BYTES = 64 * 2**20
"""What any log may declare."""
BYTES_PER_BYTE = 8
"""What it may declare besides for each byte of its files: more than measured data are ever packed by."""

# Signals become float64, whatever they are stored as.
_SIGNAL_ITEM = 8
_MOST = 2**62


class Budget:
    """What one log may declare, in bytes as signals: by the size of its files, or as the caller says."""

    def __init__(self, max_bytes: int | None = None) -> None:
        self._given = None if max_bytes is None else whole("max_bytes", max_bytes, most=_MOST)
        self._grown = BASE_BYTES
        self._taken = 0

    @property
    def limit(self) -> int:
        """The most bytes that may be declared."""
        return self._grown if self._given is None else self._given

    def grow(self, files: Iterable[Path]) -> None:
        """Allow for the sizes of files that belong to the log."""
        self._grown += BYTES_PER_BYTE * sum(file.stat().st_size for file in files if file.is_file())

    def take(self, declared_bytes: int) -> None:
        """Count bytes about to be read; raises LogError where all of them are more than the limit."""
        taken = self._taken + declared_bytes
        if taken > self.limit:
            raise LogError(
                f"expected at most {_megabytes(self.limit)} MB to be read of a log of this size, got a "
                f"file that declares {_megabytes(taken)} MB so far; read_log(..., max_bytes=...) "
                f"raises the limit"
            )
        self._taken = taken

    def take_values(self, shape: Iterable[int], item_bytes: int) -> None:
        """Count an array of a shape, as the numbers of 8 bytes that become of it."""
        self.take(prod(map(int, shape)) * max(int(item_bytes), _SIGNAL_ITEM))


def _megabytes(size: int) -> str:
    return f"{size / 1e6:.6g}" if size < _MOST else "more than 4e12"
