"""Everything at once by `mujoco.sysid`: the second baseline of the public test of diagnosis.

The arm becomes a rigid MuJoCo model. All parameters that MuJoCo has for it, a gain, an offset and a delay of each
torque, and the tilt of the base are fitted at once to the torques along the measured motion (inverse dynamics, below
`CUTOFF_HZ`, where gears are stiff). A wide prior about the simulator holds what the motion does not show. The entry
names what moved most, in standard errors.
Needs `pip install 'mujoco[sysid]'`.
"""

from __future__ import annotations

import contextlib
import io
import logging
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from mujoco import sysid
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from axisight.logs import Case, Log
from axisight.robot import Robot, load_robot
from axisight.robot.description import Joint

Array = NDArray[np.float64]
Setting = Callable[[mujoco.MjSpec, float], None]

CUTOFF_HZ = 4.0
"""Torques are compared below this frequency."""
RATE_HZ = 100.0
"""The model is evaluated at this rate, so that friction keeps its reversals."""
MOVED = 3.0
"""Standard errors from which a parameter counts as moved."""
ITERATIONS = 30
ERROR = 0.02
"""Expected error of the torque, relative to its standard deviation: it weighs the data against the prior."""
WIDEST = 10.0
"""Bound of a parameter, in standard deviations of its prior."""


@dataclass(frozen=True)
class Free:
    """A parameter: the effect it stands for, its nominal value, and the standard deviation of its prior.

    ``change`` sets it in the model; None for parameters of the torque. ``positive``: it cannot change sign.
    """

    effect: str
    axis: int | None
    nominal: float
    usual: float
    change: Setting | None = None
    positive: bool = False

    @property
    def least(self) -> float:
        """Smallest value, in standard deviations from the nominal one."""
        return -min(WIDEST, 0.95 * self.nominal / self.usual) if self.positive else -WIDEST


def entry(case: Case) -> dict[str, Any]:
    """Return the entry of a case, without its schema and time."""
    moved = moves(case)
    first = max(moved, key=lambda one: one[1])
    if first[1] < MOVED:
        return {"verdict": "none"}
    return {
        "verdict": "explained",
        "causes": [{"effect": first[0].effect, "axis": first[0].axis}],
    }


def moves(case: Case) -> list[tuple[Free, float]]:
    """Return every parameter with how far the fit moved it, in standard errors."""
    logging.getLogger("absl").setLevel(logging.ERROR)
    robot = load_robot(case.robot_path)
    spec, free = spec_of(robot), list(_free(robot))
    logs = [_Motion.of(log, robot) for log in case.estimation]
    # Parameters are changes in standard deviations of their priors, so that all have the same scale.
    params = sysid.ParameterDict(
        {f"{i}": sysid.Parameter(f"{i}", 0.0, f.least, WIDEST) for i, f in enumerate(free)}
    )

    def residuals(x: Array, _params: sysid.ParameterDict) -> tuple[list[Array], None, None]:
        values = [f.nominal + f.usual * change for f, change in zip(free, np.ravel(x), strict=True)]
        rows = [row / ERROR for log in logs for row in log.residual(spec, free, values)]
        return [*rows, np.ravel(x)], None, None

    # The optimizer prints a line per iteration.
    with contextlib.redirect_stdout(io.StringIO()):
        best, found = sysid.optimize(
            params, residuals, optimizer="scipy", verbose=False, max_iters=ITERATIONS
        )
    left, _, _ = residuals(best.as_vector(), best)
    covariance, _ = sysid.calculate_intervals(left, np.asarray(found.jac))
    moved = np.abs(best.as_vector()) / np.sqrt(np.diag(covariance))
    return list(zip(free, moved.tolist(), strict=True))


def spec_of(robot: Robot) -> mujoco.MjSpec:
    """Return the arm with rigid gears as a MuJoCo model; joints without a motor stand still."""
    spec = mujoco.MjSpec()
    spec.option.gravity = robot.gravity_m_s2
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    spec.compiler.balanceinertia = True
    body = spec.worldbody
    for joint in robot.joints:
        body = body.add_body(name=joint.name, pos=joint.origin_m)
        if joint.link is not None:
            body.mass, body.ipos = joint.link.mass_kg, joint.link.com_m
            body.fullinertia, body.explicitinertial = joint.link.inertia_kg_m2, True
        if joint.drive is not None:
            _add_joint(body, joint)
    return spec


def _add_joint(body: mujoco.MjsBody, joint: Joint) -> None:
    drive = joint.drive
    assert drive is not None
    kind = mujoco.mjtJoint.mjJNT_SLIDE if joint.prismatic else mujoco.mjtJoint.mjJNT_HINGE
    made = body.add_joint(name=joint.name, type=kind, axis=joint.axis)
    made.armature = drive.motor_inertia / drive.gear_ratio**2
    made.damping = _linear(drive.viscous_friction / drive.gear_ratio**2)


def _free(robot: Robot) -> Iterator[Free]:
    """Yield everything that is fitted: of motors and gears, of links, of the base."""
    driven = [j for j in robot.joints if j.drive is not None]
    for axis, joint in enumerate(driven, start=1):
        yield from _of_drive(axis, joint)
    axis = 0
    for joint in robot.joints:
        axis += joint.drive is not None
        if joint.link is not None:
            yield from _of_link(axis, joint, last=joint is robot.joints[-1])
    for i in range(2):
        yield Free("base_tilt", None, 0.0, 0.03, _tilt(robot, i))


def _of_drive(axis: int, joint: Joint) -> Iterator[Free]:
    drive, name = joint.drive, joint.name
    assert drive is not None
    armature = drive.motor_inertia / drive.gear_ratio**2
    damping = drive.viscous_friction / drive.gear_ratio**2
    yield Free("motor_inertia", axis, armature, 0.2 * armature, _armature(name), positive=True)
    yield Free("viscous_friction", axis, damping, damping, _damping(name), positive=True)
    # Torques are in standard deviations of the torque of their axis.
    yield Free("coulomb_friction", axis, 0.0, 0.2)
    yield Free("cable_stiffness", axis, 0.0, 0.2)
    yield Free("torque_offset", axis, 0.0, 0.2)
    yield Free("torque_constant", axis, 0.0, 0.1)
    yield Free("input_delay", axis, 0.0, 0.005)
    if not joint.prismatic:
        yield Free("joint_zero_offset", axis, 0.0, 0.03)


def _of_link(axis: int, joint: Joint, *, last: bool) -> Iterator[Free]:
    """Yield mass, inertia and centre of mass; the mass of the last link is read as a payload."""
    effect = ("payload", None) if last else ("link_mass", axis)
    yield Free(*effect, 1.0, 0.2, _mass(joint), positive=True)
    yield Free("link_inertia", axis, 1.0, 0.2, _inertia(joint), positive=True)
    for i in range(3):
        yield Free("link_com", axis, 0.0, 0.05, _com(joint, i))


def _linear(damping: float) -> Array:
    """Return the coefficients of MuJoCo's damping polynomial."""
    return np.array([damping, 0.0, 0.0])


def _armature(name: str) -> Setting:
    def change(spec: mujoco.MjSpec, value: float) -> None:
        spec.joint(name).armature = value

    return change


def _damping(name: str) -> Setting:
    def change(spec: mujoco.MjSpec, value: float) -> None:
        spec.joint(name).damping = _linear(value)

    return change


def _mass(joint: Joint) -> Setting:
    def change(spec: mujoco.MjSpec, value: float) -> None:
        assert joint.link is not None
        spec.body(joint.name).mass = joint.link.mass_kg * value

    return change


def _inertia(joint: Joint) -> Setting:
    def change(spec: mujoco.MjSpec, value: float) -> None:
        assert joint.link is not None
        spec.body(joint.name).fullinertia = joint.link.inertia_kg_m2 * value

    return change


def _com(joint: Joint, i: int) -> Setting:
    def change(spec: mujoco.MjSpec, value: float) -> None:
        assert joint.link is not None
        # One parameter for each direction: only its own is set.
        ipos = np.array(spec.body(joint.name).ipos)
        ipos[i] = joint.link.com_m[i] + value
        spec.body(joint.name).ipos = ipos

    return change


def _tilt(robot: Robot, i: int) -> Setting:
    def change(spec: mujoco.MjSpec, value: float) -> None:
        gravity = np.array(spec.option.gravity)
        gravity[i] = robot.gravity_m_s2[i] + value * np.linalg.norm(robot.gravity_m_s2)
        spec.option.gravity = gravity

    return change


@dataclass(frozen=True)
class _Motion:
    """Joint motion and joint torque of one log at `RATE_HZ`, (n, n_axes) each, and the scale of each torque."""

    position: Array
    velocity: Array
    acceleration: Array
    torque: Array
    scale: Array

    @classmethod
    def of(cls, log: Log, robot: Robot) -> _Motion:
        drives = [j.drive for j in robot.joints if j.drive is not None]
        turn = np.array([drive.gear_ratio for drive in drives])
        dt = log.sample_time_s
        # Slow enough for two derivatives of a noisy angle, fast enough for what is compared.
        smooth = _lowpassed(log.position_rad * turn, 5 * CUTOFF_HZ, dt)
        velocity = np.gradient(smooth, dt, axis=0)
        acceleration = np.gradient(velocity, dt, axis=0)
        torque = _lowpassed(log.torque_nm / turn, 5 * CUTOFF_HZ, dt)
        step = max(1, round(1 / (RATE_HZ * dt)))
        return cls(
            *(x[::step] for x in (smooth, velocity, acceleration, torque)),
            np.maximum(torque.std(axis=0), 1e-12),
        )

    def residual(self, spec: mujoco.MjSpec, free: list[Free], x: Sequence[float]) -> list[Array]:
        """Return modelled minus measured torque over its deviation, compared below `CUTOFF_HZ`, by axis."""
        of = {(f.effect, f.axis): v for f, v in zip(free, x, strict=True) if f.change is None}
        changed = spec.copy()
        for f, value in zip(free, x, strict=True):
            if f.change is not None:
                f.change(changed, float(value))
        axes = range(1, self.torque.shape[1] + 1)

        def by_axis(effect: str) -> Array:
            return np.array([of.get((effect, a), 0.0) for a in axes])

        torque = _inverse(changed.compile(), self, by_axis("joint_zero_offset"))
        reference = np.maximum(0.05 * np.abs(self.velocity).max(axis=0), 1e-9)
        torque += self.scale * by_axis("coulomb_friction") * np.tanh(self.velocity / reference)
        angle = self.position / np.maximum(np.abs(self.position).max(axis=0), 1e-9)
        torque += self.scale * by_axis("cable_stiffness") * angle
        # The command is ahead of the torque that acts.
        torque += by_axis("input_delay") * np.gradient(torque, 1 / RATE_HZ, axis=0)
        torque = torque / (1 + by_axis("torque_constant")) + self.scale * by_axis("torque_offset")
        off = _lowpassed((torque - self.torque) / self.scale, CUTOFF_HZ, 1 / RATE_HZ)
        # About two samples per period of the cutoff, so that they are nearly independent.
        step = round(RATE_HZ / (2 * CUTOFF_HZ))
        return list(off[step:-step:step].T)


def _inverse(model: mujoco.MjModel, motion: _Motion, zero: Array) -> Array:
    """Return the joint torques (n, n_axes) of a model along a motion."""
    data, out = mujoco.MjData(model), np.empty_like(motion.torque)
    for k in range(len(out)):
        data.qpos[:] = motion.position[k] + zero
        data.qvel[:] = motion.velocity[k]
        data.qacc[:] = motion.acceleration[k]
        mujoco.mj_inverse(model, data)
        out[k] = data.qfrc_inverse
    return out


def _lowpassed(x: Array, cutoff_hz: float, dt: float) -> Array:
    return np.asarray(sosfiltfilt(butter(4, cutoff_hz, fs=1 / dt, output="sos"), x, axis=0))
