"""Joint trajectories: positions over time for position controllers, as CSV or as a ROS 2 message."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.interpolate import BPoly

from axisight.arguments import Real, instance, path_of, positive, reals
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.excitation.checks import numbers
from axisight.excitation.references import References
from axisight.robot import Robot
from axisight.storage import write_bytes

_KINDS = (".csv", ".yaml")
# Time in which a controller goes to the first point of a ROS message [s].
APPROACH_S = 5.0
# Largest error of a motion between the points of a ROS message, as a share of the joint's travel.
_BETWEEN = 1e-3
# Largest number of samples between two points of a ROS message.
_MOST_THINNED = 64


@summarized
@dataclass(frozen=True, eq=False)
class JointTrajectory:
    """Positions of joints over time: ``position``, ``velocity`` and ``acceleration`` are (n_samples, n_joints).

    Joint side, [rad], [rad/s] and [rad/s^2]; [m] and so on for prismatic joints. The first sample is at time 0.
    Raises InputError for other shapes and for fewer than two samples.
    """

    joint_names: tuple[str, ...]
    sample_time_s: float
    position: Real
    velocity: Real
    acceleration: Real

    def __post_init__(self) -> None:
        """Check the shapes."""
        positive("sample_time_s", self.sample_time_s)
        what = f"finite numbers of shape (n_samples, {len(self.joint_names)}), n_samples >= 2"
        shapes = [
            reals(name, getattr(self, name), what, 2).shape
            for name in ("position", "velocity", "acceleration")
        ]
        rows, columns = shapes[0]
        if len(set(shapes)) > 1 or columns != len(self.joint_names) or rows < 2:
            raise InputError(f"position, velocity, acceleration: expected {what}, got {shapes}")

    @property
    def time_s(self) -> Real:
        """Time of each sample (n_samples,) [s]."""
        return np.asarray(self.sample_time_s * np.arange(len(self.position)))

    def few_points(self) -> list[int]:
        """Return the fewest samples from which quintic polynomials follow the motion, to 0.1 % of its travel.

        Each polynomial has position, velocity and acceleration of both its ends. ROS trajectory controllers
        interpolate in this way.
        """
        travel = np.maximum(np.ptp(self.position, axis=0), 1e-12)
        n, time = len(self.position), self.time_s
        for step in range(min(_MOST_THINNED, n - 1), 1, -1):
            kept = [*range(0, n - 1, step), n - 1]
            state = np.stack([self.position, self.velocity, self.acceleration], axis=1)[kept]
            course = BPoly.from_derivatives(time[kept], state)(time)
            if np.all(np.abs(course - self.position).max(axis=0) <= _BETWEEN * travel):
                return kept
        return list(range(n))


def joint_trajectory(reference: References, robot: Robot, start: ArrayLike) -> JointTrajectory:
    """Return the joint positions of the first experiment of motor-side velocity references.

    A reference moves a motor by ``velocity * sample_time_s`` until the next sample. Joints follow their motors by
    the gear ratio; gears count as rigid.

    Parameters
    ----------
    reference : velocity references [rad/s] for the axes of ``robot``.
    robot : names of the joints and gear ratios.
    start : (n_axes,) positions of the motors at the first sample [rad].

    Raises InputError for references in another unit or of other axes, and for a start of another shape.

    """
    instance("reference", reference, References)
    instance("robot", robot, Robot)
    if reference.unit != "rad/s" or reference.n_inputs != robot.n_axes:
        raise InputError(
            f"reference: expected {robot.n_axes} velocities [rad/s], got {reference.n_inputs} "
            f"inputs [{reference.unit}]"
        )
    begin = numbers("start", start, robot.n_axes)
    step, speed = reference.sample_time_s, reference.period[0]
    motor = begin + step * np.concatenate([np.zeros((1, len(begin))), np.cumsum(speed, axis=0)])
    position = motor * robot.gear_ratio
    held = np.pad(position, ((1, 1), (0, 0)), mode="edge")
    return JointTrajectory(
        tuple(robot.axis_names),
        step,
        position,
        (held[2:] - held[:-2]) / (2 * step),
        np.diff(held, n=2, axis=0) / step**2,
    )


def write_joint_trajectory(trajectory: JointTrajectory, path: Path | str) -> Path:
    """Write a trajectory and return its path; the ending sets the format.

    - ``.csv``: columns ``time_s``, then ``position_NAME``, ``velocity_NAME``, ``acceleration_NAME`` of each joint,
      one row for each sample, in full precision.
    - ``.yaml``: a message of the ROS 2 type ``trajectory_msgs/msg/JointTrajectory``, with the points of
      `JointTrajectory.few_points`. The first point is due after 5 s, so that the controller can go there.

    Raises InputError for another ending, and OutputError for a file that cannot be written.
    """
    instance("trajectory", trajectory, JointTrajectory)
    target = path_of("path", path)
    if target.suffix not in _KINDS:
        raise InputError(f"{target}: expected a name ending in {' or '.join(_KINDS)}")
    text = _csv(trajectory) if target.suffix == ".csv" else _ros_message(trajectory)
    write_bytes(target, text.encode())
    return target


def _csv(trajectory: JointTrajectory) -> str:
    columns = {"time_s": trajectory.time_s}
    for quantity in ("position", "velocity", "acceleration"):
        values = getattr(trajectory, quantity)
        columns |= {
            f"{quantity}_{name}": values[:, i] for i, name in enumerate(trajectory.joint_names)
        }
    # pandas writes the shortest text that reads back as the same number.
    return str(pd.DataFrame(columns).to_csv(index=False))


def _ros_message(trajectory: JointTrajectory) -> str:
    """Return a message as YAML, each point on a line of its own."""
    names = json.dumps(list(trajectory.joint_names))
    lines = [
        "header: {stamp: {sec: 0, nanosec: 0}, frame_id: ''}",
        f"joint_names: {names}",
        "points:",
    ]
    lines += [f"- {_point(trajectory, k)}" for k in trajectory.few_points()]
    return "\n".join(lines) + "\n"


def _point(trajectory: JointTrajectory, k: int) -> str:
    due_ns = round(1e9 * (APPROACH_S + k * trajectory.sample_time_s))
    sec, nanosec = divmod(due_ns, 10**9)
    rows = {
        "positions": trajectory.position,
        "velocities": trajectory.velocity,
        "accelerations": trajectory.acceleration,
    }
    numbers_of = "".join(f"{name}: [{_fixed(values[k])}], " for name, values in rows.items())
    return f"{{{numbers_of}time_from_start: {{sec: {sec}, nanosec: {nanosec}}}}}"


def _fixed(values: Real) -> str:
    """Return numbers with eight decimals. YAML 1.1 takes 1e-08 for text."""
    return ", ".join(f"{x + 0.0:.8f}" for x in values)
