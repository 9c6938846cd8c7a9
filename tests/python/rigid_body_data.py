"""Random chains in the robot format and motions for them."""

from __future__ import annotations

import tomllib
from typing import Any

import numpy as np
import tomli_w
from numpy.typing import NDArray

from axisight import _core
from axisight.robot import Robot

Array = NDArray[np.float64]


def robot_of(text: str) -> Robot:
    return Robot(_core.Robot.from_toml(text))


def random_inertia(rng: np.random.Generator, size: float) -> list[float]:
    """Return the inertia of a cloud of points, which is always possible."""
    points = rng.normal(0, size, (12, 3))
    points -= points.mean(axis=0)
    second = points.T @ points
    inertia = np.trace(second) * np.eye(3) - second
    xx, yy, zz = np.diag(inertia)
    return [float(v) for v in (xx, yy, zz, inertia[0, 1], inertia[0, 2], inertia[1, 2])]


def random_chain(seed: int, n_joints: int = 6, elastic: bool = True) -> str:
    """Return revolute and prismatic, driven and elastic joints on any axes, some without link mass."""
    rng = np.random.default_rng(seed)
    joints: list[dict[str, Any]] = []
    for i in range(n_joints):
        last = i == n_joints - 1
        kind = "elastic" if elastic and i > 0 and rng.random() < 0.3 else "driven"
        axis = rng.normal(size=3)
        if rng.random() < 0.5:
            axis = np.eye(3)[rng.integers(3)] * rng.choice([-1.0, 1.0])
        joint: dict[str, Any] = {
            "name": f"axis{i + 1}",
            "kind": kind,
            "motion": "prismatic" if rng.random() < 0.25 else "revolute",
            "origin": rng.normal(0, 0.4, 3).tolist() if rng.random() < 0.8 else [0.0, 0.0, 0.0],
            "axis": (axis / np.linalg.norm(axis)).tolist(),
        }
        if last or kind == "driven" or rng.random() < 0.6:
            joint["link"] = {
                "mass": float(rng.uniform(1, 50)),
                "com": rng.normal(0, 0.2, 3).tolist(),
                "inertia": random_inertia(rng, 0.3),
            }
        if kind == "elastic":
            joint |= {"stiffness": 1e4, "damping": 10.0}
        else:
            ratio = float(rng.choice([-1, 1]) / rng.uniform(30, 200))
            joint["drive"] = {
                "gear_ratio": ratio,
                "motor_inertia": 1e-3,
                "viscous_friction": 1e-2,
            }
        joints.append(joint)
    return description(joints, rng.normal(0, 6, 3).tolist())


def description(joints: list[dict[str, Any]], gravity: list[float]) -> str:
    """Return the text of a robot with these joints."""
    driven = sum(joint["kind"] == "driven" for joint in joints)
    return tomli_w.dumps(
        {
            "schema": "axisight.robot/1",
            "name": "chain",
            "gravity": gravity,
            "sample_time": 1e-3,
            "joint": joints,
            "controller": {"kind": "none"},
            "sensor": {"position_noise_std": 0.0},
            "operating_point": {"joint_angle": [0.0] * driven},
        }
    )


def wrist_arm() -> str:
    """Return six axes in the usual arrangement: waist, shoulder, elbow, three wrist axes."""
    rng = np.random.default_rng(7)
    places = [
        ([0.0, 0.0, 0.4], [0.0, 0.0, 1.0], 250.0, 1 / 120),
        ([0.32, 0.0, 0.38], [0.0, 1.0, 0.0], 150.0, 1 / 110),
        ([0.0, 0.0, 1.075], [0.0, 1.0, 0.0], 110.0, 1 / 100),
        ([0.35, 0.0, 0.2], [1.0, 0.0, 0.0], 60.0, 1 / 80),
        ([0.8, 0.0, 0.0], [0.0, 1.0, 0.0], 25.0, -1 / 75),
        ([0.2, 0.0, 0.0], [1.0, 0.0, 0.0], 10.0, 1 / 60),
    ]
    joints = [
        {
            "name": f"axis{i + 1}",
            "kind": "driven",
            "origin": origin,
            "axis": axis,
            "link": {
                "mass": mass,
                "com": rng.normal(0, 0.15, 3).tolist(),
                "inertia": random_inertia(rng, 0.05 * np.sqrt(mass)),
            },
            "drive": {
                "gear_ratio": ratio,
                "motor_inertia": 4e-3 * np.sqrt(mass / 250),
                "viscous_friction": 5e-3,
            },
        }
        for i, (origin, axis, mass, ratio) in enumerate(places)
    ]
    return description(joints, [0.0, 0.0, -9.81])


def motion(robot: Robot, n: int, seed: int = 0) -> tuple[Array, Array, Array]:
    """Return independent random positions, velocities and accelerations."""
    rng = np.random.default_rng(seed)
    shape = (n, robot.n_joints)
    return rng.uniform(-np.pi, np.pi, shape), rng.normal(0, 2, shape), rng.normal(0, 5, shape)


def parse(text: str) -> dict[str, Any]:
    return tomllib.loads(text)


def smooth_motion(robot: Robot, n: int, step_s: float, seed: int = 0) -> tuple[Array, Array, Array]:
    """Return sums of five sines per joint, with exact derivatives."""
    rng = np.random.default_rng(seed)
    t = step_s * np.arange(n)[:, None, None]
    shape = (robot.n_joints, 5)
    w = 2 * np.pi * rng.uniform(0.1, 0.8, shape)
    amplitude, phase = rng.uniform(0.2, 0.6, shape), rng.uniform(0, 2 * np.pi, shape)
    angle = w * t + phase
    q = (amplitude * np.sin(angle)).sum(axis=2)
    v = (amplitude * w * np.cos(angle)).sum(axis=2)
    a = -(amplitude * w**2 * np.sin(angle)).sum(axis=2)
    return q, v, a


def three_axes() -> str:
    """Return the first three axes of the arm."""
    data = parse(wrist_arm())
    return description(data["joint"][:3], data["gravity"])


def drive_values(names: list[str], nominal: Array) -> Array:
    """Return nominal parameters plus friction and offsets that a robot file does not hold."""
    values = nominal.copy()
    for i, name in enumerate(names):
        if name.endswith("coulomb_friction"):
            values[i] = 0.4
        elif name.endswith("torque_offset"):
            values[i] = -0.07
    return values
