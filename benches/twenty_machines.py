"""Models of public robots in MuJoCo, and machines that have one effect more than their model.

`Arm` is one chain of a model file: shapes are dropped, other joints are locked at zero, contacts are off. `Machine`
adds one withheld effect to it, by MuJoCo's own numbers or by a torque of its own law. `run` moves either along a
reference under a computed-torque controller that knows the nominal model.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from axisight.logs import lowpass

Array = NDArray[np.float64]

STEP_S, PER_SAMPLE, DURATION_S = 0.0005, 20, 8.0
RUNS = 3
# Closed loop of the controller: two poles at this rate [rad/s].
_POLE = 20.0
# Noise: of the torque by its standard deviation, of positions [rad, m].
TORQUE_NOISE, POSITION_NOISE = 0.01, 1e-5
# Shares of the standard deviation of the torque of an axis that a withheld effect takes.
SHARE = 0.4
_SHAPES = {"urdf": ("visual", "collision"), "xml": ("geom", "mesh", "texture", "material", "light")}
# Corner of dry friction x / hypot(x, corner) [rad/s, m/s].
CORNER = 0.01
_MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_EXTRAS = ("sensor", "keyframe", "contact", "visual", "asset")


def without_shapes(source: Path, target: Path) -> None:
    """Copy a URDF or MJCF without its shapes, so that no mesh is needed; bodies keep their stated masses."""
    root = ET.parse(source).getroot()
    kind = "urdf" if root.tag == "robot" else "xml"
    for parent in list(root.iter()):
        for child in list(parent):
            top = parent is root and root.tag == "mujoco" and child.tag in _EXTRAS
            if top or child.tag in _SHAPES[kind]:
                parent.remove(child)
    target.parent.mkdir(parents=True, exist_ok=True)
    ET.ElementTree(root).write(target, encoding="unicode")


def _for_mujoco(path: Path) -> str:
    """Return a model as text that MuJoCo compiles; a URDF keeps its fixed joints and gets its masses as stated."""
    root = ET.parse(path).getroot()
    if root.tag == "robot":
        for inertia in root.iter("inertia"):
            _make_positive(inertia)
        extension = ET.SubElement(root, "mujoco")
        options = {"balanceinertia": "true", "fusestatic": "false", "strippath": "true"}
        ET.SubElement(extension, "compiler", options)
    return ET.tostring(root, encoding="unicode")


def _make_positive(inertia: ET.Element) -> None:
    """Raise moments of inertia below zero, which rounding makes and MuJoCo refuses."""
    xx, xy, xz, yy, yz, zz = (float(inertia.get(key, 0.0)) for key in _MOMENTS)
    moments, axes = np.linalg.eigh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    if moments[0] > 0.0:
        return
    whole = axes * np.maximum(moments, 1e-9) @ axes.T
    for key, (i, j) in zip(_MOMENTS, ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)), strict=True):
        inertia.set(key, repr(float(whole[i, j])))


class Arm:
    """One chain of a model file in MuJoCo.

    ``joints``: names of its joints from the base. Torques act through the motor of a joint where the file has one,
    else on the joint itself; gears are one in both cases.
    """

    def __init__(self, path: Path, joints: Sequence[str]) -> None:
        self.path, self.joints = path, list(joints)
        spec = mujoco.MjSpec.from_string(_for_mujoco(path))
        kept = set(joints)
        for kind in (spec.sensors, spec.keys, spec.equalities, spec.tendons):
            for element in list(kind):
                spec.delete(element)
        for actuator in list(spec.actuators):
            if actuator.target not in kept:
                spec.delete(actuator)
        for joint in list(spec.joints):
            if joint.name not in kept:
                spec.delete(joint)
        spec.option.timestep = STEP_S
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
        self.model = spec.compile()
        self.dry = self.model.dof_frictionloss.copy()
        self.model.dof_frictionloss[:] = 0.0
        found = [self.model.joint(j).name for j in range(self.model.njnt)]
        if sorted(found) != sorted(joints):
            raise ValueError(f"{path}: joints: expected {list(joints)}, got {found}")
        self.order = np.array([self.model.joint(name).dofadr[0] for name in joints])
        self.bodies = np.array([self.model.joint(name).bodyid[0] for name in joints])
        self.motors = self._motors(joints)

    def _motors(self, joints: Sequence[str]) -> Array | None:
        """Return the first actuator of each joint, None without."""
        first: dict[str, int] = {}
        for a in range(self.model.nu):
            joint = self.model.joint(self.model.actuator_trnid[a, 0]).name
            first.setdefault(joint, a)
        return np.array([first[name] for name in joints]) if first else None

    def push(self, data: mujoco.MjData, torque: Array, beside: Array) -> None:
        """Set the commanded torques and those beside the motors [Nm], in the order of the chain."""
        data.qfrc_applied[self.order] = beside
        if self.motors is None:
            data.qfrc_applied[self.order] += torque
        else:
            data.ctrl[self.motors] = torque

    def rub(self, model: mujoco.MjModel, speed: Array) -> Array:
        """Give a copy of the model half of its friction as damping; return the other half as torques [Nm], (nv,).

        MuJoCo's own dry friction is a soft constraint: it acts ahead of the speed and creeps at rest. Its damping acts
        at the speed after the step, which looks like a rotor of half the step times the damping. Half of both before
        and half after the step is the midpoint rule: it has no such rotor, and light joints stay stable.
        """
        half = 0.5 * (self.model.dof_damping + self.dry / np.hypot(speed, CORNER))
        model.dof_damping[:] = half
        return np.asarray(-half * speed)

    def middle_and_reach(self) -> tuple[Array, Array]:
        """Return the middle and half the travel of a motion of each joint [rad, m], within its range."""
        middle, reach = np.zeros(len(self.order)), np.full(len(self.order), 0.7)
        for k, dof in enumerate(self.order):
            joint = self.model.dof_jntid[dof]
            if self.model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE:
                reach[k] = 0.1
            if self.model.jnt_limited[joint]:
                low, high = self.model.jnt_range[joint]
                reach[k] = min(reach[k], 0.45 * (high - low))
                middle[k] = float(np.clip(0.0, low + reach[k], high - reach[k]))
        return middle, reach


@dataclass(frozen=True)
class Reference:
    """Sums of two sines that start from rest, of one run of an arm."""

    middle: Array
    reach: Array
    run: int

    def __call__(self, t: float) -> tuple[Array, Array, Array]:
        """Return position, speed and acceleration at a time, (n,) each."""
        axis = np.arange(len(self.middle))
        q, v, a = self.middle.copy(), np.zeros(len(axis)), np.zeros(len(axis))
        x = min(t / 2.0, 1.0)
        # Smoothstep of fifth order and its derivatives.
        s, ds, dds = x**3 * (10 - 15 * x + 6 * x * x), 0.0, 0.0
        if x < 1.0:
            ds = 30 * x * x * (1 - x) ** 2 / 2.0
            dds = 60 * x * (1 - x) * (1 - 2 * x) / 4.0
        for size, rate, phase in (
            (0.6, 1.1 + 0.25 * self.run, 0.3),
            (0.35, 3.1 + 0.4 * self.run, 1.0),
        ):
            w = rate * (1.0 + 0.07 * axis)
            at = w * t + phase + 1.3 * axis + self.run
            sine, cosine = np.sin(at), np.cos(at)
            q += self.reach * size * s * sine
            v += self.reach * size * (ds * sine + s * w * cosine)
            a += self.reach * size * (dds * sine + 2 * ds * w * cosine - s * w * w * sine)
        return q, v, a


@dataclass(frozen=True)
class Machine:
    """What a machine has that its model lacks: an effect of the library, its axis (from 0), its size."""

    effect: str
    axis: int
    size: float

    @property
    def label(self) -> str:
        """Effect and axis as in a verdict."""
        return self.effect if self.effect == "payload" else f"{self.effect}@{self.axis + 1}"

    def change(self, arm: Arm) -> None:
        """Put what MuJoCo has a number for into the compiled model."""
        model, dof, body = arm.model, arm.order[self.axis], arm.bodies[self.axis]
        joint = model.dof_jntid[dof]
        if self.effect == "viscous_friction":
            model.dof_damping[dof] += self.size
        elif self.effect == "rotor_inertia":
            model.dof_armature[dof] += self.size
        elif self.effect == "cable_stiffness":
            model.jnt_stiffness[joint] += self.size
            model.qpos_spring[model.jnt_qposadr[joint]] = 0.0
        elif self.effect == "link_mass":
            factor = 1.0 + self.size / model.body_mass[body]
            model.body_mass[body] *= factor
        elif self.effect == "link_com":
            model.body_ipos[body] += self.size * np.array([0.8, 0.5, 0.3])
        elif self.effect == "payload":
            model.body_mass[arm.bodies[-1]] += self.size
        mujoco.mj_setConst(model, mujoco.MjData(model))

    def torque(self, axis_q: float, axis_v: float) -> float:
        """Return the torque beside the motor of the axis [Nm]."""
        if self.effect == "coulomb_friction":
            return -self.size * axis_v / float(np.hypot(axis_v, CORNER))
        if self.effect == "stribeck_friction":
            level = 0.5 + 0.5 / (1.0 + (axis_v / 0.15) ** 2)
            return -self.size * level * axis_v / float(np.hypot(axis_v, CORNER))
        if self.effect == "torque_ripple":
            return self.size * float(np.sin(12.0 * axis_q + 0.7))
        if self.effect == "torque_offset":
            return self.size
        return 0.0

    def gain(self) -> float:
        """Return by how much the motor multiplies its command."""
        return self.size if self.effect == "torque_constant" else 1.0

    def zero(self) -> float:
        """Return the error of the measured position of the axis [rad]."""
        return self.size if self.effect == "joint_zero_offset" else 0.0


NOTHING = Machine("none", 0, 0.0)


def run(arm: Arm, nominal: Arm, run_: int, machine: Machine = NOTHING) -> tuple[Array, Array]:
    """Return measured positions and commanded torques (n, n_axes) of an arm along the references of a run."""
    reference = Reference(*nominal.middle_and_reach(), run_)
    model = copy(arm.model)
    data, known = mujoco.MjData(model), mujoco.MjData(nominal.model)
    where, there, axis = arm.order, nominal.order, machine.axis
    zero, gain = np.zeros(len(where)), np.ones(len(where))
    zero[axis], gain[axis] = machine.zero(), machine.gain()
    data.qpos[where] = reference(0.0)[0] - zero
    positions, torques = [], []
    for k in range(round(DURATION_S / STEP_S)):
        q, v = data.qpos[where] + zero, data.qvel[where].copy()
        wanted, speed, acceleration = reference(k * STEP_S)
        # At the speed that is asked for: damping that is cancelled at the measured one may become unstable.
        known.qpos[there], known.qvel[there] = q, speed
        known.qacc[there] = acceleration + 2 * _POLE * (speed - v) + _POLE**2 * (wanted - q)
        torque = np.zeros(nominal.model.nv)
        mujoco.mj_fwdPosition(nominal.model, known)
        mujoco.mj_fwdVelocity(nominal.model, known)
        mujoco.mj_mulM(nominal.model, known, torque, known.qacc)
        torque = (torque + known.qfrc_bias - known.qfrc_passive)[there]
        beside = (gain - 1.0) * torque
        beside[axis] += machine.torque(float(q[axis]), float(v[axis]))
        if k % PER_SAMPLE == 0:
            positions.append(q)
            torques.append(torque)
        arm.push(data, torque, beside + arm.rub(model, data.qvel)[where])
        mujoco.mj_step(model, data)
    return np.array(positions), np.array(torques)


def sized(effect: str, axis: int, nominal: Arm, motion: tuple[Array, Array]) -> Machine:
    """Return a machine with an effect whose torque takes `SHARE` of that of its axis.

    ``motion``: positions and torques of a run of the nominal model.
    """
    q, torque = motion
    dt = STEP_S * PER_SAMPLE
    v = np.gradient(q, dt, axis=0)
    a = np.gradient(v, dt, axis=0)
    spread = SHARE * torque[:, axis].std()
    moved = float(nominal.model.body_subtreemass[nominal.bodies[axis]])
    size = {
        "coulomb_friction": spread,
        "stribeck_friction": 1.5 * spread,
        "torque_offset": spread,
        "torque_ripple": 1.4 * spread,
        "viscous_friction": spread / v[:, axis].std(),
        "rotor_inertia": spread / a[:, axis].std(),
        "cable_stiffness": spread / q[:, axis].std(),
        "torque_constant": 1.0 - SHARE / 2,
        "link_mass": SHARE * moved,
        "payload": SHARE * float(nominal.model.body_subtreemass[nominal.bodies[0]]) / 4,
        "link_com": 0.06,
        "joint_zero_offset": 0.05,
    }[effect]
    return Machine(effect, axis, float(size))


def noisy(position: Array, torque: Array, seed: Sequence[int]) -> tuple[Array, Array]:
    """Return positions and torques with the noise of sensors."""
    random = np.random.default_rng(seed)
    spread = np.maximum(torque.std(axis=0), 1e-9)
    return (
        position + POSITION_NOISE * random.normal(size=position.shape),
        torque + TORQUE_NOISE * spread * random.normal(size=torque.shape),
    )


def gap(torque: Array, measured: Array, sample_time_s: float, cutoff_hz: float) -> float:
    """Return the rms difference of torques relative to the measured spread [1], over all axes below a frequency."""
    off = lowpass(np.ascontiguousarray(torque - measured), sample_time_s, cutoff_hz)
    return float(np.sqrt((off**2 / np.var(measured, axis=0)).mean()))
