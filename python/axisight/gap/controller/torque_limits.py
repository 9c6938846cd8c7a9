"""Torque limits that logs show without a fit: flat tops where the controller asks for more.

Many drives report the torque after their own limit. A simulator that is kept on the log then has no error
there; one that is driven by the references has. The command before the limit follows from references and
measured positions, whatever the machine does. The drive has a limit if this command exceeds the flat tops of
the logged torque and equals the torque elsewhere.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect
from axisight.effects.stated import TORQUE_LIMIT
from axisight.gap.controller.feedback import as_taken, before, feedback
from axisight.gap.facts.algebraic_cause import AlgebraicCause
from axisight.gap.facts.result import Interval
from axisight.logs import Log
from axisight.logs.frozen import runs
from axisight.robot import Robot

Array = NDArray[np.float64]

# Number of equal samples in a row that make a flat top.
_IN_A_ROW = 3
# Smallest number of samples in all flat tops of an axis.
_IN_ALL = 20
# Relative width of one level. All flat tops of an axis must share one limit.
_SAME_LEVEL = 1e-3
# Share of the flat-top samples where the command must exceed the limit.
_BEYOND = 0.95
# Share of the torque's variance elsewhere that the command must explain. If it explains less, the machine has
# another controller.
_LAW_HOLDS = 0.99


def torque_limits(robot: Robot, logs: Sequence[Log]) -> tuple[AlgebraicCause, ...]:
    """Return the torque limits that logs with speed references show, by axis."""
    commands = [_command(robot, log) for log in logs]
    found = (_limit(i, logs, commands) for i in range(robot.n_axes))
    return tuple(x for x in found if x is not None)


def missing(limits: Sequence[AlgebraicCause], robot: Robot) -> tuple[AlgebraicCause, ...]:
    """Return the limits among ``limits`` that the simulator does not have at this level."""
    own = {e.axis: e.values()[0] for e in robot.effects if e.name == TORQUE_LIMIT[0]}

    def differs(found: AlgebraicCause) -> bool:
        level = found.values[TORQUE_LIMIT[1]].value
        return bool(abs(own.get(found.axis, np.inf) / level - 1) > _SAME_LEVEL)

    return tuple(x for x in limits if differs(x))


def reported(torque: Array, limits: Sequence[AlgebraicCause], effects: Iterable[Effect]) -> Array:
    """Return commanded torques (n, n_axes) [Nm] as the machine's drives would report them.

    Drives with one of ``limits`` report the torque after the limit. On these axes the torque is cut at the
    limit that the simulator has among ``effects``.
    """
    out = torque.copy()
    after = {x.axis for x in limits}
    for effect in effects:
        if effect.name == TORQUE_LIMIT[0] and effect.axis is not None and effect.axis in after:
            limit, i = effect.values()[0], effect.axis - 1
            out[:, i] = np.clip(out[:, i], -limit, limit)
    return out


def _command(robot: Robot, log: Log) -> Array:
    """Return the command before any limit (n, n_axes) [Nm], up to a constant on each axis."""
    reference, time = log.velocity_ref_rad_s, log.sample_time_s
    assert reference is not None  # closed loop only
    position, speed = as_taken(log)
    return feedback(robot, reference - speed, before(reference) * time - position)


def _limit(axis: int, logs: Sequence[Log], commands: Sequence[Array]) -> AlgebraicCause | None:
    torques = [log.torque_nm[:, axis] for log in logs]
    highest = max(float(np.abs(u).max()) for u in torques)
    tops = [_flat(np.abs(u), highest) for u in torques]
    at_top = np.concatenate(tops)
    if at_top.sum() < _IN_ALL or at_top.all():
        return None
    measured = np.concatenate(torques)
    # The command is known up to a constant on each log, the controller's initial state.
    asked = np.concatenate(
        [
            c[:, axis] + np.median((u - c[:, axis])[~top]) if not top.all() else u
            for u, c, top in zip(torques, commands, tops, strict=True)
        ]
    )
    off = measured - asked
    power = float(np.var(measured[~at_top]))
    if not power > 0 or float(np.mean(off[~at_top] ** 2)) > (1 - _LAW_HOLDS) * power:
        return None
    beyond = -np.sign(measured) * off
    scatter = 3.0 * float(np.std(off[~at_top]))
    if float(np.mean(beyond[at_top] > -scatter)) < _BEYOND or np.median(beyond[at_top]) < scatter:
        return None
    cut = np.clip(asked, -highest, highest)
    explained = 1.0 - float(np.sum((measured - cut) ** 2) / np.sum(off**2))
    levels = np.abs(measured[at_top])
    low, middle, high = np.quantile(levels, [0.025, 0.5, 0.975])
    interval = Interval(float(middle), float(low), float(high))
    says = (
        f"Axis {axis + 1}: {100 * at_top.mean():.3g} % of the logged torque stands at {interval.value:.4g} Nm, where "
        f"the controller's law asks for more. With a limit there the law explains {100 * explained:.4g} % of its "
        "error."
    )
    name, parameter = TORQUE_LIMIT
    samples = int(at_top.sum())
    return AlgebraicCause(name, axis + 1, {parameter: interval}, samples, explained, says)


def _flat(size: Array, level: float) -> NDArray[np.bool_]:
    """Mark the samples (n,) of flat tops at a level."""
    flat = np.zeros(len(size), dtype=bool)
    for a, b in runs(size >= (1 - _SAME_LEVEL) * level):
        if b - a >= _IN_A_ROW:
            flat[a:b] = True
    return flat
