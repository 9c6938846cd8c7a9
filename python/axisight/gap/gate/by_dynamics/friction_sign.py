"""Finds axes with a wrong sign from their friction, which must take energy.

On an axis with little load the torque is mostly friction. If the simulator has none, comparing torques shows no
sign. Energy does: the motor's work beyond that on the simulator's bodies must become heat. A dead current, or a load
that the simulator lacks, seems to drive as well; with the other sign it explains nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.gap.facts.faults import Finding
from axisight.gap.gate.by_dynamics.axis_travel import travels
from axisight.gap.gate.by_dynamics.torque_fit import EXPLAINED, nuisance
from axisight.gap.gate.by_dynamics.undone_mistakes import predict
from axisight.gap.signals.motion import Motion
from axisight.logs import Log
from axisight.robot import Robot

Array = NDArray[np.float64]

# Net work, as a share of all work in either direction, below which friction seems to drive. An unknown load that a
# log lowers also gives a negative share, as large as the share of gravity that the load adds; 30 % does not reach
# the limit.
_DRIVES = -0.5


def check_passive(robot: Robot, logs: Sequence[Log], motions: Sequence[Motion]) -> list[Finding]:
    """Return findings about axes whose friction seems to drive, over all logs and in each of them.

    ``motions``: low-passed motion and torque of each log. A spring to a wall, or a load, may do net work on an
    axis in one log; a wrong sign shows in all, and the other sign explains the torque.
    """
    bare = _without_friction(robot)
    bodies = [predict(bare, at) for at in motions]
    shares = [_net_work(*one) for one in zip(logs, motions, bodies, strict=True)]
    net, scale = (np.sum(x, axis=0) for x in zip(*shares, strict=True))
    in_all = np.all([work <= 0.0 for work, _ in shares], axis=0)
    share = net / np.maximum(scale, 1e-300)
    return [
        _finding(axis, share[axis])
        for axis in np.flatnonzero(in_all & (share < _DRIVES)).tolist()
        if _other_sign_explains(motions, bodies, axis)
    ]


def _other_sign_explains(motions: Sequence[Motion], bodies: Sequence[Array], axis: int) -> bool:
    """Whether the torque of an axis is explained with the other sign, and less so with its own.

    Both by the bodies, friction that brakes and an offset, fitted to one half of each log and judged on the other.
    """
    torque = [np.array_split(at[3][:, axis], 2) for at in motions]
    columns = [
        np.array_split(np.column_stack([own[:, axis], nuisance(at[1][:, axis])]), 2)
        for own, at in zip(bodies, motions, strict=True)
    ]
    halves = [
        (np.concatenate([y[k] for y in torque]), np.concatenate([x[k] for x in columns]))
        for k in range(2)
    ]
    own, other = (_left_held_out(halves, sign) for sign in (1.0, -1.0))
    return other < min(EXPLAINED, own)


def _left_held_out(halves: Sequence[tuple[Array, Array]], sign: float) -> float:
    """Return the share of a torque's variance that is left on either half by a fit to the other half."""
    left = power = 0.0
    for (y, x), (held_y, held_x) in zip(halves, halves[::-1], strict=True):
        # The factors of bodies and friction are not negative; that of the offset, the last column, may be.
        factors, _ = scipy.optimize.nnls(np.column_stack([x, -x[:, -1]]), sign * y)
        found = np.column_stack([held_x, -held_x[:, -1]]) @ factors
        left += float(((sign * held_y - found) ** 2).sum())
        power += float(((held_y - held_y.mean()) ** 2).sum())
    return left / max(power, 1e-300)


def _net_work(log: Log, at: Motion, bodies: Array) -> tuple[Array, Array]:
    """Return the net work on the friction of each axis, and all work in either direction, (n_axes,) [J].

    ``bodies`` (n, n_axes): the torque of the simulator without friction [Nm]. Both are zero on axes that stand.
    """
    scale = np.maximum(np.abs(at[3] * at[1]).sum(axis=0), np.abs(bodies * at[1]).sum(axis=0))
    net = ((at[3] - bodies) * at[1]).sum(axis=0)
    seconds = log.duration_s / len(at[1])
    moves = travels(log)
    return np.where(moves, net, 0.0) * seconds, np.where(moves, scale, 0.0) * seconds


def _finding(axis: int, share: float) -> Finding:
    message = (
        f"expected friction that brakes, got friction that drives the axis in all logs ({100 * share:.3g} % of the "
        "work done). Change the sign of its torque or of its position"
    )
    return Finding("sign_flipped", "refuse", message, None, axis + 1, f"torque_cmd_{axis + 1}")


def _without_friction(robot: Robot) -> Robot:
    names = [name for name in robot.parameters() if name.endswith(".viscous_friction")]
    return robot.with_effects([]).with_parameters(dict.fromkeys(names, 0.0))
