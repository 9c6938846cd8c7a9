"""How much memory the reading of a log may take: what a file declares is held against it beforehand."""

from __future__ import annotations

from collections.abc import Iterable
from math import prod
from pathlib import Path

from axisight.arguments import whole
from axisight.errors import LogError

BASE_BYTES = 64 * 2**20
"""What any log may take."""
BYTES_PER_BYTE = 16
"""What it may take besides for each byte of its files: more than measured data are packed by."""

_MOST = 2**62


class Budget:
    """What one log may take in bytes, as read and again as signals: by the size of its files, or as said.

    Reading takes at most twice the limit, besides what is loaded anyway.
    """

    def __init__(self, max_bytes: int | None = None) -> None:
        self._given = None if max_bytes is None else whole("max_bytes", max_bytes, most=_MOST)
        self._grown = BASE_BYTES
        self._taken = 0

    @property
    def limit(self) -> int:
        """The most bytes that may be taken."""
        return self._grown if self._given is None else self._given

    def grow(self, files: Iterable[Path]) -> None:
        """Allow for the sizes of files that belong to the log."""
        self._grown += BYTES_PER_BYTE * sum(file.stat().st_size for file in files if file.is_file())

    def take(self, declared_bytes: int) -> None:
        """Count bytes about to be taken; raises LogError where all of them are more than the limit."""
        taken = self._taken + declared_bytes
        if taken > self.limit:
            raise LogError(
                f"expected at most {_megabytes(self.limit)} MB to be needed for a log of this size, got "
                f"{_megabytes(taken)} MB by what the file declares; max_bytes (--max-bytes) raises "
                f"the limit"
            )
        self._taken = taken

    def take_values(self, shape: Iterable[int], item_bytes: int) -> None:
        """Count an array of a shape and bytes per item."""
        self.take(prod(map(int, shape)) * int(item_bytes))


def _megabytes(size: int) -> str:
    return f"{size / 1e6:.6g}" if size < _MOST else "more than 4e12"
