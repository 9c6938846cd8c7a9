"""The robot, the motion and the tasks that the runs have in common."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

import axisight
from common import numba_plant, robot_model
from common.loops import Task, controller
from common.tones import Tones

Array = np.ndarray
ROOT = Path(__file__).resolve().parents[3]
PRESET = "irb6600_like"


@dataclass
class Setting:
    """One robot in one motion, as our package and the peers see it."""

    robot: axisight.Robot
    text: str
    model: robot_model.Model
    tones: Tones
    reference: Array
    sampled: Task
    smooth: Task
    feed_forward: Array


def make(seconds: float, extras: robot_model.Extras | None = None, smooth: bool = True) -> Setting:
    """The 20-state robot in a run of ``seconds``, with the two forms of its loop.

    Without ``smooth`` the second form is not compiled, and is the first again.
    """
    text = (ROOT / "python/axisight/robot/presets" / f"{PRESET}.toml").read_text("utf-8")
    robot = axisight.load_robot(PRESET)
    model = robot_model.read(text)
    tones = Tones.make(np.array([d.ratio for d in model.drives]))
    count = round(seconds / model.sample_time) + 1
    reference = tones.velocity(np.arange(count) * model.sample_time)
    rest = robot.core.equilibrium([])
    start = robot_model.equilibrium_state(rest, extras)
    torque = rest["motor_torque"]
    held = numba_plant.held_torque(model, extras)
    looped = held
    if smooth:
        looped = numba_plant.smooth_loop(model, tones, rest["motor_angle"], torque, extras)
    command = controller(model, torque)
    n_positions = model.n_axes + model.n_joints

    def task(plant: numba_plant.Plant, size: Array) -> Task:
        jacobian = numba_plant.jacobian_of(plant, size)
        period = model.sample_time
        return Task(plant, jacobian, command, start, reference, period, size, n_positions)

    size = typical_size(robot, reference)
    if extras is not None and extras.lugre is not None:
        # Bristles settle near the static torque over their stiffness.
        deflection = extras.lugre.static_nm / extras.lugre.stiffness_nm_rad
        size = np.concatenate([size, np.full(model.n_axes, deflection)])
    return Setting(
        robot, text, model, tones, reference, task(held, size), task(looped, size), torque
    )


def typical_size(robot: axisight.Robot, reference: Array) -> Array:
    """Largest excursion of each state without effects: the scale of absolute tolerances."""
    out = axisight.simulate(robot, reference)
    positions = np.hstack([out["motor_position_rad"], out["joint_position_rad"]])
    travel = np.abs(positions - positions[0]).max(axis=0)
    speed = np.abs(np.diff(positions, axis=0)).max(axis=0) / robot.sample_time_s
    return np.concatenate([travel, speed])


def ours(setting: Setting, **options: object) -> tuple[Array, dict]:
    """Positions of our run, motors then joints, and its attributes."""
    out = axisight.simulate(setting.robot, setting.reference, **options)
    if out.attrs["status"] != "completed":
        raise RuntimeError(f"ours: {out.attrs['status']}")
    positions = np.hstack([out["motor_position_rad"], out["joint_position_rad"]])
    return positions, out.attrs
