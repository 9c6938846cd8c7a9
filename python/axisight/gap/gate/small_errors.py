"""Small errors of a log by the simulator's inverse dynamics: clocks apart, encoders off their zero.

All of them act in first order: a late torque is its rate times the delay, an axis that is late changes
the torques of the others by what its motion does in that time, an encoder off its zero turns gravity.
One regression has them all, beside a factor of the prediction, friction and an offset on every axis.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.gap.cutoff import Motion
from axisight.gap.faults import GateSeverity, InputFinding
from axisight.gap.gate.mistakes import predict
from axisight.gap.gate.torque_fit import nuisance
from axisight.logs import Log
from axisight.robot import Robot

Array = NDArray[np.float64]

# Steps of the differences that give the first-order effects: of the size that is looked for.
_STEP_S = 0.02
_STEP_RAD = 0.05
# What is worth a word: above the skew of real recorders (a few ms) and the play of zero marks.
_LEAST_S = 8e-3
_LEAST_RAD = 0.03
# By itself it has to take so much of what is left, and stand out of its scatter between tenths of
# the log: payloads and friction of another shape take less, or not evenly.
_REMOVED = 0.05
_SIGNIFICANT = 6.0
_PARTS = 10


def check_small_errors(robot: Robot, log: Log, at: Motion) -> list[InputFinding]:
    """Return flags about the time of torques, the time of single axes and their zero."""
    base = predict(robot, at)
    names, effects = _effects(robot, log, at, base)
    target, columns = _projected(at, base, effects)
    out = []
    left = float((target**2).sum())
    # The one that takes most first; the others on what it leaves.
    for _ in range(len(names)):
        best = _strongest(target, columns)
        if best is None:
            break
        index, size, significance = best
        taken = float((target**2).sum()) - float(((target - size * columns[index]) ** 2).sum())
        if taken < _REMOVED * left or significance < _SIGNIFICANT:
            break
        finding = _finding(robot, log, names[index], size, taken / left)
        if finding is None:
            break
        out.append(finding)
        target = target - size * columns[index]
        left = float((target**2).sum())
    return out


def _effects(
    robot: Robot, log: Log, at: Motion, base: Array
) -> tuple[list[tuple[str, int]], list[Array]]:
    """Return what each error adds to the measured torque, per unit, (n, n_axes) each."""
    position, speed, acceleration, torque = at
    n = robot.n_axes
    step = max(1, round(_STEP_S / log.sample_time_s))
    seconds = step * log.sample_time_s
    names: list[tuple[str, int]] = [("time_shifted", -1)]
    # Torque read late by s is the torque of s earlier.
    effects = [-np.gradient(torque, log.sample_time_s, axis=0)]
    rate = np.gradient(base, log.sample_time_s, axis=0)
    for i in range(n):
        turn = np.zeros(n)
        turn[i] = _STEP_RAD * (1.0 / abs(float(robot.gear_ratio[i])))
        moved = [
            predict(robot, (position + s * turn, speed, acceleration, torque)) for s in (1.0, -1.0)
        ]
        # The encoder shows more than there is: the machine's torque is that of less.
        names.append(("position_offset", i))
        effects.append((moved[1] - moved[0]) / (2 * _STEP_RAD))
        late = [predict(robot, _shifted(at, i, s * step)) for s in (1, -1)]
        # Its columns are late: the machine was further on. Its own torque is late too, and so are
        # motion and friction it goes with; only the other axes were further on then.
        effect = (late[0] - late[1]) / (2 * seconds)
        effect[:, i] -= rate[:, i]
        names.append(("axis_delayed", i))
        effects.append(effect)
    return names, effects


def _shifted(at: Motion, axis: int, samples: int) -> Motion:
    """Return the motion with one axis read ``samples`` later, held at the ends."""
    index = np.clip(np.arange(len(at[0])) + samples, 0, len(at[0]) - 1)
    parts = []
    for x in at[:3]:
        moved = x.copy()
        moved[:, axis] = x[index, axis]
        parts.append(moved)
    return parts[0], parts[1], parts[2], at[3]


def _projected(at: Motion, base: Array, effects: list[Array]) -> tuple[Array, list[Array]]:
    """Return torque and effects (n, n_axes) without factor, friction and offset, axes weighted alike."""
    torque = at[3]
    target = np.empty_like(torque)
    columns = [np.empty_like(torque) for _ in effects]
    for i in range(torque.shape[1]):
        own = np.column_stack([base[:, i], nuisance(at[1][:, i])])
        basis, _ = np.linalg.qr(own)
        scale = max(float(torque[:, i].std()), 1e-300)
        target[:, i] = (torque[:, i] - basis @ (basis.T @ torque[:, i])) / scale
        for column, effect in zip(columns, effects, strict=True):
            column[:, i] = (effect[:, i] - basis @ (basis.T @ effect[:, i])) / scale
    return target, columns


def _strongest(target: Array, columns: list[Array]) -> tuple[int, float, float] | None:
    """Return index, size and significance of the effect that takes most of the target by itself."""
    best: tuple[float, int, float] | None = None
    for index, column in enumerate(columns):
        energy = float((column**2).sum())
        if not energy > 0.0:
            continue
        size = float((column * target).sum()) / energy
        if best is None or size**2 * energy > best[0]:
            best = size**2 * energy, index, size
    if best is None:
        return None
    _, index, size = best
    parts = zip(np.array_split(columns[index], _PARTS), np.array_split(target, _PARTS), strict=True)
    sums = np.array([[(c * t).sum(), (c * c).sum()] for c, t in parts])
    # Scatter of the estimate over parts of the log (the sandwich of one number).
    scatter = float(np.sqrt(((sums[:, 0] - size * sums[:, 1]) ** 2).sum()) / sums[:, 1].sum())
    return index, size, abs(size) / max(scatter, 1e-300)


def _finding(
    robot: Robot, log: Log, name: tuple[str, int], size: float, share: float
) -> InputFinding | None:
    kind, axis = name
    severity: GateSeverity = "flag"
    if kind == "position_offset":
        if abs(size) < _LEAST_RAD:
            return None
        message = (
            f"expected positions from the robot's zero, got ones that look {size:.3g} rad (joint side) "
            f"off: it explains {100 * share:.3g} % of what is left; check the zero mark, or the load "
            "of the robot file"
        )
        return InputFinding(kind, severity, message, log.name, axis + 1, f"position_{axis + 1}")
    if abs(size) < _LEAST_S:
        return None
    who = "torques" if axis < 0 else f"the columns of axis {axis + 1}"
    message = (
        f"expected channels of one clock, got {who} that look {1e3 * size:.3g} ms late against the "
        f"other channels: it explains {100 * share:.3g} % of what is left; record on one clock"
    )
    field = "torque_cmd" if axis < 0 else f"position_{axis + 1}"
    return InputFinding(kind, severity, message, log.name, axis + 1 or None, field)
