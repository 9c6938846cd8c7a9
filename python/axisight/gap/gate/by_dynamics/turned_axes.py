"""Finds an axis that turns the other way in the simulator than in the machine.

Position, torque and references of its motor all change sign, so neither a controller's law nor friction shows
it. Gravity and the coupling of the axes do.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from axisight.gap.facts.faults import Finding
from axisight.gap.gate.by_dynamics.inverse_checks import thinned
from axisight.gap.gate.by_dynamics.torque_fit import EXPLAINED, TorqueFit, torque_fit
from axisight.gap.gate.by_dynamics.undone_mistakes import predict, undone, with_gravity
from axisight.gap.signals.motion import Motion
from axisight.logs import Log
from axisight.robot import Robot

# Largest unexplained share with the turned axis, relative to that without, summed over the axes. An effect that
# the simulator lacks does not vanish with a turned axis.
_LEFT = 0.25
# Smallest decrease of that sum.
_LEAST_REMOVED = 0.02
# Largest increase of the summed unexplained share in any log; logs that hardly couple the axes show nothing.
_NO_WORSE = 0.005


def check_turned_axes(robot: Robot, logs: Sequence[Log]) -> list[Finding]:
    """Return the finding about the axis that, turned round, explains the logs; empty without one.

    At least one log must show it, and none may be explained worse.
    """
    motions = [thinned(log)[1] for log in logs]
    given = [torque_fit(at[3], predict(robot, at), at) for at in motions]
    if sum(g.total for g in given) < _LEAST_REMOVED:
        return []
    turned = [[_turned(robot, at, axis) for at in motions] for axis in range(robot.n_axes)]
    axis = min(range(robot.n_axes), key=lambda i: sum(fit.total for fit in turned[i]))
    pairs = list(zip(given, turned[axis], strict=True))
    worse = any(fit.total > g.total + _NO_WORSE for g, fit in pairs)
    told = [(log, g, fit) for log, (g, fit) in zip(logs, pairs, strict=True) if _explains(g, fit)]
    if worse or not told or _another_explains(robot, motions, sum(fit.total for _, fit in pairs)):
        return []
    return [_named(axis, *told[0])]


def _another_explains(robot: Robot, motions: Sequence[Motion], left: float) -> bool:
    """Whether another single mistake in all logs, or torque without gravity, leaves less than the turned axis."""
    if sum(with_gravity(robot, at, 0.0).total for at in motions) < left:
        return True
    return any(
        sum(mistake.fit.total for mistake in in_all) < left
        for in_all in zip(*(undone(robot, at) for at in motions), strict=True)
    )


def _turned(robot: Robot, at: Motion, axis: int) -> TorqueFit:
    sign = np.ones(robot.n_axes)
    sign[axis] = -1.0
    position, speed, acceleration, torque = (x * sign for x in at)
    turned = position, speed, acceleration, torque
    return torque_fit(torque, predict(robot, turned), turned)


def _explains(given: TorqueFit, turned: TorqueFit) -> bool:
    enough = given.total - turned.total > _LEAST_REMOVED and turned.total < _LEFT * given.total
    return enough and float(turned.left.max()) < EXPLAINED


def _named(axis: int, log: Log, given: TorqueFit, turned: TorqueFit) -> Finding:
    message = (
        f"expected motions that explain the torques, got motions that leave {100 * given.left.mean():.3g} % of "
        f"their variance ({log.name}), and {100 * turned.left.mean():.3g} % with axis {axis + 1} turned the other "
        f"way. Multiply gear_ratio of axis {axis + 1} by -1, or turn its axis in the robot file"
    )
    return Finding("axis_turned", "refuse", message, None, axis + 1, "gear_ratio")
