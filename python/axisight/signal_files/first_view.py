"""What viewers show first: the axis, the log and the time of the largest gap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

# Share of a log that the first view shows.
_SHOWN = 0.1


@dataclass(frozen=True)
class FirstView:
    """``log`` and ``axis``: places from 0, in the signals and in their axes; from ``start_s`` to ``stop_s`` [s]."""

    log: int
    axis: int
    start_s: float
    stop_s: float


def first_view(signals: Sequence[xr.Dataset]) -> FirstView:
    """Return where the simulator as given is furthest off.

    The axis is that with the largest gap of the verdict (``gap_before``; none counts as the largest, since there the
    simulation broke off). The log is the validation log with the largest gap on this axis, and the time is the tenth
    of this log with the largest residual.
    """
    gaps = np.asarray(signals[0]["gap_before"].values, dtype=np.float64)
    axis = int(np.argmax(np.where(np.isnan(gaps), np.inf, gaps)))
    log = max(range(len(signals)), key=lambda k: _rank(signals[k], axis))
    time = signals[log]["time_s"].values
    squares = _squares(signals[log], axis)
    n = max(2, round(_SHOWN * len(time)))
    sums = np.concatenate([[0.0], np.cumsum(np.nan_to_num(squares, posinf=0.0))])
    start = int(np.argmax(sums[n:] - sums[:-n])) if len(time) > n else 0
    stop = min(start + n, len(time)) - 1
    return FirstView(log, axis, float(time[start]), float(time[stop]))


def _rank(data: xr.Dataset, axis: int) -> tuple[bool, float]:
    """Return whether a log was held back, and its squared gap on an axis [1], infinite if the simulation broke off."""
    variance = float(np.var(data["measured_torque_nm"].values[:, axis]))
    gap = float(np.mean(_squares(data, axis))) / max(variance, np.finfo(np.float64).tiny)
    return data.attrs["role"] == "validation", np.inf if np.isnan(gap) else gap


def _squares(data: xr.Dataset, axis: int) -> NDArray[np.float64]:
    residual: NDArray[np.float64] = data["residual_before_torque_nm"].values[:, axis]
    return residual**2
