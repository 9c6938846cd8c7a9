"""Typical rotor inertias for model files without rotors, by class of robot and effort limit.

Gear ratios and friction are not filled in. A gear ratio that is nearly right is wrong, and friction depends
on oil and age; a re-fit within tolerances could correct neither.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from axisight.robot_import.chain import ChainJoint
from axisight.robot_import.drives import DriveData, JointDrive, RobotClass

# (effort limit [Nm], rotor inertia reflected to the joint [kg m^2]) of known joints; docs/models.md has the
# sources.
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
# An effort limit beyond the known ones by more than this factor is not a real limit, or of another class.
_BEYOND = 4.0
TOLERANCE = 0.6
"""Tolerance of a rotor inertia by class [1]: servos of one size differ by a factor of two and more."""


def effort_range_nm(kind: RobotClass) -> tuple[float, float]:
    """Return the smallest and largest effort limit [Nm] for which a class gives a rotor."""
    efforts = [effort for effort, _ in _KNOWN[kind]]
    return min(efforts) / _BEYOND, max(efforts) * _BEYOND


def rotor_inertia(kind: RobotClass, effort_nm: float) -> float:
    """Return a typical reflected rotor inertia [kg m^2], from a power law through the known joints."""
    effort, inertia = np.log(np.array(_KNOWN[kind])).T
    slope, level = np.polyfit(effort, inertia, 1)
    return float(np.exp(level + slope * np.log(effort_nm)))


def with_rotors(joints: Sequence[ChainJoint], drives: DriveData) -> tuple[DriveData, list[str]]:
    """Return the drive data with missing rotors filled in by class, and notes on them.

    A rotor is missing if neither the drive data nor the model file state it.
    """
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
    """Return the drive data of a joint with a rotor; ``inertia`` [kg m^2] is reflected to the joint."""
    own = drives.joint.get(name, JointDrive())
    of_file = next(joint.body.drive.gear_ratio for joint in joints if joint.body.joint == name)
    ratio = of_file if own.gear_ratio is None else own.gear_ratio
    return own.model_copy(update={"motor_inertia": inertia * ratio**2})
