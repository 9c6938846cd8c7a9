"""Arms in Bullet: a multibody without rotors, whose mass matrix and bias torques PyBullet gives.

Rotors of rigid gears are reflected into the mass matrix, those of elastic gears stand beside Bullet.
Runge-Kutta steps of order four are taken here, one a substep, because Bullet's own integrator is of
order one.
"""

from __future__ import annotations

import tempfile
from functools import cache
from math import atan2, hypot
from pathlib import Path

import numpy as np
import pybullet

from .arms import Arm, Joint, Link
from .chain import DUST_KG, DUST_KG_M2, Stepped, march
from .loop import Loop

DUST = Link(DUST_KG, np.zeros(3), DUST_KG_M2 * np.eye(3))


class Plant(Stepped):
    """A machine in Bullet."""

    def __init__(self, loop: Loop):
        super().__init__(loop)
        self.client = _client()
        pybullet.resetSimulation(physicsClientId=self.client)
        pybullet.setGravity(*loop.arm.gravity_m_s2.tolist(), physicsClientId=self.client)
        self.body = _load(self.client, loop.arm)
        self.bodies = len(self.joints)
        self.still = [0.0] * self.bodies
        self.rotors = self.reflected()[: self.bodies, : self.bodies]
        self.elastic = [self.motors[axis].motor_inertia for axis in self.geared]

    def rate(self, t: float, state: np.ndarray) -> np.ndarray:
        """Return the derivative of coordinates and rates."""
        n, size, body, client = self.bodies, self.size, self.body, self.client
        whole = state.tolist()
        torque = np.array(self.torques(t, whole))
        q, v = whole[:n], whole[size : size + n]
        mass = pybullet.calculateMassMatrix(body, q, physicsClientId=client)
        bias = pybullet.calculateInverseDynamics(body, q, v, self.still, physicsClientId=client)
        joints = np.linalg.solve(np.array(mass) + self.rotors, torque[:n] - bias)
        return np.concatenate([state[size:], joints, torque[n:] / self.elastic])


def run(loop: Loop) -> None:
    """Simulate all samples of a loop.

    Raises RuntimeError if the state does not stay finite.
    """
    march(Plant(loop))


@cache
def _client() -> int:
    """Return the connection to Bullet, which runs in this process and shows nothing."""
    return pybullet.connect(pybullet.DIRECT)


def _load(client: int, arm: Arm) -> int:
    """Load the arm on a fixed base; return its number in Bullet."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "arm.urdf"
        path.write_text(urdf(arm))
        body = pybullet.loadURDF(
            str(path),
            useFixedBase=True,
            flags=pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_MAINTAIN_LINK_ORDER,
            physicsClientId=client,
        )
    for link in range(-1, len(arm.joints)):
        pybullet.changeDynamics(
            body, link, linearDamping=0, angularDamping=0, jointDamping=0, physicsClientId=client
        )
    return body


def urdf(arm: Arm) -> str:
    """Return the bodies of the arm as URDF; each inertia stands in its principal axes."""
    lines = ['<robot name="arm">', '<link name="body_0">', _inertial(DUST), "</link>"]
    for number, joint in enumerate(arm.joints):
        lines += _joint(number, joint)
        link = joint.link or DUST
        lines += [f'<link name="body_{number + 1}">', _inertial(link), "</link>"]
    return "\n".join([*lines, "</robot>"]) + "\n"


def _joint(number: int, joint: Joint) -> list[str]:
    axis = np.eye(3)["xyz".index(joint.axis)]
    return [
        f'<joint name="joint_{number}" type="continuous">',
        f'<parent link="body_{number}"/><child link="body_{number + 1}"/>',
        f'<origin xyz="{_numbers(joint.origin_m)}" rpy="0 0 0"/><axis xyz="{_numbers(axis)}"/>',
        '<dynamics damping="0" friction="0"/>',
        "</joint>",
    ]


def _inertial(link: Link) -> str:
    moments, turn = np.linalg.eigh(link.inertia_kg_m2)
    turn = turn * np.linalg.det(turn)  # eigenvectors may be a left-handed frame
    xx, yy, zz = (repr(float(x)) for x in moments)
    return (
        f'<inertial><mass value="{float(link.mass_kg)!r}"/>'
        f'<origin xyz="{_numbers(link.com_m)}" rpy="{_numbers(_roll_pitch_yaw(turn))}"/>'
        f'<inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="0" ixz="0" iyz="0"/></inertial>'
    )


def _roll_pitch_yaw(turn: np.ndarray) -> tuple[float, float, float]:
    """Return the angles about x, y and z, in this order about fixed axes [rad]."""
    pitch = atan2(-turn[2, 0], hypot(turn[0, 0], turn[1, 0]))
    if hypot(turn[0, 0], turn[1, 0]) < 1e-9:
        return atan2(-turn[1, 2], turn[1, 1]), pitch, 0.0
    return atan2(turn[2, 1], turn[2, 2]), pitch, atan2(turn[1, 0], turn[0, 0])


def _numbers(values) -> str:
    return " ".join(repr(float(x)) for x in values)
