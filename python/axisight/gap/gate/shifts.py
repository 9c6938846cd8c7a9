"""Channels of a log on different clocks, by the controller's law."""

from __future__ import annotations

from dataclasses import dataclass

from axisight.gap.gate.control_law import ControlLaw

# Looked for up to here, or a tenth of the log.
_REACH_S = 0.25
# Channels of one drive arrive within a sample or two of one another; less than this is no fault.
_LEAST_S = 3e-3


@dataclass(frozen=True)
class Shift:
    """A channel that is late (positive) or early, and what the law explains without that."""

    field: str
    seconds: float
    explained: float


def best_shift(law: ControlLaw, axis: int, least_explained: float) -> Shift | None:
    """Return the shift of one channel of ``axis`` (from 0) that makes the law hold, or None."""
    n = len(law.torque)
    reach = min(int(_REACH_S / law.sample_time_s), n // 10)
    best: Shift | None = None
    for place, field in enumerate(("torque", "velocity_ref", "position")):
        for lag in range(-reach, reach + 1):
            shifts = tuple(lag if p == place else 0 for p in range(3))
            fit = law.fit(axis, axis, axis, (shifts[0], shifts[1], shifts[2]))
            if fit.explained >= least_explained and (
                best is None or fit.explained > best.explained
            ):
                best = Shift(field, lag * law.sample_time_s, fit.explained)
    return best if best is not None and abs(best.seconds) >= _LEAST_S else None
