"""The single signals of a file: its vectors, and the rows or columns of its matrices."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight.arguments import shown
from axisight.logs.log import Floats

# A matrix with more signals than this does not hold signals of axes.
_MOST = 32


TEXTS = "no numbers"
"""First words of the reason why a column of texts is no signal."""


@dataclass(frozen=True, eq=False)
class Series:
    """One signal (n,) and its address: ``index`` selects it from a matrix, ``row`` is its number there."""

    name: str
    values: Floats
    index: str | None = None
    row: int | None = None

    @property
    def label(self) -> str:
        """The address as it appears in messages."""
        return self.name if self.index is None else f"{self.name}[{self.index}]"


def series_of(arrays: Mapping[str, NDArray[Any]]) -> tuple[list[Series], dict[str, str]]:
    """Return the signals of a file, and by name the reasons why other arrays are not signals.

    The most frequent length of the arrays is taken as the number of samples.
    """
    lengths = Counter(
        max(values.shape) for values in arrays.values() if values.ndim in (1, 2) and values.size > 1
    )
    n = max(lengths, key=lambda size: (lengths[size] * (size > 2), size), default=0)
    found: list[Series] = []
    other: dict[str, str] = {}
    for name, values in arrays.items():
        numbers = _numbers(values)
        if values.ndim == 0 or values.size <= 1:
            other[name] = "one value, no signal"
        elif numbers is None:
            other[name] = _texts(values)
        elif n not in values.shape or values.ndim > 2:
            other[name] = f"of shape {values.shape}, where signals have {n} samples"
        elif values.ndim == 1:
            found.append(Series(name, numbers))
        elif values.size > n * _MOST:
            other[name] = f"of shape {values.shape}: too many signals"
        else:
            across = values.shape[0] == n
            for k in range(values.size // n):
                one = numbers[:, k] if across else numbers[k]
                found.append(Series(name, one, f":,{k}" if across else f"{k},:", k))
    return found, other


def _texts(values: NDArray[Any]) -> str:
    """Return why values are no numbers: the first row that holds a text, counted from 1 below the header."""
    for row, value in enumerate(values.ravel().tolist(), start=1):
        try:
            float(value)
        except (TypeError, ValueError):
            if value is not None:
                return f"{TEXTS}: row {row} is {shown(value)}"
    return TEXTS


def _numbers(values: NDArray[Any]) -> Floats | None:
    if values.dtype.kind == "O":
        try:
            return np.array([np.nan if v is None else v for v in values], dtype=np.float64)
        except (TypeError, ValueError):
            return None
    return values.astype(np.float64) if values.dtype.kind in "iuf" else None
