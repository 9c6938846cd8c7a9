"""Write a chain and its drives as a robot file."""

from __future__ import annotations

from typing import Any

import numpy as np
import tomlkit

from axisight.arguments import shown
from axisight.effects import effect_info
from axisight.effects.dcmotor import effects_of
from axisight.effects.stated import (
    DRAG,
    DRY_FRICTION,
    JOINT_SPRING,
    LAG,
    LATE_READING,
    LEAD,
    OFFSET,
    TORQUE_CONSTANT,
    TORQUE_LIMIT,
    TRANSPORT_DELAY,
)
from axisight.errors import RobotError
from axisight.robot_import.bodies import Drive, Mass, Pose, joined
from axisight.robot_import.chain import Chain, ChainJoint
from axisight.robot_import.classes import with_rotors
from axisight.robot_import.drives import DriveData, JointDrive, Payload

# Usual in simulators for such files; logs and drive data may state another.
DEFAULT_SAMPLE_TIME_S = 1e-3


def description(chain: Chain, drives: DriveData, source: str) -> str:
    """Return the text of a robot file (``axisight.robot/2``); its head names ``source``.

    Raises RobotError for drive data of joints that the chain does not have.
    """
    names = [joint.body.joint for joint in chain.joints]
    for name in drives.joint:
        if name not in names:
            raise RobotError(
                f"drive data: joint.{name}: expected one of {', '.join(names)}, got {shown(name)}"
            )
    drives, by_class = with_rotors(chain.joints, drives)
    joints = list(chain.joints)
    if drives.payload is not None and not chain.is_chain:
        raise RobotError(
            "drive data: payload: expected a robot without branches, which has one last link, got one with "
            "branches: add the load to the mass of a link in the model file"
        )
    last = _loaded(joints[-1].mass, drives.payload, chain.end)
    tables, effects = [], []
    for number, joint in enumerate(joints, start=1):
        drive = drives.joint.get(joint.body.joint, JointDrive())
        mass = last if joint is joints[-1] else joint.mass
        table, ratio = _joint(joint, mass, drive)
        if joint.parent != (number - 2 if number > 1 else None):
            table["parent"] = "base" if joint.parent is None else names[joint.parent]
        tables.append(table)
        spring = joint.body.drive.spring
        if spring > 0:
            effects.append(
                {
                    "name": JOINT_SPRING[0],
                    "axis": number,
                    JOINT_SPRING[1]: spring,
                    JOINT_SPRING[2]: spring * joint.body.drive.spring_rest_rad,
                }
            )
        effects += _torque_path(joint.body.drive, number, ratio)
        effects += _dry_friction(joint.body.drive, drive.coulomb_friction, number, ratio)
        effects += _motor_effects(joint.body.drive, number, ratio)
    document: dict[str, Any] = {
        "schema": "axisight.robot/2",
        "name": chain.name,
        "gravity": _floats(chain.gravity_m_s2),
        "sample_time": drives.sample_time or DEFAULT_SAMPLE_TIME_S,
    }
    if chain.base is not None:
        document["base"] = {"kind": "floating", "link": _link(chain.base)}
    document["joint"] = tables
    pose = drives.operating_point or _rest(joints)
    # Zero is what a robot file without a pose means: whoever reads it sees that none was stated.
    if drives.operating_point is not None or any(pose):
        document["operating_point"] = {"joint_angle": pose}
    controller = controller_of(chain, drives)
    if controller is not None:
        document["controller"] = controller
    if drives.position_noise_std is not None:
        document["sensor"] = {"position_noise_std": drives.position_noise_std}
    if drives.tolerances is not None:
        document["tolerances"] = drives.tolerances
    if effects:
        document["effect"] = effects
    head = [
        f"imported from {source}",
        *chain.notes,
        *by_class,
        *_constants(chain, drives),
        *_defaults(chain, tables, drives, controller),
    ]
    return "".join(f"# {_line(note)}\n" for note in head) + tomlkit.dumps(document)


def controller_of(chain: Chain, drives: DriveData) -> dict[str, Any] | None:
    """Return the controller table of the drive data, else of the actuators; None without one.

    Actuators give a controller only if every joint has one with position targets.
    """
    if drives.controller is not None:
        return drives.controller
    said = [joint.body.drive for joint in chain.joints]
    servos = [(drive, drive.servo) for drive in said if drive.servo is not None]
    if len(servos) < len(said):
        return None
    # Drive data may change the gear ratio, and motor-side gains scale with its square.
    given = [drives.joint.get(joint.body.joint, JointDrive()) for joint in chain.joints]
    by = [
        (_ratio(joint, drive) / joint.body.drive.gear_ratio) ** 2
        for joint, drive in zip(chain.joints, given, strict=True)
    ]
    out = {
        "kind": "pd_position",
        "kp": [kp * other for (_, (kp, _)), other in zip(servos, by, strict=True)],
        "kd": [kd * other for (_, (_, kd)), other in zip(servos, by, strict=True)],
        "velocity_feedforward": False,
        "continuous": True,
    }
    if chain.holds_weight:
        out["gravity_compensation"] = True
    if chain.steps is not None:
        added = [
            chain.steps.added_inertia(kd, drive.damping * drive.gear_ratio**2) * other
            for (drive, (_, kd)), other in zip(servos, by, strict=True)
        ]
        out |= {"step": chain.steps.step_s, "step_inertia": added}
    return out


def _ratio(joint: ChainJoint, drive: JointDrive) -> float:
    """Return the gear ratio of a joint from its drive data, else from the model file."""
    return joint.body.drive.gear_ratio if drive.gear_ratio is None else drive.gear_ratio


def _defaults(
    chain: Chain,
    tables: list[dict[str, Any]],
    drives: DriveData,
    controller: dict[str, Any] | None,
) -> list[str]:
    """Return notes on the defaults for everything that neither the model file nor the drive data state."""
    out = []
    servos = [joint.body.joint for joint in chain.joints if joint.body.drive.servo is not None]
    if all(table["drive"]["gear_ratio"] == 1.0 for table in tables):
        out.append("no gear ratios: angles and torques of motors are those of the joints")
    if all(table["drive"]["motor_inertia"] == 0.0 for table in tables):
        out.append("no rotors: motors have no inertia")
    if controller is None:
        out += _told_speeds(chain)
        if servos:
            out.append(
                f"actuators of {', '.join(servos)} are told positions, those of other joints are not: left out, "
                f"to be said in the drive data"
            )
        out.append("no controller: logs are compared by inverse dynamics")
    elif drives.controller is None:
        out.append("controller: actuators that are told positions")
    return out


def _told_speeds(chain: Chain) -> list[str]:
    """Return a note on actuators with speed targets, whose law a robot file cannot state."""
    gains = [(joint.body.joint, joint.body.drive.speed_gain) for joint in chain.joints]
    said = [f"{name} {gain:g}" for name, gain in gains if gain is not None]
    if not said:
        return []
    return [
        f"actuators that are told speeds ({', '.join(said)} Nm s/rad): no controller of a robot file holds "
        f"between samples and lets an arm sink as they do; log their force as torque, or say p_velocity in the "
        f"drive data, which is sampled and holds the arm where it begins"
    ]


def torque_constants(chain: Chain, drives: DriveData) -> list[float | None]:
    """Return the torque constant of every motor [Nm/A]; None if the drive data state none."""
    stated = (drives.joint.get(joint.body.joint) for joint in chain.joints)
    return [None if drive is None else drive.torque_constant for drive in stated]


def _constants(chain: Chain, drives: DriveData) -> list[str]:
    """Return a note on the torque constants, which a robot file cannot state."""
    pairs = zip(chain.joints, torque_constants(chain, drives), strict=True)
    known = [f"{joint.body.joint} {value:g}" for joint, value in pairs if value is not None]
    if not known:
        return []
    return [
        f"torque constants {', '.join(known)} Nm/A: of currents in logs that are read with this model; a robot "
        f"file has no place for them, with it they are the scale in the column map"
    ]


def _line(text: str) -> str:
    return " ".join(text.split())


def _joint(joint: ChainJoint, mass: Mass | None, drive: JointDrive) -> tuple[dict[str, Any], float]:
    """Return the table of a joint for the robot file, and its gear ratio."""
    said = joint.body.drive
    ratio = _ratio(joint, drive)
    rotor = said.rotor_inertia * ratio**2 if drive.motor_inertia is None else drive.motor_inertia
    viscous = said.damping * ratio**2
    if drive.viscous_friction is not None:
        viscous = drive.viscous_friction
    table: dict[str, Any] = {
        "name": joint.body.joint,
        "kind": "driven",
        "motion": joint.body.motion,
        "origin": _floats(joint.origin_m),
        "axis": _floats(joint.axis / np.linalg.norm(joint.axis)),
    }
    for key in ("stiffness", "damping"):
        if (value := getattr(drive, key)) is not None:
            table[key] = value
    if mass is not None:
        table["link"] = _link(mass)
    table["drive"] = {
        "gear_ratio": float(ratio),
        "motor_inertia": float(rotor),
        "viscous_friction": float(viscous),
    }
    if limits := joint.body.limits.stated():
        table["limits"] = limits
    return table, ratio


def _link(mass: Mass) -> dict[str, Any]:
    """Return the table of a link for the robot file."""
    return {
        "mass": float(mass.mass_kg),
        "com": _floats(mass.com_m),
        "inertia": _floats(mass.inertia_kg_m2[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]),
    }


def _torque_path(drive: Drive, axis: int, ratio: float) -> list[dict[str, Any]]:
    """Return the effects between command and torque of a motor: limit, delay, lag, and a gain other than 1.

    ``ratio`` is the gear ratio in use. If it differs from that of the file, the motor-side limit changes.
    """
    limit = drive.limit_nm * abs(ratio / drive.gear_ratio)
    values = {
        TORQUE_LIMIT: limit if np.isfinite(limit) else 0.0,
        TRANSPORT_DELAY: drive.delay_s,
        LAG: drive.lag_s,
        TORQUE_CONSTANT: drive.gain - 1,
    }
    return [
        {"name": name, "axis": axis, parameter: value}
        for (name, parameter), value in values.items()
        if value != 0
    ]


def _motor_effects(drive: Drive, axis: int, ratio: float) -> list[dict[str, Any]]:
    """Return drag, cogging and bristles, constant torque and a late encoder of an axis as effects."""
    values = {
        DRAG: drive.drag * abs(ratio) ** 3,
        OFFSET: drive.offset_nm * ratio / drive.gear_ratio,
        LATE_READING: 0.0 if drive.servo is not None else drive.reading_delay_s,
    }
    out: list[dict[str, Any]] = [
        {"name": name, "axis": axis, parameter: value}
        for (name, parameter), value in values.items()
        if value != 0
    ]
    found, _ = effects_of(drive.devices, axis, ratio)
    return out + [{"name": e.name, "axis": axis, **(e.parameters or {})} for e in found]


def _dry_friction(
    drive: Drive, measured_nm: float | None, axis: int, ratio: float
) -> list[dict[str, Any]]:
    """Return the dry friction of an axis (from 1) as effects: none or one.

    ``measured_nm``: dry friction in drive data, motor-side. It replaces that of the file and its law.
    """
    friction, moment, corner = DRY_FRICTION
    law = drive if measured_nm is None else Drive()
    nm = drive.friction * abs(ratio) if measured_nm is None else measured_nm
    if nm <= 0:
        return []
    found: dict[str, Any] = {"name": friction, "axis": axis, moment: nm}
    bounds = {p.name: (p.lower, p.upper) for p in effect_info(friction).parameters}
    told = {corner: law.friction_corner_rad_s / abs(ratio)}
    if law.friction_lead_s > 0:
        told[LEAD] = law.friction_lead_s
    # A friction that changes its sign more slowly or sharply than any real one is taken as far as the effect goes.
    return [found | {name: float(np.clip(x, *bounds[name])) for name, x in told.items()}]


def _loaded(mass: Mass | None, payload: Payload | None, end: Pose) -> Mass | None:
    if payload is None:
        return mass
    load = Mass(payload.mass, np.array(payload.com), np.zeros((3, 3))).at(end)
    return joined([load] if mass is None else [mass, load])


def _rest(joints: list[ChainJoint]) -> list[float]:
    """Return the default operating point: zero, or the middle of the range if zero is outside."""
    out = []
    for joint in joints:
        lower, upper = joint.body.limits.position or (0.0, 0.0)
        out.append(0.0 if lower <= 0.0 <= upper else (lower + upper) / 2)
    return out


def _floats(values: np.ndarray) -> list[float]:
    return [float(value) for value in values]
