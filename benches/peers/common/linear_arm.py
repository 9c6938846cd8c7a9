"""The linearized elastic robot in NumPy, independent of the package.

Written from the file format's specification: inertia matrix from Jacobians, gravity stiffness
from first moments, equilibrium of the elastic joints by fixed-point iteration, the sampled
response by one batched `numpy.linalg.solve` over the lines. Revolute joints and compliant
gears only.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm, expm_frechet

Array = np.ndarray


@dataclass
class Arm:
    """Numbers of a robot description, and the matrices of its linearization."""

    data: dict

    @classmethod
    def read(cls, text: str) -> Arm:
        return cls(tomllib.loads(text))

    def with_values(self, values: dict[str, float]) -> Arm:
        joints = [dict(j) for j in self.data["joint"]]
        by_name = {j["name"]: j for j in joints}
        for name, value in values.items():
            joint, quantity = name.rsplit(".", 1)
            if quantity in ("stiffness", "damping"):
                by_name[joint][quantity] = value
            elif quantity in ("motor_inertia", "viscous_friction"):
                by_name[joint]["drive"] = by_name[joint]["drive"] | {quantity: value}
            else:
                raise ValueError(f"not a parameter of this model: {name}")
        return Arm(self.data | {"joint": joints})

    def kinematics(self, q: Array) -> tuple[Array, Array, list]:
        """Axes and origins of the joints, and rotation, mass and centre of every body."""
        r, p = np.eye(3), np.zeros(3)
        axes, origins, bodies = [], [], []
        for i, joint in enumerate(self.data["joint"]):
            p = p + r @ joint["origin"]
            axis = np.asarray(joint["axis"], float)
            x, y, z = axis
            k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            axes.append(r @ axis)
            origins.append(p)
            r = r @ (np.eye(3) + np.sin(q[i]) * k + (1 - np.cos(q[i])) * (k @ k))
            if "link" in joint:
                bodies.append((i, joint["link"], r, p + r @ joint["link"]["com"]))
        return np.array(axes), np.array(origins), bodies

    def gravity(self, q: Array) -> tuple[Array, Array, Array]:
        """Inertia matrix, gravity torques and their derivative."""
        n = len(q)
        axes, origins, bodies = self.kinematics(q)
        g = np.array(self.data["gravity"])
        mass, torque, stiffness = np.zeros((n, n)), np.zeros(n), np.zeros((n, n))
        for i, link, r, com in bodies:
            jv = np.zeros((3, n))
            jv[:, : i + 1] = np.cross(axes[: i + 1], com - origins[: i + 1]).T
            jw = np.zeros((3, n))
            jw[:, : i + 1] = axes[: i + 1].T
            xx, yy, zz, xy, xz, yz = link["inertia"]
            inertia = r @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ r.T
            mass += link["mass"] * jv.T @ jv + jw.T @ inertia @ jw
            torque -= link["mass"] * g @ jv
            second = np.cross(axes[:, None], jv.T[None]) @ g * -link["mass"]
            upper = np.triu(second)
            stiffness += upper + np.triu(second, 1).T
        return mass, torque, stiffness

    def matrices(self, driven: Array) -> tuple[Array, Array, Array, Array]:
        """M, D, K and the input matrix over motor angles and joint angles."""
        joints = self.data["joint"]
        n = len(joints)
        motors = [i for i, j in enumerate(joints) if j["kind"] == "driven"]
        springs = [i for i in range(n) if i not in motors]
        k_e = np.array([joints[i]["stiffness"] for i in springs])
        q = np.zeros(n)
        q[motors] = driven
        for _ in range(50):
            change = -self.gravity(q)[1][springs] / k_e - q[springs]
            q[springs] += change
            if np.abs(change).max() < 1e-14:
                break
        inertia, _, gravity = self.gravity(q)
        m = len(motors)
        mass, damping, stiffness = (np.zeros((m + n, m + n)) for _ in range(3))
        mass[m:, m:], stiffness[m:, m:] = inertia, gravity
        for a, i in enumerate(motors):
            drive = joints[i]["drive"]
            mass[a, a] = drive["motor_inertia"]
            pull = np.zeros(m + n)
            pull[a], pull[m + i] = drive["gear_ratio"], -1.0
            damping += joints[i]["damping"] * np.outer(pull, pull)
            stiffness += joints[i]["stiffness"] * np.outer(pull, pull)
            damping[a, a] += drive["viscous_friction"]
        for i in springs:
            damping[m + i, m + i] += joints[i]["damping"]
            stiffness[m + i, m + i] += joints[i]["stiffness"]
        return mass, damping, stiffness, np.eye(m + n, m)

    def held(self, matrices: tuple[Array, ...]) -> Array:
        """``[A B; 0 0] T``."""
        mass, damping, stiffness, port = matrices
        n, m = port.shape
        rows = np.linalg.solve(mass, np.hstack([-stiffness, -damping, port]))
        joint = np.zeros((2 * n + m, 2 * n + m))
        joint[:n, n : 2 * n] = np.eye(n)
        joint[n : 2 * n] = rows
        return joint * self.data["sample_time"]


def response(arm: Arm, driven: Array, z: Array) -> Array:
    """``G(z)`` from torque to motor angle, (n_freq, m, m)."""
    matrices = arm.matrices(driven)
    joint = expm(arm.held(matrices))
    m = matrices[3].shape[1]
    n = len(joint) - m
    shifted = z[:, None, None] * np.eye(n) - joint[:n, :n]
    return np.linalg.solve(shifted, joint[:n, n:])[:, :m]


def response_and_gradient(
    arm: Arm, values: dict[str, float], driven: Array, z: Array
) -> tuple[Array, Array]:
    """``G(z)`` and its derivatives over the logarithms of the values, exact in the response.

    Only the small matrices are differenced.
    """
    step = 1e-6
    held = arm.held(arm.matrices(driven))
    joint = expm(held)
    m = len(driven)
    n = len(joint) - m
    shifted = z[:, None, None] * np.eye(n) - joint[:n, :n]
    into = np.linalg.solve(shifted, joint[:n, n:])
    output = np.broadcast_to(np.eye(m, n), (len(z), m, n))
    left = np.linalg.solve(shifted.transpose(0, 2, 1), output.transpose(0, 2, 1))
    left = left.transpose(0, 2, 1)
    gradient = []
    for name, value in values.items():
        moved = arm.with_values({name: value * np.exp(step)})
        change = (moved.held(moved.matrices(driven)) - held) / step
        d = expm_frechet(held, change, compute_expm=False)
        gradient.append(left @ (d[:n, :n] @ into + d[:n, n:]))
    return into[:, :m], np.array(gradient)
