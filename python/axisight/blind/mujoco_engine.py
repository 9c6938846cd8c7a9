"""Closed loops of a machine in MuJoCo, with MuJoCo's own integrator and constraint solver."""

from __future__ import annotations

import copy
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.blind.arm_mjcf import STEPS_PER_SAMPLE, mjcf
from axisight.blind.controller import Controller
from axisight.blind.laws import Axis, Law
from axisight.blind.machine import Machine
from axisight.errors import InputError, MissingExtraError

try:
    import mujoco
except ImportError as error:
    raise MissingExtraError(
        "machines of a benchmark are simulated by MuJoCo: pip install 'axisight[blind]'"
    ) from error

Array = NDArray[np.float64]

# Time at rest under the controller before a log begins.
_SETTLING_S = 4.0


def run(
    machine: Machine, references: Sequence[Array], noises: Sequence[Array]
) -> list[tuple[Array, Array]]:
    """Return reported torque [Nm] and measured motor angle [rad] of each run, both (n, n_axes).

    ``references`` [rad/s] and ``noises`` [rad] are (n, n_axes). The noise is added to the angle that is
    logged and fed back. The machine stands still under its controller first. Raises InputError if the loop
    becomes unstable.
    """
    loop = _Loop(machine)
    loop.settle()
    logs = []
    for reference, noise in zip(references, noises, strict=True):
        loop.begin_log()
        logs.append(loop.follow(machine.met(reference), noise))
    return logs


class _Loop:
    """The state of one closed loop."""

    def __init__(self, machine: Machine) -> None:
        robot = machine.robot
        self.n = robot.n_axes
        self.sample_s = robot.sample_time_s
        self.step_s = self.sample_s / STEPS_PER_SAMPLE
        text = mjcf(machine, self.step_s)
        self.model = mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(self.model)
        self.joints = np.array(robot.axis_joints) + self.n + len(machine.ends.springs)
        self.ratio = np.asarray(robot.gear_ratio, np.float64)
        names = [robot.joint_names[place] for place in robot.axis_joints]
        ids = [
            mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_TENDON, f"{x}_gear") for x in names
        ]
        self.stiffness = self.model.tendon_stiffness[ids].reshape(len(ids), -1)[:, 0].copy()
        self.laws = machine.laws_of(Law)
        for _, law in self.laws:
            law.begin(self.step_s)
        self.data.qpos[self.joints] = robot.operating_point
        weight = self._weight()
        # The gears deflect under weight; the motors turn until the joints stand at the operating point.
        deflection = weight / self.stiffness
        along = machine.along()
        self.data.qpos[: self.n] = np.linalg.solve(along, robot.operating_point + deflection)
        angle = self.data.qpos[: self.n].copy()
        self.controller = Controller(machine, angle, weight @ along)
        self.time_s = 0.0
        # Views, because the engine overwrites these arrays in place.
        data = self.data
        self.command, self.applied = data.ctrl, data.qfrc_applied
        self.angle, self.speed = data.qpos, data.qvel

    def _weight(self) -> Array:
        """Return the torques that hold the joints in their pose."""
        mujoco.mj_forward(self.model, self.data)
        return np.asarray(self.data.qfrc_bias[self.joints])

    def settle(self) -> None:
        """Stand still under the controller until nothing moves; logs start from this state."""
        still = np.zeros((round(_SETTLING_S / self.sample_s), self.n))
        self.follow(still, still)
        self.rest = copy.copy(self.data), copy.deepcopy((self.laws, self.controller))

    def begin_log(self) -> None:
        """Return to the settled state and set the time to zero."""
        data, memories = self.rest
        mujoco.mj_copyData(self.data, self.model, data)
        self.laws, self.controller = copy.deepcopy(memories)
        self.time_s = 0.0

    def follow(self, reference: Array, noise: Array) -> tuple[Array, Array]:
        """Return reported torque [Nm] and measured angle [rad]; raises InputError if unstable."""
        torque, angle = np.empty_like(reference), np.empty_like(reference)
        for k, wanted in enumerate(reference):
            measured = self.angle[: self.n] + noise[k]
            for axis, law in self.laws:
                measured[axis] += law.sensor(float(self.angle[axis]))
                joint = float(self.angle[self.joints[axis]])
                measured[axis] += law.joint_sensor(joint) / self.ratio[axis]
                measured[axis] = law.read(float(measured[axis]))
            command = self.controller.command(measured, wanted)
            angle[k] = measured
            torque[k] = command
            for axis, law in self.laws:
                torque[k, axis] = law.reported(float(torque[k, axis]))
            self._step(command)
        if not np.isfinite(angle).all() or np.abs(angle).max() > 1e5:
            raise InputError("machine: unstable")
        return torque, angle

    def _step(self, command: Array) -> None:
        if not self.laws:
            self.command[:] = command
            mujoco.mj_step(self.model, self.data, STEPS_PER_SAMPLE)
            return
        for _ in range(STEPS_PER_SAMPLE):
            self.command[:] = command
            self.applied[:] = 0.0
            for axis, law in self.laws:
                self.command[axis] = law.command(float(self.command[axis]))
                motor, joint = law.torque(self._at(axis))
                self.applied[axis] += motor
                self.applied[self.joints[axis]] += joint
            mujoco.mj_step(self.model, self.data)
            self.time_s += self.step_s

    def _at(self, axis: int) -> Axis:
        joint = self.joints[axis]
        motor, q = float(self.angle[axis]), float(self.angle[joint])
        ratio = float(self.ratio[axis])
        return Axis(
            self.time_s,
            motor,
            float(self.speed[axis]),
            q,
            float(self.speed[joint]),
            ratio,
            float(self.stiffness[axis]) * (ratio * motor - q),
        )
