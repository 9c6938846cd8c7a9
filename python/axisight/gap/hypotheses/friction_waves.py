"""Estimates how dry friction varies with the motor angle."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.gap.hypotheses.ripple_orders import Complex, Turning, passed

Array = NDArray[np.float64]

# Share of the top speed above which dry friction has its full size.
_SLIPPING = 0.003
# Ratio of neighbouring orders. Over the longest travel, their phases differ by less than a radian.
_FINER = 1.1
# Exponent of the filter that leaves out frequencies above ``below_hz``.
_FALLS = 4
# Share of the squared residual that a wave must explain in addition to uniform friction.
_WORTH = 0.01


def wave_of_friction(
    logs: Sequence[Turning],
    responses: Sequence[Complex],
    lowest: float,
    highest: float,
    *,
    below_hz: float,
) -> tuple[float, float, float] | None:
    """Return the order [1/motor turn] at which dry friction varies most, with its cosine and sine amplitude [Nm].

    None if no order explains 1 % of the squared residual in addition to uniform friction. ``lowest`` and ``highest``
    bound the order.

    Method: least squares of the residuals (n,) of all logs on the sign of the speed, and on that sign times the cosine
    and the sine of ``order phi``. Each passes the response of its log (see
    `axisight.gap.hypotheses.ripple_orders.strongest_orders`) and a filter at ``below_hz``: below it, friction before
    and behind an elastic gear shows alike.

    Cost: two Fourier transforms for each order and log.
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
    # The response is that to a motor torque; friction has the opposite sign.
    return (order, *(-wave).tolist()) if taken > _WORTH * power else None
