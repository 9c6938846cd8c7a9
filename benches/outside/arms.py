"""What a machine consists of, and how it rests: the quantities of a robot file, nothing of an engine."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

GRAVITY_M_S2 = (0.0, 0.0, -9.81)


@dataclass(frozen=True)
class Link:
    """A rigid body: mass [kg], centre of mass [m], inertia about it [kg m^2] (3 x 3), frame of its joint."""

    mass_kg: float
    com_m: np.ndarray
    inertia_kg_m2: np.ndarray

    def with_point_mass(self, mass_kg: float, at_m: np.ndarray) -> Link:
        """Return the body with a point mass fixed to it."""
        total = self.mass_kg + mass_kg
        com = (self.mass_kg * self.com_m + mass_kg * at_m) / total
        inertia = self.inertia_kg_m2.copy()
        for mass, place in ((self.mass_kg, self.com_m), (mass_kg, at_m)):
            d = place - com
            inertia = inertia + mass * (d @ d * np.eye(3) - np.outer(d, d))
        return Link(total, com, inertia)


def body(mass_kg: float, com_m: tuple[float, ...], *inertia_kg_m2: float) -> Link:
    """Return a link; inertias xx, yy, zz about the centre of mass, then xy, xz, yz if not zero [kg m^2]."""
    xx, yy, zz, *mixed = inertia_kg_m2
    xy, xz, yz = mixed or (0.0, 0.0, 0.0)
    return Link(
        mass_kg, np.array(com_m), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], dtype=float)
    )


@dataclass(frozen=True)
class Joint:
    """A joint of the chain. ``ratio`` is joint angle per motor angle; None: elastic, without a motor.

    ``stiffness`` [Nm/rad] and ``damping`` [Nm s/rad] are those of the gear, or of the elastic joint;
    ``motor_inertia`` [kg m^2] and ``viscous`` [Nm s/rad] are on the motor side.
    """

    name: str
    origin_m: tuple[float, float, float]
    axis: str
    link: Link | None = None
    stiffness: float | None = None
    damping: float | None = None
    ratio: float | None = None
    motor_inertia: float = 0.0
    viscous: float = 0.0


@dataclass(frozen=True)
class Arm:
    """A robot with its controller and encoders; gains as in the robot file, one per driven joint."""

    name: str
    engine: str
    sample_time_s: float
    joints: tuple[Joint, ...]
    controller: str
    kp: np.ndarray
    ki: np.ndarray
    kv: np.ndarray
    noise_std_rad: float
    pose_rad: np.ndarray
    top_speed_rad_s: np.ndarray
    gravity_m_s2: np.ndarray = field(default_factory=lambda: np.array(GRAVITY_M_S2))
    zero_rad: np.ndarray | None = None

    @property
    def driven(self) -> list[int]:
        """Indices of the joints with a motor."""
        return [i for i, joint in enumerate(self.joints) if joint.ratio is not None]

    @property
    def ratios(self) -> np.ndarray:
        """Gear ratios of the driven joints."""
        return np.array([self.joints[i].ratio for i in self.driven])

    @property
    def zeros_rad(self) -> np.ndarray:
        """What the true joint angles are more than the encoders say [rad]."""
        return np.zeros(len(self.driven)) if self.zero_rad is None else self.zero_rad

    def with_joint(self, index: int, **changes: object) -> Arm:
        """Return the arm with other values of a joint."""
        joints = list(self.joints)
        joints[index] = replace(joints[index], **changes)
        return replace(self, joints=tuple(joints))

    def carrier(self, axis: int) -> int:
        """Return the joint that bears the link of a driven axis, behind its elastic joints."""
        later = [*self.driven, len(self.joints)][axis + 1]
        return next(i for i in range(self.driven[axis], later) if self.joints[i].link is not None)


def rotation(axis: str, angle_rad: float) -> np.ndarray:
    """Return the rotation matrix about a coordinate axis."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    i = "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    matrix = np.eye(3)
    matrix[j, j] = matrix[k, k] = c
    matrix[j, k], matrix[k, j] = -s, s
    return matrix


def gravity_torque(arm: Arm, angles_rad: np.ndarray) -> np.ndarray:
    """Return the torques that hold all joints against gravity [Nm]."""
    place, turn = np.zeros(3), np.eye(3)
    places, axes, bodies = [], [], []
    for joint, angle in zip(arm.joints, angles_rad, strict=True):
        place = place + turn @ np.array(joint.origin_m)
        places.append(place)
        axes.append(turn @ np.eye(3)["xyz".index(joint.axis)])
        turn = turn @ rotation(joint.axis, angle)
        link = joint.link
        bodies.append((0.0, place) if link is None else (link.mass_kg, place + turn @ link.com_m))
    torque = np.zeros(len(arm.joints))
    for j, (pivot, axis) in enumerate(zip(places, axes, strict=True)):
        for mass, com in bodies[j:]:
            torque[j] -= mass * np.cross(axis, com - pivot) @ arm.gravity_m_s2
    return torque


def rest(arm: Arm, pull) -> tuple[np.ndarray, np.ndarray]:
    """Return all joint angles and the gear torques [Nm] of the arm at rest in its pose.

    ``pull(angles)`` gives the torques of springs and the like on the driven joints [Nm].
    """
    angles = np.zeros(len(arm.joints))
    angles[arm.driven] = arm.pose_rad + arm.zeros_rad
    elastic = [i for i in range(len(arm.joints)) if i not in arm.driven]
    for _ in range(50):  # contracts by the ratio of gravity to stiffness, below 0.1 a pass
        load = gravity_torque(arm, angles)
        for i in elastic:
            angles[i] = -load[i] / arm.joints[i].stiffness
    held = angles[arm.driven]
    return angles, gravity_torque(arm, angles)[arm.driven] - np.array(pull(held))


def robot_file(arm: Arm) -> str:
    """Return the arm as a robot file."""
    lines = [
        'schema = "axisight.robot/1"',
        f'name = "{arm.name}"',
        f"gravity = {[float(g) for g in arm.gravity_m_s2]}",
        f"sample_time = {arm.sample_time_s}",
    ]
    for joint in arm.joints:
        unit = [float(letter == joint.axis) for letter in "xyz"]
        kind = "elastic" if joint.ratio is None else "driven"
        lines += ["", "[[joint]]", f'name = "{joint.name}"', f'kind = "{kind}"']
        lines += [f"origin = {[float(x) for x in joint.origin_m]}", f"axis = {unit}"]
        if joint.stiffness is not None:
            lines += [f"stiffness = {joint.stiffness}", f"damping = {joint.damping}"]
        if joint.link is not None:
            i = joint.link.inertia_kg_m2
            six = [i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]]
            lines += ["[joint.link]", f"mass = {float(joint.link.mass_kg)}"]
            lines += [f"com = {[float(x) for x in joint.link.com_m]}"]
            lines += [f"inertia = {[float(x) for x in six]}"]
        if joint.ratio is not None:
            lines += ["[joint.drive]", f"gear_ratio = {joint.ratio}"]
            lines += [f"motor_inertia = {joint.motor_inertia}"]
            lines += [f"viscous_friction = {joint.viscous}"]
    lines += ["", "[controller]", f'kind = "{arm.controller}"']
    gains = ("kv", "kp", "ki") if arm.controller == "cascade" else ("kp", "ki")
    lines += [f"{gain} = {[float(k) for k in getattr(arm, gain)]}" for gain in gains]
    lines += ["", "[sensor]", f"position_noise_std = {arm.noise_std_rad}"]
    lines += ["", "[operating_point]", f"joint_angle = {[float(q) for q in arm.pose_rad]}"]
    return "\n".join(lines) + "\n"
