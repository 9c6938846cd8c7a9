"""Names, units and nominal values of the parameters of a torque model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight import _core
from axisight.rigid_body.coupling import MotorCoupling
from axisight.rigid_body.friction import KINDS, DriveTerms
from axisight.robot import Robot

Array = NDArray[np.float64]
Extra = tuple[str, list[float], list[float], float, float]

# Quantity of each link parameter and its unit, in the order of the regressor.
LINK_QUANTITIES = (
    ("mass", "kg"),
    ("mass_x", "kg m"),
    ("mass_y", "kg m"),
    ("mass_z", "kg m"),
    ("inertia_xx", "kg m^2"),
    ("inertia_yy", "kg m^2"),
    ("inertia_zz", "kg m^2"),
    ("inertia_xy", "kg m^2"),
    ("inertia_xz", "kg m^2"),
    ("inertia_yz", "kg m^2"),
)

_UNITS = {
    "inertia": ("kg m^2", "kg"),
    "viscous": ("Nm s/rad", "N s/m"),
    "coulomb": ("Nm", "N"),
    "offset": ("Nm", "N"),
}


@dataclass(frozen=True)
class Column:
    """One parameter: name, unit, nominal value, and its extra column in the core, if any."""

    name: str
    unit: str
    nominal: float
    extra: Extra | None = None


def link_columns(robot: Robot) -> list[Column]:
    """Return the standard inertial parameters of every link that has mass.

    ``<joint>.mass``, ``mass_x`` .. ``mass_z`` (first moments) and ``inertia_xx`` ..
    ``inertia_yz`` about the origin of the link frame, in link axes.
    """
    links, values = _core.inertial_parameters(robot.core)
    # A floating base has the last of its six coordinates, which come first.
    floats = robot.floating_base is not None
    names = [*["base"] * (6 if floats else 0), *robot.joint_names]
    return [
        Column(f"{names[joint]}.{quantity}", unit, float(value))
        for joint, block in zip(links, values.reshape(-1, len(LINK_QUANTITIES)), strict=True)
        for (quantity, unit), value in zip(LINK_QUANTITIES, block, strict=True)
    ]


def drive_columns(
    robot: Robot, terms: DriveTerms, coupling: MotorCoupling, row_map: Array
) -> list[Column]:
    """Return the columns of rotors, friction and offsets, axis by axis, then springs.

    ``row_map`` (n_rows, n_coordinates) maps forces in all coordinates to the rows of the regression.
    """
    n = row_map.shape[1]
    joints = [n - robot.n_joints + joint for joint in robot.axis_joints]
    place = np.zeros((robot.n_axes, n))
    place[np.arange(robot.n_axes), joints] = 1.0
    # Maps from joint angles to motor angles, and from motor torques to rows.
    motor_motion = coupling.position @ place
    motor_rows = row_map @ place.T @ coupling.torque
    # In motor-side rows this is the identity, apart from rounding errors of the inverse.
    motor_rows[np.abs(motor_rows) <= 1e-13 * np.abs(motor_rows).max()] = 0.0
    nominal = robot.parameters()
    columns = []
    for axis, joint in enumerate(joints):
        prismatic = robot.axis_is_prismatic[axis]
        for kind, signal, motor_name, joint_name in KINDS:
            for side in terms.sides(kind):
                motor = side == "motor"
                name = f"{robot.axis_names[axis]}.{motor_name if motor else joint_name}"
                motion = motor_motion[axis] if motor else place[axis]
                rows = motor_rows[:, axis] if motor else row_map[:, joint]
                extra = (signal, motion.tolist(), rows.tolist(), *terms.settings(kind))
                unit = _UNITS[kind][prismatic and not motor]
                columns.append(Column(name, unit, nominal.get(name, 0.0), extra))
    return columns + (_springs(robot, nominal, row_map) if terms.springs else [])


def _springs(robot: Robot, nominal: dict[str, float], row_map: Array) -> list[Column]:
    columns = []
    n = row_map.shape[1]
    first = n - robot.n_joints
    for joint in sorted(set(range(robot.n_joints)) - set(robot.axis_joints)):
        motion = np.eye(n)[first + joint].tolist()
        # An elastic joint has no motor, so its row is zero: inertia + K q + D q' = 0.
        for quantity, unit, signal in (
            ("stiffness", "Nm/rad", "position"),
            ("damping", "Nm s/rad", "velocity"),
        ):
            name = f"{robot.joint_names[joint]}.{quantity}"
            extra = (signal, motion, row_map[:, first + joint].tolist(), 0.0, 0.0)
            columns.append(Column(name, unit, nominal[name], extra))
    return columns
