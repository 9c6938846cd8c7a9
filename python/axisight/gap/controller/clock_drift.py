"""A machine whose clock runs at another rate than that of its references, found from logs without a fit.

With one clock, the stated controller gives the logged torque from references and measured positions. With two,
it does so only if the references are taken at the times of the machine's clock. The shift grows along the log.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.effects import effect_info
from axisight.effects.stated import CLOCK
from axisight.gap.facts.algebraic_cause import AlgebraicCause
from axisight.gap.facts.result import Interval
from axisight.logs import Log

Array = NDArray[np.float64]

Missed = Callable[[Log, int], float]
"""Return the sum of squares of the torque of a log on an axis (from 0) that the stated controller does not give."""

# Shift of the references at the end of a log [s] that tells two rates of a clock apart.
_APART_S = 1e-3
# Share of the stated controller's squared error that a log may keep with the drifting clock.
_LEFT = 0.02
# Half-width of the interval of the rate, relative. Logs do not contain the references between samples.
_OF_THE_RATE = 0.01


def with_drift(log: Log, rate: float) -> Log:
    """Return a log whose references are taken at the times of a clock that is fast by the relative ``rate`` [1]."""
    reference = log.velocity_ref_rad_s
    assert reference is not None  # closed loop only
    at = np.arange(log.n_samples)
    met = [np.interp((1 + rate) * at, at, column) for column in reference.T]
    return replace(log, velocity_ref_rad_s=np.column_stack(met))


def drifting_clock(
    logs: Sequence[Log], stated: Array, shows: Array, missed: Missed
) -> AlgebraicCause | None:
    """Return the drift of the machine's clock as a cause; None if it does not explain the controller's error.

    ``stated`` (n_axes, n_logs): squared error of the torque that the controller of the robot file gives.
    ``shows``, same shape: whether that error is above the noise. The drift has to explain 98 % of it on each
    of these axes and logs.
    """
    places = np.argwhere(shows)
    axis, log = max(places.tolist(), key=lambda at: float(stated[at[0], at[1]]))
    start = _nearest(logs[log], lambda x: missed(x, axis))

    def left(rate: float) -> Array:
        drifting = {i: with_drift(logs[i], rate) for i in {int(i) for _, i in places}}
        return np.array([missed(drifting[i], a) for a, i in places.tolist()])

    reach = _APART_S / _duration(logs[log])
    found = scipy.optimize.minimize_scalar(
        lambda rate: float(left(rate).sum()),
        bounds=(start - reach, start + reach),
        method="bounded",
    )
    rate = float(found.x)
    before = stated[tuple(places.T)]
    after = left(rate)
    if np.any(after > _LEFT * before):
        return None
    explained = float(1.0 - after.sum() / before.sum())
    doubt = _OF_THE_RATE * abs(rate)
    says = (
        f"The machine's clock is {1e6 * rate:.4g} ppm faster than that of the references. With that, the error of "
        f"the stated controller against the logged torque falls by {100 * explained:.4g} %."
    )
    samples = sum(logs[i].n_samples for _, i in places.tolist())
    value = {CLOCK[1]: Interval(rate, rate - doubt, rate + doubt)}
    return AlgebraicCause(CLOCK[0], None, value, samples, explained, says)


def _nearest(log: Log, missed: Callable[[Log], float]) -> float:
    """Return the drift on a grid that gives one log the smallest squared error."""
    (info,) = effect_info(CLOCK[0]).parameters
    count = int((info.upper - info.lower) * _duration(log) / _APART_S) | 1
    rates = np.linspace(info.lower, info.upper, count)
    return float(rates[np.argmin([missed(with_drift(log, float(rate))) for rate in rates])])


def _duration(log: Log) -> float:
    return log.n_samples * log.sample_time_s
