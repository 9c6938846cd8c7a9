"""Finds channels of a log on different clocks, by the controller's law."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from axisight.gap.gate.by_controller.control_law import ControlLaw, LawFit

# Largest shift that is tried [s]; at most a tenth of the log.
_REACH_S = 0.25
# Smallest shift that is a fault [s]: channels of one drive arrive within a sample or two.
_LEAST_S = 3e-3
# Largest share of the law's error that the shift may leave. A true shift leaves almost nothing; other gains on
# a smooth motion look like a shift, and leave a third.
_LEFT = 0.1


@dataclass(frozen=True)
class Shift:
    """A channel that is late (positive) or early, and the law's fit with the shift undone."""

    field: str
    seconds: float
    fit: LawFit


def best_shift(law: ControlLaw, axis: int, believed: Callable[[LawFit], bool]) -> Shift | None:
    """Return the shift of one channel of ``axis`` (from 0) with which the law holds; None without one.

    ``believed``: whether a fit is as good as for a law that holds.
    """
    reach = min(int(_REACH_S / law.sample_time_s), len(law.torque) // 10)
    given = law.fit(axis, axis, axis)
    most_left = _LEFT * (1.0 - given.explained)
    moves = (True, np.isfinite(given.reference), np.isfinite(given.position))
    best: Shift | None = None
    for place, field in enumerate(("torque", "velocity_ref", "position")):
        if not moves[place]:
            # A constant channel has no delay; without the start of the log the law would hold at any lag.
            continue
        lag, fit = _best_lag(law, axis, place, range(-reach, reach + 1, law.step))
        lag, fit = _best_lag(law, axis, place, range(lag - law.step, lag + law.step + 1))
        holds = believed(fit) and 1.0 - fit.explained < most_left
        if holds and (best is None or fit.explained > best.fit.explained):
            best = Shift(field, lag * law.sample_time_s, fit)
    return best if best is not None and abs(best.seconds) >= _LEAST_S else None


def _best_lag(law: ControlLaw, axis: int, place: int, lags: range) -> tuple[int, LawFit]:
    """Return the lag of torque (0), reference (1) or position (2) with the best fit."""
    found = []
    for lag in lags:
        shifts = [0, 0, 0]
        shifts[place] = lag
        fit = law.fit(axis, axis, axis, shifts=(shifts[0], shifts[1], shifts[2]))
        found.append((lag, fit))
    return max(found, key=lambda one: one[1].explained)
