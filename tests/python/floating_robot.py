"""Robots with a floating base, random motions of them, and simple simulations."""

import numpy as np
import pinocchio as pin
import scipy
from numpy.typing import NDArray

from axisight import BaseMotion, Robot

Array = NDArray[np.float64]


def random_link(rng: np.random.Generator) -> str:
    """Return the keys of a random link that can exist."""
    turned = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    inertia = turned @ np.diag(rng.uniform(0.1, 0.19, size=3)) @ turned.T
    values = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].tolist()
    mass, com = rng.uniform(1.0, 5.0), (0.2 * rng.normal(size=3)).tolist()
    return f"mass = {mass}\ncom = {com}\ninertia = {values}\n"


def floating_text(parents: list[int | None], seed: int = 0, *, slides: float = 0.2) -> str:
    """Return a robot file with a floating base and random links; parents None are the base."""
    rng = np.random.default_rng(seed)
    head = 'schema = "axisight.robot/2"\nname = "flyer"\ngravity = [0.0, 0.0, -9.81]\nsample_time = 1e-3\n'
    out = head + '[base]\nkind = "floating"\n[base.link]\n' + random_link(rng)
    for i, parent in enumerate(parents):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        name = "base" if parent is None else f"j{parent}"
        out += f"""[[joint]]
name = "j{i}"
parent = "{name}"
kind = "driven"
motion = "{"prismatic" if rng.random() < slides else "revolute"}"
origin = {(0.3 * rng.normal(size=3)).tolist()}
axis = {axis.tolist()}
[joint.link]
{random_link(rng)}[joint.drive]
gear_ratio = 0.1
motor_inertia = 0.0
viscous_friction = 0.0
"""
    return out


def random_base(rng: np.random.Generator, n: int) -> BaseMotion:
    """Return random motions of a base, (n, 3)."""
    return BaseMotion(*(scale * rng.normal(size=(n, 3)) for scale in (2.0, 10.0, 10.0)))


def pinocchio_motion(
    rotation: Array, velocity_m_s: Array, base: BaseMotion, gravity: Array
) -> tuple[Array, Array, Array]:
    """Return position (7), velocity (6) and acceleration (6) of a free flyer for the same motion.

    ``velocity_m_s`` (3,) is that of the origin in base axes. Pinocchio's linear acceleration is the rate of
    change of these components, which leaves out ``w x v``.
    """
    rate, growth, proper = (x[0] for x in base.parts())
    quaternion = scipy.spatial.transform.Rotation.from_matrix(rotation).as_quat()
    linear = proper + rotation.T @ gravity - np.cross(rate, velocity_m_s)
    return (
        np.concatenate([[0.3, -0.2, 1.1], quaternion]),
        np.concatenate([velocity_m_s, rate]),
        np.concatenate([linear, growth]),
    )


def inertia_of(model: pin.Model, q: Array) -> Array:
    """Return the full inertia matrix of Pinocchio."""
    upper = np.triu(np.array(pin.crba(model, model.createData(), q)))
    return upper + np.triu(upper, 1).T


def drifting(
    robot: Robot, q: Array, v: Array, twist: Array, torque: Array, step_s: float, n: int
) -> tuple[Array, Array, Array, Array]:
    """Return rotation, twist (linear, angular; base axes), joint angles and rates after ``n`` steps of RK4.

    Constant joint torques act, and nothing else but gravity, which a falling frame leaves out.
    """

    def rates(state: Array) -> Array:
        turn, twist, q, v = _split(state, robot.n_joints)
        base = BaseMotion(twist[3:], np.zeros(3), np.zeros(3))
        found = robot.forward_dynamics(q, v, torque, base=base)
        # The components of the velocity in base axes change by the acceleration minus w x v.
        linear = found[:3] - np.cross(twist[3:], twist[:3])
        spin = np.cross(np.eye(3), twist[3:])
        return np.concatenate([(turn @ spin).ravel(), linear, found[3:6], v, found[6:]])

    state = np.concatenate([np.eye(3).ravel(), twist, q, v])
    for _ in range(n):
        a = rates(state)
        b = rates(state + 0.5 * step_s * a)
        c = rates(state + 0.5 * step_s * b)
        d = rates(state + step_s * c)
        state = state + step_s / 6.0 * (a + 2 * b + 2 * c + d)
    return _split(state, robot.n_joints)


def _split(state: Array, n: int) -> tuple[Array, Array, Array, Array]:
    turn, twist, q, v = np.split(state, [9, 15, 15 + n])
    return turn.reshape(3, 3), twist, q, v
