"""The named arrays of a file, each read at the first access."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight.arguments import short
from axisight.errors import LogError, MissingExtraError

Reader = Callable[[], NDArray[Any]]
"""Function that reads one array, after it has counted the declared size against a budget."""


class LazyArrays(Mapping[str, NDArray[Any]]):
    """Arrays by (dotted) name; scalars are 0-dimensional.

    Names are known at once; the first access reads the values and keeps them. An access raises KeyError for
    an unknown name and LogError if the values cannot be read. ``doubts`` concern the whole file.
    """

    def __init__(self, readers: Mapping[str, Reader], doubts: tuple[str, ...] = ()) -> None:
        self._readers = dict(readers)
        self._read: dict[str, NDArray[Any]] = {}
        self.doubts = doubts

    @classmethod
    def of(cls, arrays: Mapping[str, NDArray[Any]]) -> LazyArrays:
        """Wrap arrays that are in memory already."""
        return cls({name: given(values) for name, values in arrays.items()})

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return an array; the first access reads it."""
        if name not in self._read:
            read = self._readers[name]
            try:
                self._read[name] = read()
            except (LogError, MissingExtraError):
                raise
            except Exception as error:  # corrupt files make the readers raise nearly anything
                raise LogError(unreadable(error)) from error
        return self._read[name]

    def readable(self) -> tuple[dict[str, NDArray[Any]], dict[str, str]]:
        """Read everything; return the arrays that could be read, and the reasons for the others, by name."""
        found: dict[str, NDArray[Any]] = {}
        others: dict[str, str] = {}
        for name in self:
            try:
                found[name] = self[name]
            except LogError as error:
                others[name] = str(error)
        return found, others

    def __contains__(self, name: object) -> bool:
        """Return whether the file has an array of that name, without reading it."""
        return name in self._readers

    def __iter__(self) -> Iterator[str]:
        """Return the names in the order of the file."""
        return iter(self._readers)

    def __len__(self) -> int:
        """Return the number of arrays."""
        return len(self._readers)


def unreadable(error: Exception, kind: str = "") -> str:
    """Return the message for a file (of a ``kind``) whose reader raised an error."""
    if isinstance(error, MemoryError):
        return "truncated, corrupt or too large for memory"
    reason = str(error).splitlines()[0] if str(error).strip() else type(error).__name__
    return (
        f"expected a readable {f'{kind} ' if kind else ''}file, got one that is truncated, corrupt or "
        f"of another format ({short(reason, 200)}) [file_unreadable]"
    )


def refusing(message: str) -> Reader:
    """Return a reader that raises LogError, so that an unreadable array matters only if a map needs it."""

    def refuse() -> NDArray[Any]:
        raise LogError(message)

    return refuse


def given(values: NDArray[Any]) -> Reader:
    """Return a reader of values that are in memory already."""
    return lambda: np.asarray(values)
