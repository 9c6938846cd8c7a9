"""Rotors of typical machines, for model files that leave them out: by class of robot and effort limit.

Only rotors: a ratio that is nearly right is wrong, and friction differs by its oil and age; neither is a parameter
that a diagnosis could mend within a tolerance.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from axisight.robot_import.chain import ChainJoint
from axisight.robot_import.drives import DriveData, JointDrive, RobotClass

# Effort limit [Nm] and inertia of the rotor as reflected to the joint [kg m^2] of known joints; sources in
# docs/models.md.
_KNOWN: dict[RobotClass, tuple[tuple[float, float], ...]] = {
    "cobot": ((87.0, 0.606), (87.0, 0.606), (87.0, 0.462), (87.0, 0.462), *3 * ((12.0, 0.206),)),
    "industrial": (
        (97.6, 200e-6 * 62.6111**2),
        (186.4, 200e-6 * 107.815**2),
        (89.4, 200e-6 * 53.7063**2),
        (24.2, 33e-6 * 76.0364**2),
        (20.1, 33e-6 * 71.923**2),
        (21.3, 33e-6 * 76.686**2),
    ),
    "desktop": ((10.0, 0.0266), (7.3, 0.0120), (0.52, 0.00199)),
}
# A size beyond the known ones by more than this is no joint of such a robot, or no limit at all.
_BEYOND = 4.0
TOLERANCE = 0.6
"""Relative standard deviation of a rotor by class: servos of one size differ by a factor of two and more."""


def effort_range_nm(kind: RobotClass) -> tuple[float, float]:
    """Return the effort limits [Nm] of joints for which a class says a rotor."""
    efforts = [effort for effort, _ in _KNOWN[kind]]
    return min(efforts) / _BEYOND, max(efforts) * _BEYOND


def rotor_inertia(kind: RobotClass, effort_nm: float) -> float:
    """Return the reflected inertia [kg m^2] of a typical rotor: through those known, a power of the effort limit."""
    effort, inertia = np.log(np.array(_KNOWN[kind])).T
    slope, level = np.polyfit(effort, inertia, 1)
    return float(np.exp(level + slope * np.log(effort_nm)))


def with_rotors(joints: Sequence[ChainJoint], drives: DriveData) -> tuple[DriveData, list[str]]:
    """Return drive data with the rotors that neither they nor the file have, by class, and what to say of it."""
    kind = drives.robot_class
    if kind is None:
        return drives, []
    low, high = effort_range_nm(kind)
    found: dict[str, float] = {}
    notes = []
    for joint in joints:
        name, said = joint.body.joint, joint.body.drive
        own = drives.joint.get(name, JointDrive())
        if own.motor_inertia is not None or said.rotor_inertia > 0:
            continue
        if joint.body.motion == "prismatic" or not low <= said.effort <= high:
            notes.append(
                f"class {kind}: no rotor for {name}: expected a joint that turns, with an effort limit of "
                f"{low:g} to {high:g} Nm, got {joint.body.motion} and {said.effort:g}"
            )
            continue
        found[name] = rotor_inertia(kind, said.effort)
    if not found:
        return drives, notes
    values = ", ".join(f"{name} {inertia:.2g} kg m^2" for name, inertia in found.items())
    notes.append(
        f"class {kind}: rotors of typical machines by effort limits, on the joint: {values}; tolerance "
        f"{100 * TOLERANCE:g} % of all motor_inertia unless stated"
    )
    filled = {name: _filled(name, inertia, joints, drives) for name, inertia in found.items()}
    tolerances = {"motor_inertia": TOLERANCE, **(drives.tolerances or {})}
    update = {"joint": {**drives.joint, **filled}, "tolerances": tolerances}
    return drives.model_copy(update=update), notes


def _filled(
    name: str, inertia: float, joints: Sequence[ChainJoint], drives: DriveData
) -> JointDrive:
    """Return the drive of a joint with a rotor of a reflected inertia [kg m^2]."""
    own = drives.joint.get(name, JointDrive())
    of_file = next(joint.body.drive.gear_ratio for joint in joints if joint.body.joint == name)
    ratio = of_file if own.gear_ratio is None else own.gear_ratio
    return own.model_copy(update={"motor_inertia": inertia * ratio**2})
