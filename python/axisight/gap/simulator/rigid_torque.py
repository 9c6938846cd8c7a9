"""The torque that a simulator with rigid gears predicts for a motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight import _core
from axisight.effects import core_effects
from axisight.fitting import FitOptions, Weighting
from axisight.fitting.divergence import must_hold
from axisight.gap.facts.simulator_variant import Variant
from axisight.gap.signals.motion import Motion
from axisight.gap.simulator.own_parameters import with_values
from axisight.robot import Robot

Array = NDArray[np.float64]


def predicted_torque(robot: Robot, variant: Variant, at: Motion) -> Array:
    """Return the torque (n, n_axes) [Nm] that a simulator predicts for a motion."""
    changed = with_values(robot, variant.robot_values)
    record = (*at, np.ones_like(at[3]))
    motions = _core.MeasuredMotions(changed.core, [record], Weighting.flat(robot.n_axes).core())
    result = motions.evaluate(core_effects(variant.effects), [], FitOptions())
    # The residual is prediction minus measurement, by axis.
    residual = must_hold(result).residual.reshape(robot.n_axes, -1).T
    return np.asarray(residual + at[3])
