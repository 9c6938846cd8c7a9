"""Channels of a log on different clocks, by the controller's law."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from axisight.gap.gate.by_controller.control_law import ControlLaw, LawFit

# Looked for up to here, or a tenth of the log.
_REACH_S = 0.25
# Channels of one drive arrive within a sample or two of one another; less than this is no fault.
_LEAST_S = 3e-3
# A shift that is the mistake leaves next to nothing; on smooth motions other gains look like one, and
# leave a third.
_LEFT = 0.1


@dataclass(frozen=True)
class Shift:
    """A channel that is late (positive) or early, and the law's fit without that."""

    field: str
    seconds: float
    fit: LawFit


def best_shift(law: ControlLaw, axis: int, believed: Callable[[LawFit], bool]) -> Shift | None:
    """Return the shift of one channel of ``axis`` (from 0) that makes the law hold, or None.

    ``believed``: whether a fit is as good as that of a law that holds.
    """
    reach = min(int(_REACH_S / law.sample_time_s), len(law.torque) // 10)
    given = law.fit(axis, axis, axis)
    most_left = _LEFT * (1.0 - given.explained)
    moves = (True, np.isfinite(given.reference), np.isfinite(given.position))
    best: Shift | None = None
    for place, field in enumerate(("torque", "velocity_ref", "position")):
        if not moves[place]:
            # A channel that stands is nowhere late: the law holds once the start is left out.
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
