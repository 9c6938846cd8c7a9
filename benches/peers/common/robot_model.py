"""The elastic robot's equations of motion, independent of the package.

Written from the file format's specification. The rigid-body terms are in spatial
coordinates about the origin of the base frame (Featherstone 2008, chapters 2, 5 and 6):
with everything about one point, wrenches and inertias of links simply add up. The inertia
matrix comes from composite bodies, the bias from the recursive Newton-Euler algorithm, the
accelerations from an unrolled LDL^T factorization.

States ``[phi, q, phi', q']``, then one bristle deflection per axis with LuGre friction.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, field

import numpy as np

from common.expressions import Scalar, Tape

Vector = list[Scalar]


@dataclass(frozen=True)
class Lugre:
    """LuGre friction of a motor (Canudas de Wit et al. 1995)."""

    stiffness_nm_rad: float
    damping_nm_s_rad: float
    coulomb_nm: float
    static_nm: float
    stribeck_speed_rad_s: float


@dataclass(frozen=True)
class Extras:
    """Effects on every axis, all off unless given."""

    coulomb_nm: float = 0.0
    smoothing_rad_s: float = 0.1
    cubic_nm_rad3: float = 0.0
    ripple_nm: float = 0.0
    ripple_order: float = 1.0
    lugre: Lugre | None = None


@dataclass
class Drive:
    """A motor with its gear, and the joint it moves."""

    joint: int
    ratio: float
    inertia: float
    viscous: float
    stiffness: float
    damping: float


@dataclass
class Model:
    """Numbers of a robot description; joints from base to tip."""

    gravity: list[float]
    axes: list[list[float]]
    origins: list[list[float]]
    links: list[dict | None]
    drives: list[Drive]
    elastic: list[tuple[int, float, float]]
    controller: dict = field(default_factory=dict)
    sample_time: float = 0.0

    @property
    def n_axes(self) -> int:
        return len(self.drives)

    @property
    def n_joints(self) -> int:
        return len(self.axes)


def read(text: str) -> Model:
    """The model in a robot description; revolute joints and compliant gears only."""
    data = tomllib.loads(text)
    drives, elastic = [], []
    for i, joint in enumerate(data["joint"]):
        if joint.get("motion", "revolute") != "revolute":
            raise ValueError("this independent model knows revolute joints only")
        if joint["kind"] == "elastic":
            elastic.append((i, joint["stiffness"], joint["damping"]))
            continue
        motor = joint["drive"]
        drives.append(
            Drive(
                i,
                motor["gear_ratio"],
                motor["motor_inertia"],
                motor["viscous_friction"],
                joint["stiffness"],
                joint["damping"],
            )
        )
    joints = data["joint"]
    return Model(
        data["gravity"],
        [j["axis"] for j in joints],
        [j["origin"] for j in joints],
        [j.get("link") for j in joints],
        drives,
        elastic,
        data["controller"],
        data["sample_time"],
    )


def cross(a: Vector, b: Vector) -> Vector:
    return [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]


def dot(a: Vector, b: Vector) -> Scalar:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def add(a: Vector, b: Vector) -> Vector:
    return [x + y for x, y in zip(a, b, strict=True)]


def times(a: Vector, s: Scalar) -> Vector:
    return [x * s for x in a]


def turned(r: list[Vector], axis: list[float], angle: Scalar, tape: Tape) -> list[Vector]:
    """``r Rot(axis, angle)``; products with the zeros of an axis are never written."""
    s, c = tape.call("sin", angle), tape.call("cos", angle)
    x, y, z = (float(a) for a in axis)
    t = 1.0 - c
    rotation = [
        [c + t * (x * x) if abs(x) != 1 else tape.constant(1), t * (x * y) - s * z],
        [t * (x * y) + s * z, c + t * (y * y) if abs(y) != 1 else tape.constant(1)],
        [t * (x * z) - s * y, t * (y * z) + s * x],
    ]
    third = [t * (x * z) + s * y, t * (y * z) - s * x]
    third.append(c + t * (z * z) if abs(z) != 1 else tape.constant(1))
    for row, last in zip(rotation, third, strict=True):
        row.append(last)
    return [[dot(row, [rotation[k][j] for k in range(3)]) for j in range(3)] for row in r]


@dataclass
class SpatialInertia:
    """Mass, first moment and second moment about the base origin."""

    mass: float
    first: Vector
    second: list[Vector]

    def plus(self, other: SpatialInertia) -> SpatialInertia:
        rows = [add(a, b) for a, b in zip(self.second, other.second, strict=True)]
        return SpatialInertia(self.mass + other.mass, add(self.first, other.first), rows)

    def times(self, angular: Vector, linear: Vector) -> tuple[Vector, Vector]:
        """Moment and force (or momentum) that belong to a motion."""
        moment = add([dot(row, angular) for row in self.second], cross(self.first, linear))
        force = add(times(linear, self.mass), cross(angular, self.first))
        return moment, force


def link_inertia(link: dict, r: list[Vector], p: Vector) -> SpatialInertia:
    """Spatial inertia of a link whose frame has rotation ``r`` and origin ``p``."""
    com, mass = link["com"], link["mass"]
    c = [p[i] + dot(r[i], com) for i in range(3)]
    xx, yy, zz, xy, xz, yz = link["inertia"]
    about_com = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
    half = [[dot(row, column) for column in zip(*about_com, strict=True)] for row in r]
    second = [[dot(half[i], r[j]) for j in range(3)] for i in range(3)]
    square = dot(c, c) * mass
    for i in range(3):
        for j in range(3):
            second[i][j] = second[i][j] - c[i] * c[j] * mass
        second[i][i] = second[i][i] + square
    return SpatialInertia(mass, times(c, mass), second)


def rigid_body(
    model: Model, q: Vector, v: Vector, tape: Tape
) -> tuple[list[list[Scalar]], list[Scalar]]:
    """Lower triangle of the inertia matrix, and bias forces ``c(q, q') + g(q)``."""
    one, zero = tape.constant(1.0), tape.constant(0.0)
    r = [[one if i == j else zero for j in range(3)] for i in range(3)]
    p = [zero] * 3
    angular, linear = [zero] * 3, [zero] * 3
    turn, push = [zero] * 3, [tape.constant(-g) for g in model.gravity]
    motions, inertias, wrenches = [], [], []
    for i in range(model.n_joints):
        p = [p[k] + dot(r[k], model.origins[i]) for k in range(3)]
        axis = [dot(r[k], model.axes[i]) for k in range(3)]
        lever = cross(p, axis)
        spin, slide = times(axis, v[i]), times(lever, v[i])
        # The joint's own velocity drops out of v x (S q').
        turn = add(turn, cross(angular, spin))
        push = add(push, add(cross(angular, slide), cross(linear, spin)))
        angular, linear = add(angular, spin), add(linear, slide)
        r = turned(r, model.axes[i], q[i], tape)
        motions.append((axis, lever))
        link = model.links[i]
        if link is None:
            inertias.append(None)
            wrenches.append(None)
            continue
        inertia = link_inertia(link, r, p)
        moment, force = inertia.times(turn, push)
        spin_momentum, momentum = inertia.times(angular, linear)
        moment = add(moment, add(cross(angular, spin_momentum), cross(linear, momentum)))
        force = add(force, cross(angular, momentum))
        inertias.append(inertia)
        wrenches.append((moment, force))
    return gather(motions, inertias, wrenches)


def gather(motions: list, inertias: list, wrenches: list) -> tuple[list, list]:
    """From the tip to the base: composite inertias and wrenches, projected on the joints."""
    n = len(motions)
    matrix, bias = [[None] * (i + 1) for i in range(n)], [None] * n
    inertia, wrench = None, None
    for i in reversed(range(n)):
        if inertias[i] is not None:
            first = inertia is None
            inertia = inertias[i] if first else inertia.plus(inertias[i])
            moment, force = wrenches[i]
            wrench = (moment, force) if first else (add(wrench[0], moment), add(wrench[1], force))
        axis, lever = motions[i]
        bias[i] = dot(axis, wrench[0]) + dot(lever, wrench[1])
        moment, force = inertia.times(axis, lever)
        for j in range(i + 1):
            matrix[i][j] = dot(motions[j][0], moment) + dot(motions[j][1], force)
    return matrix, bias


def solve(matrix: list[list[Scalar]], right: list[Scalar]) -> list[Scalar]:
    """Solution of a symmetric positive definite system given by its lower triangle."""
    n = len(right)
    scaled: list[list[Scalar]] = [[] for _ in range(n)]
    factor: list[list[Scalar]] = [[] for _ in range(n)]
    inverse: list[Scalar] = []
    for i in range(n):
        for j in range(i + 1):
            entry = matrix[i][j]
            for k in range(j):
                entry = entry - scaled[i][k] * factor[j][k]
            if j < i:
                scaled[i].append(entry)
                factor[i].append(entry * inverse[j])
            else:
                inverse.append(1.0 / entry)
    y: list[Scalar] = []
    for i in range(n):
        entry = right[i]
        for k in range(i):
            entry = entry - factor[i][k] * y[k]
        y.append(entry)
    out = [y[i] * inverse[i] for i in range(n)]
    for i in reversed(range(n)):
        for k in range(i + 1, n):
            out[i] = out[i] - factor[k][i] * out[k]
    return out


def derivative(
    model: Model, x: Vector, torque: Vector, tape: Tape, extras: Extras | None = None
) -> list[Scalar]:
    """``dx/dt`` for states ``x`` and motor torques ``torque`` [Nm]."""
    extras = extras or Extras()
    m, n = model.n_axes, model.n_joints
    phi, q, w, v = x[:m], x[m : m + n], x[m + n : 2 * m + n], x[2 * m + n : 2 * (m + n)]
    bristle = x[2 * (m + n) :]
    matrix, bias = rigid_body(model, q, v, tape)
    force = [-b for b in bias]
    for joint, stiffness, damping in model.elastic:
        force[joint] = force[joint] - (q[joint] * stiffness + v[joint] * damping)
    speed_up, bristle_rate = [], []
    for i, drive in enumerate(model.drives):
        delta = phi[i] * drive.ratio - q[drive.joint]
        rate = w[i] * drive.ratio - v[drive.joint]
        gear = delta * drive.stiffness + rate * drive.damping
        if extras.cubic_nm_rad3:
            gear = gear + delta * delta * delta * extras.cubic_nm_rad3
        force[drive.joint] = force[drive.joint] + gear
        net = torque[i] - w[i] * drive.viscous - gear * drive.ratio
        if extras.coulomb_nm:
            net = net - tape.call("tanh", w[i] / extras.smoothing_rad_s) * extras.coulomb_nm
        if extras.ripple_nm:
            net = net + tape.call("cos", phi[i] * extras.ripple_order) * extras.ripple_nm
        if extras.lugre is not None:
            friction, z_rate = lugre(extras.lugre, w[i], bristle[i], tape)
            net = net - friction
            bristle_rate.append(z_rate)
        speed_up.append(net / drive.inertia)
    return [*w, *v, *speed_up, *solve(matrix, force), *bristle_rate]


def lugre(p: Lugre, w: Scalar, z: Scalar, tape: Tape) -> tuple[Scalar, Scalar]:
    """Friction torque against the motion, and rate of the bristle deflection."""
    ratio = w / p.stribeck_speed_rad_s
    level = p.coulomb_nm + tape.call("exp", -(ratio * ratio)) * (p.static_nm - p.coulomb_nm)
    rate = w - tape.call("abs", w) * z * p.stiffness_nm_rad / level
    return z * p.stiffness_nm_rad + rate * p.damping_nm_s_rad, rate


def fresh(model: Model, extras: Extras | None = None) -> tuple[Tape, Vector, Vector]:
    """A tape with the states ``x[i]`` and torques ``u[i]`` as leaves."""
    tape = Tape()
    bristles = model.n_axes if extras is not None and extras.lugre is not None else 0
    count = 2 * (model.n_axes + model.n_joints) + bristles
    x = [tape.leaf(f"x[{i}]") for i in range(count)]
    return tape, x, [tape.leaf(f"u[{i}]") for i in range(model.n_axes)]


def equilibrium_state(rest: dict[str, np.ndarray], extras: Extras | None = None) -> np.ndarray:
    """State at rest from motor and joint angles; bristles relaxed."""
    count = len(rest["motor_angle"])
    angles = np.concatenate([rest["motor_angle"], rest["joint_angle"]])
    bristles = count if extras is not None and extras.lugre is not None else 0
    return np.concatenate([angles, np.zeros(len(angles) + bristles)])
