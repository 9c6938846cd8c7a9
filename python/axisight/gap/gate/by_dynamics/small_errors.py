"""Finds small errors of logs by the simulator's inverse dynamics: clocks apart, encoders off their zero.

All of them act to first order. A late torque changes by its rate times the delay. A late axis changes the
torques of other axes by its motion in that time. An encoder off its zero turns gravity. One regression
estimates all of them, beside a factor of the prediction, friction and an offset on each axis. A load that the
simulator lacks looks like an encoder off its zero; where it explains more, it is taken off first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.faults import Finding, GateSeverity
from axisight.gap.gate.by_dynamics.load_or_rotor import load_torques
from axisight.gap.gate.by_dynamics.torque_fit import ALIKE, PARTS, SIGNIFICANT, nuisance
from axisight.gap.gate.by_dynamics.undone_mistakes import predict
from axisight.gap.signals.motion import Motion
from axisight.robot import Robot

Array = NDArray[np.float64]

# Step of the differences in time [s], as large as the errors looked for.
_STEP_S = 0.02
# Step of the differences in angle [rad, joint side], as large as the errors looked for.
_STEP_RAD = 0.05
# Smallest delay that is a finding [s], above the skew of real recorders (a few ms).
_LEAST_S = 8e-3
# Smallest offset that is a finding [rad, joint side], above the play of zero marks.
_LEAST_RAD = 0.03
MOST_S = 0.2
"""Largest delay [s]; a larger one is not of first order, and has another cause."""
# Largest offset [rad, joint side]; a larger one is not of first order, and has another cause.
_MOST_RAD = 0.6
# Smallest share of the remaining error that one error must explain. Payloads and other laws of friction explain
# less, or not evenly.
_REMOVED = 0.05
# Logs and axes whose effect has less than this share of the largest energy are not compared.
_TELLS = 0.1


def check_small_errors(
    robot: Robot, motions: Sequence[tuple[float, Motion]], moves: NDArray[np.bool_]
) -> list[Finding]:
    """Return flags about the time of torques, and the time and zero of single axes.

    ``motions``: sample time [s] and low-passed motion of each log; all logs must show an error. ``moves`` (n_axes,):
    the axes that travel; the time of another does not show.
    """
    parts, loads = [], []
    names: list[tuple[str, int]] = []
    for sample_time_s, at in motions:
        base = predict(robot, at)
        names, effects = _effects(robot, sample_time_s, at, base)
        shown = [k for k, (kind, i) in enumerate(names) if kind != "axis_delayed" or moves[i]]
        names, effects = [names[k] for k in shown], [effects[k] for k in shown]
        target, found = _projected(at, base, [*effects, *load_torques(robot, at, base)])
        parts.append((target, found[: len(names)]))
        loads.append(found[len(names) :])
    targets = [target for target, _ in parts]
    shared = [kind == "time_shifted" for kind, _ in names]
    limits = [_MOST_RAD if kind == "position_offset" else MOST_S for kind, _ in names]
    first = _strongest(
        targets, [[part[i] for _, part in parts] for i in range(len(names))], limits, shared
    )
    if first is None:
        return []
    left, share = _without_load(targets, loads)
    targets = left if share > first.share else targets
    out = []
    # The error that explains most comes first; the others must explain the rest.
    for _ in range(len(names)):
        columns = [[part[i] for _, part in parts] for i in range(len(names))]
        best = _strongest(targets, columns, limits, shared)
        if best is None or best.share < _REMOVED or best.significance < SIGNIFICANT:
            break
        finding = _finding(names[best.index], best.size, best.share)
        if finding is None:
            break
        out.append(finding)
        taken = columns[best.index]
        targets = [t - best.size * c for t, c in zip(targets, taken, strict=True)]
    return out


def _without_load(targets: list[Array], loads: list[list[Array]]) -> tuple[list[Array], float]:
    """Return the targets without the load that fits all logs best, and the share that it explains."""
    columns = np.concatenate([np.stack([x.ravel() for x in own], axis=1) for own in loads])
    whole = np.concatenate([target.ravel() for target in targets])
    factors = np.linalg.lstsq(columns, whole, rcond=None)[0]
    left = [
        target - sum(f * x for f, x in zip(factors, own, strict=True))
        for target, own in zip(targets, loads, strict=True)
    ]
    power = max(float(whole @ whole), 1e-300)
    return left, 1.0 - sum(float((x**2).sum()) for x in left) / power


def _effects(
    robot: Robot, sample_time_s: float, at: Motion, base: Array
) -> tuple[list[tuple[str, int]], list[Array]]:
    """Return the change of the measured torque by each error, per unit, (n, n_axes) each."""
    position, speed, acceleration, torque = at
    n = robot.n_axes
    step = max(1, round(_STEP_S / sample_time_s))
    seconds = step * sample_time_s
    names: list[tuple[str, int]] = [("time_shifted", -1)]
    # A torque that is late by s equals the torque s earlier.
    effects = [-np.gradient(torque, sample_time_s, axis=0)]
    rate = np.gradient(base, sample_time_s, axis=0)
    for i in range(n):
        turn = np.zeros(n)
        turn[i] = _STEP_RAD * (1.0 / abs(float(robot.gear_ratio[i])))
        moved = [
            predict(robot, (position + s * turn, speed, acceleration, torque)) for s in (1.0, -1.0)
        ]
        # The encoder shows more than the angle: the machine's torque is that of a smaller angle.
        names.append(("position_offset", i))
        effects.append((moved[1] - moved[0]) / (2 * _STEP_RAD))
        late = [predict(robot, _shifted(at, i, s * step)) for s in (1, -1)]
        # The columns of the axis are late: the machine was further on. The other axes have the torque of the
        # later position. The axis' own torque is as late as its motion and friction.
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
    """Return torque and effects (n, n_axes) without factor, friction and offset, over each axis' torque scatter."""
    torque = at[3]
    target = np.empty_like(torque)
    columns = [np.empty_like(torque) for _ in effects]
    for i in range(torque.shape[1]):
        own = np.column_stack([base[:, i], nuisance(at[1][:, i])])
        basis, _ = np.linalg.qr(own)
        # A torque that never changes says nothing.
        scale = float(torque[:, i].std()) or np.inf
        target[:, i] = (torque[:, i] - basis @ (basis.T @ torque[:, i])) / scale
        for column, effect in zip(columns, effects, strict=True):
            column[:, i] = (effect[:, i] - basis @ (basis.T @ effect[:, i])) / scale
    return target, columns


@dataclass(frozen=True)
class _Strongest:
    """An error by its index, its size, the share of the remaining error that it explains, and its significance."""

    index: int
    size: float
    share: float
    significance: float


def _strongest(
    targets: list[Array], columns: list[list[Array]], limits: list[float], shared: list[bool]
) -> _Strongest | None:
    """Return the error that explains most of the targets, within its limit and alike in all logs; None without one.

    ``targets`` and each of ``columns`` contain one array for each log. ``shared``: whether an error is the same on all
    axes, which then have to agree.
    """
    power = sum(float((t**2).sum()) for t in targets)
    best = None
    for index, column in enumerate(columns):
        # The estimate's error is its scatter between ten parts of each log (sandwich estimate for one
        # parameter).
        cells = [
            [
                (float((c * t).sum()), float((c * c).sum()))
                for c, t in zip(_cut(own), _cut(target), strict=True)
            ]
            for own, target in zip(column, targets, strict=True)
        ]
        sums = np.array(cells).reshape(len(targets), -1, 2)
        product, energy = sums.sum(axis=(0, 1))
        if not energy > 0.0:
            continue
        size = product / energy
        if abs(size) > limits[index] or not _alike(sums.sum(axis=1), size):
            continue
        if shared[index] and not _alike(_by_axis(column, targets), size):
            continue
        scatter = np.sqrt(((sums[..., 0] - size * sums[..., 1]) ** 2).sum()) / energy
        share = size * product / max(power, 1e-300)
        if best is None or share > best.share:
            best = _Strongest(index, float(size), float(share), abs(size) / max(scatter, 1e-300))
    return best


def _cut(x: Array) -> list[Array]:
    return np.array_split(x, PARTS)


def _by_axis(column: list[Array], targets: list[Array]) -> Array:
    """Return product and energy of an error on each axis over all logs (n_axes, 2)."""
    product = sum((c * t).sum(axis=0) for c, t in zip(column, targets, strict=True))
    energy = sum((c * c).sum(axis=0) for c in column)
    return np.column_stack([product, energy])


def _alike(parts: Array, size: float) -> bool:
    """Whether all parts with a large enough effect give about the same size; rows: product and energy of each."""
    tells = parts[:, 1] > _TELLS * parts[:, 1].max()
    ratio = parts[tells, 0] / parts[tells, 1] / (size or 1.0)
    return bool(np.all((ratio > ALIKE[0]) & (ratio < ALIKE[1])))


def _finding(name: tuple[str, int], size: float, share: float) -> Finding | None:
    kind, axis = name
    severity: GateSeverity = "flag"
    if kind == "position_offset":
        if abs(size) < _LEAST_RAD:
            return None
        message = (
            f"expected positions from the robot's zero, got positions that seem {size:.3g} rad (joint side) off. "
            f"That offset explains {100 * share:.3g} % of the remaining error. Check the zero mark, or the load in "
            "the robot file"
        )
        return Finding(kind, severity, message, None, axis + 1, f"position_{axis + 1}")
    if abs(size) < _LEAST_S:
        return None
    who = "torques" if axis < 0 else f"the columns of axis {axis + 1}"
    message = (
        f"expected channels of one clock, got {who} that seem {1e3 * size:.3g} ms late against the others. That "
        f"delay explains {100 * share:.3g} % of the remaining error. Record on one clock"
    )
    field = "torque_cmd" if axis < 0 else f"position_{axis + 1}"
    return Finding(kind, severity, message, None, axis + 1 or None, field)
