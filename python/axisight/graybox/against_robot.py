"""Comparison of an axis fit with a robot file, which shows wrong units and gear sides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.fitting import robot_parameters
from axisight.graybox.axis_findings import FAR, scale_words, total_inertia
from axisight.graybox.axis_result import AxisFit
from axisight.graybox.robot_values import converted, inertia_about, joint_of
from axisight.robot import Robot


@summarized
@dataclass(frozen=True)
class Comparison:
    """A comparison of a fit with the values of a robot file.

    ``ratios`` are fitted values over the robot's values, for the motor's inertia, the total inertia
    and the gear stiffness. ``one_factor`` is true if all differ by one common factor above 3.5 or
    below 1 / 3.5; wrong units or gear sides cause that, and no machine does. ``findings`` say it in
    words.
    """

    ratios: dict[str, float]
    one_factor: bool
    findings: tuple[str, ...]


def compare_with_robot(fit: AxisFit, robot: Robot, axis: int | str = 1) -> Comparison:
    """Return a comparison of an axis fit with the robot's values for that axis.

    fit
        A fit with any number of masses.
    robot
        A robot with a gear spring at the axis. The comparison uses its operating point.
    axis
        Number of the axis from 1, or the name of its joint.

    Degrees instead of radians, torque in mNm, or torque on the other side of the gear multiply
    inertias and stiffness by one common factor, and the fit does not get worse. Raises InputError for
    an axis that does not exist or has a rigid transmission.
    """
    if not isinstance(fit, AxisFit):
        raise InputError(f"fit: expected an AxisFit, got {type(fit).__name__}")
    joint, ratio = joint_of(robot, axis)
    values, _ = converted(fit, ratio)
    own = robot_parameters(robot)
    motor = own[f"{joint}.motor_inertia"]
    pairs = {
        "motor inertia": (values["J_m"], motor),
        "total inertia": (
            total_inertia({**values, "r": ratio}),
            motor + ratio**2 * inertia_about(robot, joint),
        ),
        "gear stiffness": (values["k1"], own[f"{joint}.stiffness"]),
    }
    ratios = {name: found / nominal for name, (found, nominal) in pairs.items() if nominal > 0}
    logs = np.log(np.maximum(list(ratios.values()), 1e-300))
    middle = float(np.median(logs))
    alike = bool(np.abs(logs - middle).max() < np.log(2.0))
    one_factor = alike and abs(middle) > np.log(FAR)
    if one_factor:
        factor = float(np.exp(middle))
        text = (
            f"inertias and stiffness are all about {factor:.3g} times those of the robot file: a "
            f"factor that units or sides of a gear have. {scale_words(1 / factor, ratio)}"
        )
        return Comparison(ratios, True, (text,))
    findings = tuple(
        f"the {name} is {r:.3g} times that of the robot file: look at units, at the side and the "
        "direction of the gear ratio, or at the file"
        for name, r in ratios.items()
        if not 1 / FAR < r < FAR
    )
    return Comparison(ratios, False, findings)
