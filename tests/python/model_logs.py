"""Logs of arms with model files: sines on all joints, torque by inverse dynamics."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from axisight import Robot
from axisight.robot_import import import_robot
from axisight.robot_import.drives import DriveData
from import_data import URDF, written

Array = NDArray[np.float64]
STEP_S = 0.01
# Added torque [Nm] as a function of angle and speed [rad, rad/s], (n, n_axes), motor side.
Added = Callable[[Array, Array], Array]


def sines(run: int, n_axes: int, n: int = 1500) -> tuple[Array, Array, Array]:
    """Return angle, speed and acceleration (n, n_axes); every run has another motion."""
    t = STEP_S * np.arange(n)[:, None]
    axis = np.arange(n_axes)
    waves = [(0.6, 1.1 + 0.2 * run, 0.3), (0.4, 2.3, 1.0 + run)]
    angle = sum(a * np.sin(w * t + p + axis) for a, w, p in waves)
    speed = sum(a * w * np.cos(w * t + p + axis) for a, w, p in waves)
    acceleration = sum(-a * w**2 * np.sin(w * t + p + axis) for a, w, p in waves)
    return angle, speed, acceleration


def written_log(folder: Path, run: int, machine: Robot, added: Added, noise: float = 0.02) -> Path:
    """Write the log of a rigid machine without gears, with ``noise`` [Nm] on its torque."""
    random = np.random.default_rng(run)
    q, v, a = sines(run, machine.n_axes)
    torque = machine.inverse_dynamics(q, v, a) + added(q, v)
    torque += noise * random.normal(size=q.shape)
    return written_table(
        folder / f"run{run}.parquet", q + 1e-6 * random.normal(size=q.shape), torque
    )


def written_table(path: Path, position: Array, torque: Array, step_s: float = STEP_S) -> Path:
    """Write positions and torques (n, n_axes) as a log."""
    columns = {"time_s": step_s * np.arange(len(position))}
    for i in range(position.shape[1]):
        columns |= {f"position_{i + 1}": position[:, i], f"torque_cmd_{i + 1}": torque[:, i]}
    pd.DataFrame(columns).to_parquet(path)
    return path


# A gripper beside the chain, and a tip beyond the flange.
FINGER = """<link name="finger"><inertial><mass value="0.3"/>
    <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial></link>
  <joint name="grip" type="prismatic"><parent link="upper"/><child link="finger"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.1" effort="10" velocity="1"/></joint>
</robot>"""


def branched(folder: Path) -> Path:
    """Write an arm with two moving branches, without friction and gears."""
    bare = URDF.replace('<dynamics damping="0.7" friction="1.5"/>', "")
    return written(folder, bare[: bare.index("  <transmission")] + FINGER)


def with_load(path: Path, mass_kg: float) -> Robot:
    """Return the arm with a load in the frame of its flange."""
    load = DriveData.model_validate({"payload": {"mass": mass_kg}})
    return import_robot(path, tip="flange", drives=load)
