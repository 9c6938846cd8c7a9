"""Dates as time stamps: ISO 8601 texts and dates in tables, as seconds from the first."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from axisight.arguments import shown
from axisight.errors import LogError
from axisight.logs.log import Floats

EXAMPLE = "2024-05-01T12:00:00.5Z"
"""An ISO 8601 stamp, for messages."""

_STAMP = re.compile(
    r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d(\.\d{1,9})?)? ?(?P<zone>Z|[+-]\d\d(:?\d\d)?)?"
)


def are_dates(values: NDArray[Any]) -> bool:
    """Whether values (n,) are dates, or texts of which the first is an ISO 8601 stamp."""
    if values.ndim != 1 or not values.size:
        return False
    if values.dtype.kind == "M":
        return True
    first = values[0]
    return isinstance(first, str) and _STAMP.fullmatch(first.strip()) is not None


def seconds_from_first(values: NDArray[Any]) -> Floats:
    """Return dates or ISO 8601 texts (n,) as seconds (n,) from the first; NaN where one is missing.

    Stamps have a zone throughout or nowhere; without a zone, every day counts 24 hours. Raises LogError, naming
    the first value that is no stamp.
    """
    if values.dtype.kind == "M":
        dates = pd.DatetimeIndex(values)
    else:
        texts: list[Any] = [None if _is_missing(value) else value for value in values.tolist()]
        _check(texts)
        try:
            dates = pd.DatetimeIndex(pd.to_datetime(texts, utc=True, format="ISO8601"))
        except (ValueError, OverflowError) as error:
            reason = str(error).splitlines()[0]
            raise LogError(
                f"expected ISO 8601 stamps such as {EXAMPLE}, got {shown(reason)}"
            ) from error
    there = dates[dates.notna()]
    if not len(there):
        return np.full(len(dates), np.nan)
    return np.asarray((dates - there[0]).total_seconds(), dtype=np.float64)


def _is_missing(value: object) -> bool:
    return value is None or (isinstance(value, float) and np.isnan(value))


def _check(texts: list[Any]) -> None:
    """Raise LogError for a text that is no stamp, and for stamps of which only some have a zone."""
    zoned: bool | None = None
    for index, text in enumerate(texts):
        if text is None:
            continue
        match = _STAMP.fullmatch(text.strip()) if isinstance(text, str) else None
        if match is None:
            raise LogError(f"expected an ISO 8601 stamp, got {shown(text)} at index {index}")
        has = match["zone"] is not None
        if zoned is not None and has != zoned:
            raise LogError(
                f"expected stamps with a zone throughout or without one throughout, got {shown(text)} at "
                f"index {index}"
            )
        zoned = has
