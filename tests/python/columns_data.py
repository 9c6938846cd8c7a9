"""Invented logs in the formats of makers, and matching robots with any number of axes."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from axisight import Robot

RATE_HZ = 250.0
GEAR = 0.02

JOINT = """[[joint]]
name = "{name}"
kind = "driven"
origin = [0.0, 0.0, 0.3]
axis = [0.0, 1.0, 0.0]
[joint.link]
mass = 2.0
com = [0.0, 0.0, 0.1]
inertia = [0.02, 0.02, 0.01, 0.0, 0.0, 0.0]
[joint.drive]
gear_ratio = {gear}
motor_inertia = 1e-5
viscous_friction = 0.0
"""


def robot_toml(n_axes: int, names: list[str] | None = None) -> str:
    names = names or [f"axis{k + 1}" for k in range(n_axes)]
    head = 'schema = "axisight.robot/2"\nname = "arm"\ngravity = [0.0, 0.0, -9.81]\n'
    joints = "".join(JOINT.format(name=name, gear=GEAR) for name in names)
    angles = ", ".join(["0.0"] * n_axes)
    tail = f"[operating_point]\njoint_angle = [{angles}]\n"
    return f"{head}sample_time = {1 / RATE_HZ}\n{joints}{tail}"


def robot(n_axes: int, names: list[str] | None = None) -> Robot:
    return Robot.from_toml(robot_toml(n_axes, names))


def motion(n_axes: int, n: int = 1500) -> dict[str, np.ndarray]:
    """Return joint-side position, velocity and torque (n, axes) in SI units, and the time (n,)."""
    t = np.arange(n) / RATE_HZ
    w = 2 * np.pi * (0.3 + 0.1 * np.arange(n_axes))
    phase = np.outer(t, w)
    acceleration = -np.sin(phase) * w**2
    return {
        "time": t,
        "position": np.sin(phase) + 0.1 * np.arange(n_axes),
        "velocity": np.cos(phase) * w,
        "torque": 5.0 * acceleration + 2.0 * np.sign(np.cos(phase)) + 1.0,
    }


DEG = 180 / np.pi
RPM = 30 / np.pi
# Maker -> (time, factor), then field -> (name with the axis number, first number, factor to the maker's
# unit).
MAKERS = {
    "ur-rtde": (
        ("timestamp", 1.0),
        {
            "position": ("actual_q_{}", 0, 1.0),
            "velocity": ("actual_qd_{}", 0, 1.0),
            "torque": ("actual_current_as_torque_{}", 0, 1.0),
        },
    ),
    "franka": (
        ("time", 1e3),
        {
            "position": ("state.q[{}]", 0, 1.0),
            "velocity": ("state.dq[{}]", 0, 1.0),
            "torque": ("state.tau_J[{}]", 0, 1.0),
        },
    ),
    "kuka-rsi": (
        ("IPOC", 1e3),
        {"position": ("AIPos.A{}", 1, DEG), "torque": ("GearTorque.A{}", 1, 1.0)},
    ),
    "abb": (
        ("time", 1.0),
        {
            "position": ("position_J{}", 1, DEG),
            "velocity": ("speed_J{}", 1, DEG),
            "torque": ("torque_J{}", 1, 1.0),
        },
    ),
    "ros-joint-state": (
        ("__time", 1.0),
        {
            "position": ("/joint_states/position[{}]", 0, 1.0),
            "velocity": ("/joint_states/velocity[{}]", 0, 1.0),
            "torque": ("/joint_states/effort[{}]", 0, 1.0),
        },
    ),
    "lerobot": (
        ("timestamp", 1.0),
        {
            "position": ("observation.state[{}]", 0, 1.0),
            "velocity": ("observation.velocity[{}]", 0, 1.0),
            "torque": ("observation.effort[{}]", 0, 1.0),
        },
    ),
    "lerobot-degrees": (
        ("timestamp", 1.0),
        {
            "position": ("observation.state[{}]", 0, DEG),
            "velocity": ("observation.velocity[{}]", 0, DEG),
            "torque": ("observation.effort[{}]", 0, 1.0),
        },
    ),
}


def maker_columns(maker: str, n_axes: int) -> dict[str, np.ndarray]:
    """Return the columns of a log under a maker's names, plus one that no map uses."""
    (time, factor), fields = MAKERS[maker]
    run = motion(n_axes)
    out = {time: run["time"] * factor, "some_flag": np.ones(run["time"].size)}
    for field, (name, first, scale) in fields.items():
        out |= {name.format(k + first): run[field][:, k] * scale for k in range(n_axes)}
    return out


def write_csv(path: Path, columns: dict[str, np.ndarray], separator: str = ",") -> Path:
    pd.DataFrame(columns).to_csv(path, index=False, sep=separator)
    return path


def write_lerobot(
    folder: Path,
    episodes: int = 1,
    n_axes: int = 6,
    *,
    version: int = 2,
    effort: bool = True,
    scale: float | np.ndarray = 1.0,
) -> Path:
    """Write a dataset in LeRobot's format; lists are float32.

    Positions are in rad times ``scale`` (one number, or one per axis); those of episode k are shifted by k.
    """
    run = motion(n_axes, 600)
    run["position"] = run["position"] * scale
    frames = []
    for k in range(episodes):
        frame = {
            "timestamp": run["time"].astype(np.float32),
            "frame_index": np.arange(600),
            "episode_index": np.full(600, k),
            "observation.state": list((run["position"] + k).astype(np.float32)),
            "action": list((run["position"] + k + 0.01).astype(np.float32)),
        }
        if effort:
            frame["observation.effort"] = list(run["torque"].astype(np.float32))
        frames.append(pa.Table.from_pandas(pd.DataFrame(frame)))
    (folder / "meta").mkdir(parents=True)
    data = folder / "data" / "chunk-000"
    data.mkdir(parents=True)
    feature = {"dtype": "float32", "shape": [n_axes], "names": None}
    info = {"codebase_version": f"v{version}.0", "fps": RATE_HZ, "total_episodes": episodes}
    info |= {"features": {"observation.state": feature, "action": feature}}
    (folder / "meta" / "info.json").write_text(json.dumps(info))
    if version == 2:
        for k, frame in enumerate(frames):
            pq.write_table(frame, data / f"episode_{k:06d}.parquet")
    else:
        half = max(1, episodes // 2)
        for k, part in enumerate([frames[:half], frames[half:]]):
            if part:
                pq.write_table(pa.concat_tables(part), data / f"file-{k:03d}.parquet")
    return folder
