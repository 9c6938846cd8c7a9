"""Checks whether positions follow their references, where the controller's law does not explain the torque.

The machine may have another controller than the robot file, or a torque that is not the command. Even so, a
controlled axis follows its reference: the low-passed derivative of its position equals the reference, in size
and sign.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.faults import Finding
from axisight.gap.signals.unit_scales import scale_name
from axisight.logs import Log, differentiate, lowpass
from axisight.logs.unit_guess import velocity_ratio
from axisight.robot import Robot

Array = NDArray[np.float64]

# Upper end of the compared band [Hz]: loops of arms follow up to some ten hertz.
_BAND_HZ = 20.0
# Correlation from which a position follows a reference or a target. An axis that is at its torque limit for most of a
# log has 0.94.
FOLLOWS = 0.9
# Range of the ratio of reference to speed, or of position to target, that is no finding.
SIZE = (0.5, 2.0)
# Mean square of speed minus reference, or of position minus target, relative to that of speed or position, below
# which the two are alike.
ALIKE = 0.15
# The same ratio above which the two are not alike.
UNLIKE = 0.5


def check_follows(robot: Robot, log: Log, axes: Sequence[int]) -> list[Finding]:
    """Return findings about positions that follow no reference, another one, or a multiple of it.

    ``axes`` (from 0): the axes to check.
    """
    reference = log.velocity_ref_rad_s
    if reference is None or not axes:
        return []
    left = _left(log, reference)
    out = []
    for i in axes:
        position = np.ascontiguousarray(log.position_rad[:, i])
        ratio, alike = velocity_ratio(
            position, np.ascontiguousarray(reference[:, i]), log.sample_time_s
        )
        other = int(np.argmin(left[i]))
        if left[i, i] > UNLIKE and left[i, other] < ALIKE and left[other, i] < ALIKE:
            out.append(_other(log, i, other))
        elif abs(alike) >= FOLLOWS and not SIZE[0] < ratio < SIZE[1]:
            out += _factor(robot, log, i, ratio)
    return out


def _left(log: Log, reference: Array) -> Array:
    """Return the mean square of the speed of axis i minus reference j, over that speed's (n_axes, n_axes)."""
    band = min(_BAND_HZ, 0.2 / log.sample_time_s)
    speed, _ = differentiate(log.position_rad, log.sample_time_s, band)
    given = lowpass(reference, log.sample_time_s, band)
    power = np.maximum((speed**2).mean(axis=0), 1e-300)
    gaps = ((speed[:, :, None] - given[:, None, :]) ** 2).mean(axis=0)
    return np.asarray(gaps / power[:, None])


def _other(log: Log, i: int, other: int) -> Finding:
    message = (
        f"expected a position that follows the reference of axis {i + 1}, got one that follows that of axis "
        f"{other + 1}, and the other way round. Exchange the columns of positions or of references"
    )
    return Finding("axes_swapped", "refuse", message, log.name, i + 1, f"position_{i + 1}")


def _factor(robot: Robot, log: Log, i: int, ratio: float) -> list[Finding]:
    column = f"position_{i + 1}"
    if -SIZE[1] < ratio < -SIZE[0]:
        message = (
            f"expected a position that follows its reference, got one that moves against it (factor {ratio:.4g}). "
            "Change the sign of the position or of the reference"
        )
        return [Finding("sign_flipped", "refuse", message, log.name, i + 1, column)]
    gear = float(robot.gear_ratio[i])
    name = scale_name("velocity_ref", ratio, gear)
    position = scale_name("position", 1.0 / ratio, gear)
    if name.endswith("_scaled") and not position.endswith("_scaled"):
        name = position
    message = (
        f"expected a reference equal to the derivative of the position, got one {ratio:.4g} times as large. State "
        "units and gear in a column map"
    )
    return [Finding(name, "refuse", message, log.name, i + 1, column)]
