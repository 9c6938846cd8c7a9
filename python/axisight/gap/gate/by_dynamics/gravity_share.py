"""Finds torques that were logged without gravity: drivers take it off before they report an effort."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.faults import Finding, GateSeverity
from axisight.gap.gate.by_dynamics.torque_fit import EXPLAINED, SAME, nuisance
from axisight.gap.gate.by_dynamics.undone_mistakes import predict
from axisight.gap.signals.motion import Motion
from axisight.robot import Robot

Array = NDArray[np.float64]

# Largest factor of the weight that counts as none. Masses are known to a few per cent; a counterbalance that
# carries more than this share of an axis' weight on every axis would be found as well.
_NONE = 0.15


def check_gravity_share(robot: Robot, motions: Sequence[Motion]) -> list[Finding]:
    """Return the finding about torques without gravity; empty where a weight shows on some axis.

    ``motions``: low-passed motion and torque of each log. The torque of each axis is regressed on the weight that
    acts on it, on the rest of the prediction, on friction and an offset. A perfect counterbalance gives the same on
    one axis. Of an arm, two axes must show no weight; the finding about a machine of one axis is a flag.
    """
    # Springs and counterbalances of the robot file are no weight.
    bare = robot.with_effects([])
    parts = [_parts(bare, at) for at in motions]
    factors = [both for axis in range(robot.n_axes) if (both := _factors(parts, axis)) is not None]
    if not factors or (len(factors) == 1 < robot.n_axes):
        return []
    if not all(abs(weight) < _NONE and SAME[0] < rest < SAME[1] for weight, rest in factors):
        return []
    severity: GateSeverity = "refuse" if robot.n_axes > 1 else "flag"
    seen = ", ".join(f"{100 * weight:.2g}" for weight, _ in factors)
    message = (
        f"expected torques that hold the arm against gravity, got {seen} % of the weight on the axes that carry "
        "one. Did the driver take gravity off? Then set gravity to zero in the robot file, or log the torque with "
        "gravity"
    )
    return [Finding("torque_without_gravity", severity, message, None, None, "torque_cmd")]


_Parts = tuple[Array, Array, Array, Array]


def _parts(robot: Robot, at: Motion) -> _Parts:
    """Return torque, weight, the rest of the prediction, and speed, (n, n_axes) each."""
    still = np.zeros_like(at[1])
    weight = predict(robot, (at[0], still, still, at[3]))
    return at[3], weight, predict(robot, at) - weight, at[1]


def _factors(parts: Sequence[_Parts], axis: int) -> tuple[float, float] | None:
    """Return the factors of weight and rest in the torque of an axis; None where the logs do not tell."""
    rows = []
    for torque, weight, rest, speed in parts:
        basis, _ = np.linalg.qr(nuisance(speed[:, axis]))
        columns = np.column_stack([torque[:, axis], weight[:, axis], rest[:, axis]])
        rows.append(columns - basis @ (basis.T @ columns))
    torque, weight, rest = np.concatenate(rows).T
    power = sum(float(part[0][:, axis].var()) * len(part[0]) for part in parts)
    columns = np.column_stack([weight, rest])
    factors = np.linalg.lstsq(columns, torque, rcond=None)[0]
    left = float(np.sum((torque - columns @ factors) ** 2))
    # A weight that scatters less than what is left does not show.
    tells = float(weight @ weight) > left > 0.0
    return (float(factors[0]), float(factors[1])) if tells and left < EXPLAINED * power else None
