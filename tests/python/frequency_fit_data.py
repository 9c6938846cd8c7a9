"""Synthetic responses of the preset robot with known parameters."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight import Robot, load_robot, robot_parameters
from axisight.frequency_fit import MeasuredResponse, model_response

Real = NDArray[np.float64]

ROBOT = load_robot("irb6600_like")
TRUTH = robot_parameters(ROBOT)
POSES = ((0.0, 0.3, -0.4), (0.4, -0.5, 0.6))
LINES_HZ = np.linspace(1.0, 40.0, 40)
ELASTIC = (
    "axis1.stiffness",
    "axis1.damping",
    "axis1.motor_inertia",
    "axis2.stiffness",
    "axis2.damping",
    "axis2.motor_inertia",
    "axis2_roll.stiffness",
    "axis2_yaw.stiffness",
    "axis3.stiffness",
    "axis3.damping",
    "axis3_roll.stiffness",
    "axis3_yaw.stiffness",
)


def true_values(names: Sequence[str]) -> Real:
    return np.array([TRUTH[name] for name in names])


def starts(names: Sequence[str], up: float = 1.5, down: float = 0.65) -> dict[str, float]:
    return {name: TRUTH[name] * (up if i % 2 else down) for i, name in enumerate(names)}


def response(
    pose: Sequence[float],
    relative_noise: float,
    rng: np.random.Generator,
    *,
    robot: Robot = ROBOT,
    lines_hz: Real = LINES_HZ,
) -> MeasuredResponse:
    """Return a response with circular complex noise; without noise it states a variance of 1 %."""
    g = model_response(robot, lines_hz, pose, quantity="acceleration").values
    std = (relative_noise or 0.1) * np.abs(g)
    error = rng.normal(size=(2, *g.shape)) * np.sqrt(0.5) * (relative_noise > 0)
    return MeasuredResponse(
        tuple(pose), lines_hz, g + std * (error[0] + 1j * error[1]), "acceleration", std**2
    )


def responses(relative_noise: float, seed: int | list[int]) -> list[MeasuredResponse]:
    rng = np.random.default_rng(seed)
    return [response(pose, relative_noise, rng) for pose in POSES]
