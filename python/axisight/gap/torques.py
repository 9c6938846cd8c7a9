"""Measured and simulated torque side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect, without
from axisight.errors import InputError
from axisight.logs import Log
from axisight.robot import Robot
from axisight.simulation import simulate

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Variant:
    """A simulator: the robot's parameters, some replaced, and effects added to or replacing its own."""

    robot_values: Mapping[str, float]
    effects: tuple[Effect, ...] = ()


AS_GIVEN = Variant({})


def simulated_torque(robot: Robot, variant: Variant, log: Log) -> Array:
    """Return the commanded torque (n, n_axes) [Nm] of a simulator along a log's references.

    Where the simulation fails (an unstable model), the rest is NaN.
    """
    if log.velocity_ref_rad_s is None:
        raise InputError(f"log {log.name!r}: expected velocity references")
    changed = robot.with_parameters(variant.robot_values).with_effects(
        without(robot.effects, variant.effects)
    )
    out = simulate(changed, log.velocity_ref_rad_s, effects=variant.effects, method="rk4")
    torque = np.full(log.torque_nm.shape, np.nan)
    values = out["torque_cmd_nm"].values
    torque[: len(values)] = values
    return torque


def relative_squares(log: Log, error: Array) -> Array:
    """Return squared errors (n, n_axes) relative to the variance of the measured torque [1]."""
    variance = np.var(log.torque_nm, axis=0)
    return np.asarray(error**2 / np.maximum(variance, 1e-300))


def combine(per_log: Sequence[Array]) -> tuple[float, Array]:
    """Return the headline gap and the gap per axis from mean squares (n_axes,) of each log."""
    squares = np.array(per_log)
    return float(np.sqrt(squares.mean())), np.sqrt(squares.mean(axis=0))
