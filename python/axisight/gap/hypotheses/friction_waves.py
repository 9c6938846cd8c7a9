"""Over which wave of the motor angle dry friction is larger in some places than in others."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.gap.hypotheses.ripple_orders import Complex, Turning, passed

Array = NDArray[np.float64]

# Of the speeds seen, above which dry friction is all there.
_SLIPPING = 0.003
# From wave to wave tried: over the longest travel none is a radian out of phase.
_FINER = 1.1
# How steeply what is faster is left out.
_FALLS = 4
# Share of the residual's square that a wave takes beside friction which is the same everywhere.
_WORTH = 0.01


def wave_of_friction(
    logs: Sequence[Turning],
    responses: Sequence[Complex],
    lowest: float,
    highest: float,
    *,
    below_hz: float,
) -> tuple[float, float, float] | None:
    """Return the order between two [1/motor turn] with which dry friction changes most, if it does.

    With the cosine and the sine of that friction [Nm]. Least squares of the residuals (n,) of all logs on the
    sign of speed, and on it times cosine and sine of ``order phi``, through the response
    (`axisight.gap.hypotheses.ripple_orders.strongest_orders`) of each log, all of them below ``below_hz``:
    there friction is the same before and behind an elastic gear. None where no order takes a
    hundredth beside the sign alone.

    Cost: two transforms an order and log.
    """
    count = 1 + int(np.ceil(np.log(highest / lowest) / np.log(_FINER)))
    orders = np.geomspace(lowest, highest, count)
    top = max(float(np.abs(log.speed_rad_s).max()) for log in logs) or 1.0
    size = 1 + 2 * count
    normal, along, power = np.zeros((size, size)), np.zeros(size), 0.0
    for log, response in zip(logs, responses, strict=True):
        falls = 1.0 + (log.frequency_hz / below_hz) ** _FALLS
        slow = np.asarray(1.0 / falls, np.complex128)
        sign = np.tanh(log.speed_rad_s / (_SLIPPING * top))
        turned = orders[:, None] * log.angle_rad
        waves = np.concatenate([np.ones((1, len(sign))), np.cos(turned), np.sin(turned)])
        shown = passed(waves * sign, response * slow)
        (residual,) = passed(log.residual[None], slow)
        normal += shown @ shown.T
        along += shown @ residual
        power += float(residual @ residual)
    even = along[0] ** 2 / max(normal[0, 0], 1e-300)
    found = []
    for i, order in enumerate(orders):
        pick = [0, 1 + i, 1 + count + i]
        solved = np.linalg.lstsq(normal[np.ix_(pick, pick)], along[pick], rcond=1e-8)[0]
        found.append((float(solved @ along[pick]) - even, float(order), solved[1:]))
    taken, order, wave = max(found, key=lambda one: one[0])
    # The response is that to a torque on the motor, which friction holds back.
    return (order, *(-wave).tolist()) if taken > _WORTH * power else None
