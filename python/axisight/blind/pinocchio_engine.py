"""Closed loops of a machine whose rigid bodies Pinocchio computes; all runs at once.

This module simulates motors, gears and formulas, in arrays over the runs, with Runge-Kutta steps of order
four.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from axisight.blind.controller import Controller
from axisight.blind.formulas import Formula, Lag, Place
from axisight.blind.machine import Machine
from axisight.errors import InputError, MissingExtraError
from axisight.robot.description import Joint

try:
    import pinocchio
except ImportError as error:
    raise MissingExtraError(
        "machines of a benchmark are simulated by Pinocchio: pip install 'axisight[blind]'"
    ) from error

Array = NDArray[np.float64]

# Time at rest under the controller before a log begins.
_SETTLING_S = 1.0
STEPS_PER_SAMPLE = 2
"""Runge-Kutta steps per sample."""


def run(
    machine: Machine, references: Sequence[Array], noises: Sequence[Array]
) -> list[tuple[Array, Array]]:
    """Return reported torque [Nm] and measured motor angle [rad] of each run, both (n, n_axes).

    ``references`` [rad/s] and ``noises`` [rad] are (n, n_axes). The noise is added to the angle that is
    logged and fed back. The machine stands still under its controller first. Raises InputError if the loop
    becomes unstable or if references differ in length.
    """
    if len({x.shape for x in (*references, *noises)}) != 1:
        raise InputError("references: expected runs of one length")
    loop = _Loop(machine, len(references))
    samples = round(_SETTLING_S / machine.robot.sample_time_s)
    still = np.zeros((samples, len(references), machine.robot.n_axes))
    loop.follow(still, still)
    loop.time_s = 0.0
    met = [machine.met(reference) for reference in references]
    torque, angle = loop.follow(np.stack(met, axis=1), np.stack(noises, axis=1))
    return [(torque[:, i].copy(), angle[:, i].copy()) for i in range(len(references))]


@dataclass
class _Chain:
    """Joints of the arm for Pinocchio, springs of the base first."""

    model: pinocchio.Model
    stiffness: list[float] = field(default_factory=list)
    damping: list[float] = field(default_factory=list)
    last: int = 0

    def add(self, name: str, axis: Array, origin: Array, *, slides: bool = False) -> None:
        """Add a joint without spring at the end."""
        kind = (
            pinocchio.JointModelPrismaticUnaligned
            if slides
            else pinocchio.JointModelRevoluteUnaligned
        )
        place = pinocchio.SE3(np.eye(3), np.asarray(origin, np.float64))
        joint = kind(np.asarray(axis, np.float64))
        self.last = self.model.addJoint(self.last, joint, place, name)
        self.stiffness.append(0.0)
        self.damping.append(0.0)

    def spring(self, stiffness: float, damping: float) -> None:
        """Give the last joint a spring."""
        self.stiffness[-1], self.damping[-1] = stiffness, damping

    def load(self, mass_kg: float, com_m: Array, inertia_kg_m2: Array) -> None:
        """Give the last joint a body; inertia xx, yy, zz, xy, xz, yz about its centre of mass."""
        xx, yy, zz, xy, xz, yz = inertia_kg_m2
        about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        body = pinocchio.Inertia(mass_kg, np.asarray(com_m, np.float64), about)
        self.model.appendBodyToJoint(self.last, body, pinocchio.SE3.Identity())


def _chain(machine: Machine) -> _Chain:
    robot, ends = machine.robot, machine.ends
    chain = _Chain(pinocchio.Model())
    chain.model.gravity.linear = machine.gravity_m_s2()
    for k, (axis, stiffness) in enumerate(ends.springs):
        chain.add(f"base{k}", np.array(axis), np.zeros(3))
        chain.spring(stiffness, stiffness * ends.rocks_s)
    for joint, origin in zip(robot.joints, machine.origins(), strict=True):
        _add(chain, joint, origin)
    if ends.tip_kg:
        chain.load(ends.tip_kg, np.array(ends.tip_m), np.array([1e-6] * 3 + [0.0] * 3))
    return chain


def _add(chain: _Chain, joint: Joint, origin: tuple[float, ...]) -> None:
    chain.add(joint.name, joint.axis, np.array(origin), slides=joint.prismatic)
    if joint.drive is None and joint.spring is not None:
        chain.spring(joint.spring.stiffness, joint.spring.damping)
    if joint.link is not None:
        chain.load(joint.link.mass_kg, joint.link.com_m, joint.link.inertia_kg_m2)


class _Loop:
    """The state of the closed loops of all runs."""

    def __init__(self, machine: Machine, runs: int) -> None:
        robot, own = machine.robot, machine.of_axes()
        if any(x.half_width_rad or x.friction_nm for x in own):
            raise InputError("native: expected play and dry friction as formulas of this engine")
        chain = _chain(machine)
        self.model, self.data = chain.model, chain.model.createData()
        self.springs, self.dampers = np.array(chain.stiffness), np.array(chain.damping)
        self.joints = np.array(robot.axis_joints) + len(machine.ends.springs)
        driven = [robot.joints[place] for place in robot.axis_joints]
        self.ratio = np.asarray(robot.gear_ratio, np.float64)
        gears = [(j.spring, j.drive, x) for j, x in zip(driven, own, strict=True)]
        if any(s is None for s, _, _ in gears):
            raise InputError("joint: expected an elastic gear on every axis")
        self.stiffness = np.array([s.stiffness * (1 + x.spring) for s, _, x in gears if s])
        self.damping = np.array([s.damping * (1 + x.damper) for s, _, x in gears if s])
        self.inertia = np.array([d.motor_inertia * (1 + x.armature) for _, d, x in gears if d])
        self.viscous = np.array([d.viscous_friction * (1 + x.viscous) for _, d, x in gears if d])
        self.gain = np.array([1 + x.gear for x in own])
        # A pool evaluates all runs in one call.
        self.pool = pinocchio.ModelPool(self.model, 1)
        self.zero = np.zeros(self.model.nq)
        self.zero[self.joints] = [x.zero_rad for x in own]
        self.sample_s = robot.sample_time_s
        self.step_s = self.sample_s / STEPS_PER_SAMPLE
        self.time_s = 0.0
        lags = [(axis, Lag(x.lag_s)) for axis, x in enumerate(own) if x.lag_s]
        self.formulas: list[tuple[int, Formula]] = [*machine.laws_of(Formula), *lags]
        joint, weight = self._balanced(np.asarray(robot.operating_point, np.float64))
        self.along = machine.along()
        turned = joint[self.joints] + weight[self.joints] / self.stiffness
        motor = np.linalg.solve(self.along, turned)
        # Angles of motors and joints, then their speeds: (n_runs, 2 (n_axes + n_joints)).
        self.moving = len(motor) + len(joint)
        rest = np.concatenate((motor, joint, np.zeros(self.moving)))
        self.state = np.tile(rest, (runs, 1))
        holding = np.tile(weight[self.joints] @ self.along, (runs, 1))
        self.controller = Controller(machine, self.state[:, : len(motor)].copy(), holding)
        for _, formula, at in self._places(self.state, self.time_s):
            formula.begin(at, self.step_s)

    def _balanced(self, at: Array) -> tuple[Array, Array]:
        """Return the joint angles at rest for given driven joints, and the torques that hold them."""
        joint = np.zeros(self.model.nq)
        joint[self.joints] = at
        free = self.springs > 0
        weight = np.zeros_like(joint)
        for _ in range(20):
            weight = pinocchio.computeGeneralizedGravity(self.model, self.data, joint + self.zero)
            joint[free] = -weight[free] / self.springs[free]
        return joint, np.asarray(weight).copy()

    def follow(self, reference: Array, noise: Array) -> tuple[Array, Array]:
        """Return reported torques and measured angles along references, (n, n_runs, n_axes)."""
        torque, angle = np.empty_like(reference), np.empty_like(reference)
        for k, wanted in enumerate(reference):
            motor, joint, _, _ = self._parts(self.state)
            measured = motor + noise[k]
            for axis, formula in self.formulas:
                measured[:, axis] += formula.sensor(motor[:, axis])
                at_joint = formula.joint_sensor(joint[:, self.joints[axis]])
                measured[:, axis] += at_joint / self.ratio[axis]
                measured[:, axis] = formula.read(measured[:, axis])
            command = self.controller.command(measured, wanted)
            angle[k], torque[k] = measured, command
            for axis, formula in self.formulas:
                torque[k, :, axis] = formula.reported(torque[k, :, axis])
            for _ in range(STEPS_PER_SAMPLE):
                self._step(command)
        if not np.isfinite(angle).all() or np.abs(angle).max() > 1e5:
            raise InputError("machine: unstable")
        return torque, angle

    def _step(self, command: Array) -> None:
        """Take one Runge-Kutta step of order four with the drives' mean torque."""
        drive = command.copy()
        for axis, formula in self.formulas:
            # A copy, because a drive may keep the array.
            drive[:, axis] = formula.command(drive[:, axis].copy())
        drive *= self.gain
        h, t, state = self.step_s, self.time_s, self.state
        first = self._rates(state, drive, t)
        second = self._rates(state + h / 2 * first, drive, t + h / 2)
        third = self._rates(state + h / 2 * second, drive, t + h / 2)
        fourth = self._rates(state + h * third, drive, t + h)
        self.state = state + h / 6 * (first + fourth + 2 * (second + third))
        self.time_s = t + h
        for _, formula, at in self._places(self.state, self.time_s):
            formula.moved(at)

    def _parts(self, state: Array) -> tuple[Array, Array, Array, Array]:
        """Return views of the angles of motors and joints, and of their speeds."""
        n, half = len(self.ratio), self.moving
        return state[:, :n], state[:, n:half], state[:, half : half + n], state[:, half + n :]

    def _places(self, state: Array, time_s: float) -> Iterator[tuple[int, Formula, Place]]:
        """Yield every formula with its axis and the axis's state."""
        motor, joint, motor_speed, joint_speed = self._parts(state)
        for axis, formula in self.formulas:
            ratio, k = float(self.ratio[axis]), self.joints[axis]
            phi, speed = motor[:, axis], motor_speed[:, axis]
            deflection, rate = ratio * phi - joint[:, k], ratio * speed - joint_speed[:, k]
            gear = float(self.stiffness[axis]), float(self.damping[axis])
            yield axis, formula, Place(time_s, phi, speed, deflection, rate, ratio, *gear)

    def _rates(self, state: Array, drive: Array, time_s: float) -> Array:
        """Return the time derivative of a state under drive torques."""
        motor, joint, motor_speed, joint_speed = self._parts(state)
        deflection = motor @ self.along.T - joint[:, self.joints]
        rate = motor_speed @ self.along.T - joint_speed[:, self.joints]
        gear = self.stiffness * deflection + self.damping * rate
        on_motor = drive - self.viscous * motor_speed - gear @ self.along
        on_joint = -self.springs * joint - self.dampers * joint_speed
        on_joint[:, self.joints] += gear
        if self.formulas:
            for axis, formula, at in self._places(state, time_s):
                more, joint_more = formula.torque(at)
                on_motor[:, axis] += more
                on_joint[:, self.joints[axis]] += joint_more
        rates = np.empty_like(state)
        rates[:, : self.moving] = state[:, self.moving :]
        _, _, motor_rate, joint_rate = self._parts(rates)
        motor_rate[:] = on_motor / self.inertia
        turned, speed = joint + self.zero, np.ascontiguousarray(joint_speed)
        # Pinocchio takes one column per run.
        solved = np.empty_like(turned)
        pinocchio.abaInParallel(1, self.pool, turned.T, speed.T, on_joint.T, solved.T)
        joint_rate[:] = solved
        return rates
