"""Closed loops on a machine that MuJoCo simulates: its own steps, its own constraint solver."""

from __future__ import annotations

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

# At rest before a log begins, held by the controller.
_SETTLING_S = 4.0


def run(
    machine: Machine, references: Sequence[Array], noises: Sequence[Array]
) -> list[tuple[Array, Array]]:
    """Return reported torque [Nm] and measured motor angle [rad] along references [rad/s], (n, n_axes) each.

    ``noises`` [rad], as references, are added to the angle that is logged and fed back. The machine stands
    still under its controller before. Raises InputError where it does not stay stable.
    """
    met = [machine.met(reference) for reference in references]
    return [_along(machine, *pair) for pair in zip(met, noises, strict=True)]


def _along(machine: Machine, reference: Array, noise: Array) -> tuple[Array, Array]:
    loop = _Loop(machine)
    still = np.zeros((round(_SETTLING_S / machine.robot.sample_time_s), reference.shape[1]))
    loop.follow(still, still)
    loop.begin_log()
    return loop.follow(reference, noise)


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
        # Gears give way to it, so that the joints stand at the operating point.
        deflection = weight / self.stiffness
        along = machine.along()
        self.data.qpos[: self.n] = np.linalg.solve(along, robot.operating_point + deflection)
        angle = self.data.qpos[: self.n].copy()
        self.controller = Controller(machine, angle, weight @ along)
        self.time_s = 0.0

    def _weight(self) -> Array:
        """Return the torques that hold the joints where they are."""
        mujoco.mj_forward(self.model, self.data)
        return np.asarray(self.data.qfrc_bias[self.joints])

    def begin_log(self) -> None:
        """Count time from here."""
        self.time_s = 0.0

    def follow(self, reference: Array, noise: Array) -> tuple[Array, Array]:
        """Return reported torque and measured angle along a reference."""
        torque, angle = np.empty_like(reference), np.empty_like(reference)
        for k, wanted in enumerate(reference):
            measured = self.data.qpos[: self.n] + noise[k]
            for axis, law in self.laws:
                measured[axis] += law.sensor(float(self.data.qpos[axis]))
                joint = float(self.data.qpos[self.joints[axis]])
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
        data = self.data
        for _ in range(STEPS_PER_SAMPLE):
            data.ctrl[:] = command
            data.qfrc_applied[:] = 0.0
            for axis, law in self.laws:
                data.ctrl[axis] = law.command(float(data.ctrl[axis]))
                motor, joint = law.torque(self._at(axis))
                data.qfrc_applied[axis] += motor
                data.qfrc_applied[self.joints[axis]] += joint
            mujoco.mj_step(self.model, data)
            self.time_s += self.step_s

    def _at(self, axis: int) -> Axis:
        data, joint = self.data, self.joints[axis]
        motor, q = float(data.qpos[axis]), float(data.qpos[joint])
        ratio = float(self.ratio[axis])
        return Axis(
            self.time_s,
            motor,
            float(data.qvel[axis]),
            q,
            float(data.qvel[joint]),
            ratio,
            float(self.stiffness[axis]) * (ratio * motor - q),
        )
