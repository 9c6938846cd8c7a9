"""Check recorded signals: their shape, and that all numbers are finite."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from axisight.arguments import Real, real_array, shown
from axisight.errors import InputError


def recorded(name: str, value: object, axes: Sequence[str]) -> Real:
    """Return a contiguous float64 array over ``axes``; raise InputError with the place of the first fault."""
    array = real_array(value)
    if array is None or array.ndim != len(axes) or 0 in array.shape:
        got = shown(value) if array is None else f"shape {array.shape}"
        raise InputError(f"{name}: expected axes ({', '.join(axes)}), none empty, got {got}")
    array = np.ascontiguousarray(array, dtype=np.float64)
    bad = np.argwhere(~np.isfinite(array))
    if len(bad):
        at = bad[0]
        where = ", ".join(f"{axis} {i + 1}" for axis, i in zip(axes, at, strict=True))
        raise InputError(
            f"{name}: expected finite numbers, got {array[tuple(at)]} in {where} "
            f"({len(bad)} in all)"
        )
    return array
