"""Runs of an MJCF in MuJoCo itself, under the position targets of logs.

A robot that was imported from an MJCF lacks whatever a robot file cannot say: tendons, ranges, gravity compensation,
MuJoCo's own dry friction. Its runs in MuJoCo have all of it, so that none of it is charged to the file.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight.logs import Log
from axisight.logs.log import not_logged
from axisight.mujoco.actuators import ON_JOINT, places
from axisight.robot import Robot

Array = NDArray[np.float64]

SAYS = (
    "Your simulator is the MJCF itself: it was run in MuJoCo under the targets of the logs, with what its import "
    "leaves out."
)
"""Sentence for the checks of a verdict."""

# Time [s] for which the first target is held before a run: the arm comes to rest where MuJoCo has it.
_SETTLES_S = 5.0
# Largest relative difference between the sample time of a log and a multiple of MuJoCo's time step.
_WHOLE = 1e-6


def runs_in_mujoco(robot: Robot, logs: Sequence[Log]) -> list[Log]:
    """Return runs of the MJCF of a robot under the targets of ``logs``, one for each, with positions and no torque.

    Empty where that is no run of the user's simulator:

    - the robot is no mere import of an MJCF with ``<position>`` actuators, one on each axis and none elsewhere;
    - MuJoCo is not installed, or the file is gone;
    - a log has torques, no targets, values that are not finite, or another number of axes;
    - a run is unstable.
    """
    source = robot.imported_from
    told = source is not None and robot.stepped is not None and robot.told_positions
    if not told or find_spec("mujoco") is None or not all(_has_targets(x, robot) for x in logs):
        return []
    mujoco = import_module("mujoco")
    try:
        motors = _Motors(mujoco.MjModel.from_xml_path(str(source)), robot)
    except (ValueError, KeyError):
        # Of a file that was changed or moved since, and of joints without names.
        return []
    if not motors.are_all:
        return []
    with _quiet(mujoco):
        runs = [run for log in logs if (run := motors.run(mujoco, log)) is not None]
    return runs if len(runs) == len(logs) else []


@contextmanager
def _quiet(mujoco: Any) -> Iterator[None]:
    """Keep MuJoCo from writing warnings about unstable runs to the screen and to a file in the working folder."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _text: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def _has_targets(log: Log, robot: Robot) -> bool:
    """Whether a log of the robot has finite positions and targets, and no torque."""
    if log.has_torque or log.position_ref_rad is None or log.n_axes != robot.n_axes:
        return False
    return bool(np.isfinite(log.position_ref_rad).all() and np.isfinite(log.position_rad).all())


class _Motors:
    """The motors of a model in the order of a robot's axes."""

    def __init__(self, model: Any, robot: Robot) -> None:
        self.model = model
        joints = [model.joint(name) for name in robot.axis_names]
        on_joints = bool((model.actuator_trntype <= ON_JOINT).all())
        command, count, output = places(model)
        told = np.flatnonzero(count > 0)
        only_axes = model.nq == model.nv == len(told) == robot.n_axes
        # An activation is a state of its own, such as the target of a speed servo.
        self.are_all = only_axes and on_joints and model.na == 0
        self.places = np.array([int(joint.qposadr[0]) for joint in joints])
        of_joint = {int(model.actuator_trnid[k, 0]): int(k) for k in told}
        own = np.array([of_joint[int(joint.id)] for joint in joints])
        # The target is the first command; others, such as a target of speed, stay zero.
        self.controls = command[own]
        self.ratio = np.asarray(robot.gear_ratio)
        # An actuator compares its target with the angle of the joint times its gear.
        self.gear = self.ratio * model.actuator_gear[output[own], 0]

    def run(self, mujoco: Any, log: Log) -> Log | None:
        """Return the run of a log; None if it is unstable, or its sample time is no multiple of the time step."""
        steps = round(log.sample_time_s / self.model.opt.timestep)
        whole = steps * self.model.opt.timestep / log.sample_time_s
        target = log.position_ref_rad
        if target is None or steps < 1 or abs(whole - 1.0) > _WHOLE:
            return None
        data = mujoco.MjData(self.model)
        data.qpos[self.places] = log.position_rad[0] * self.ratio
        data.ctrl[self.controls] = target[0] * self.gear
        mujoco.mj_step(self.model, data, round(_SETTLES_S / self.model.opt.timestep))
        angle = np.empty_like(target)
        for k, wanted in enumerate(target * self.gear):
            angle[k] = data.qpos[self.places]
            data.ctrl[self.controls] = wanted
            mujoco.mj_step(self.model, data, steps)
        # MuJoCo begins anew after an unstable step, and counts it.
        kinds = mujoco.mjtWarning
        unstable = (kinds.mjWARN_BADQPOS, kinds.mjWARN_BADQVEL, kinds.mjWARN_BADQACC)
        if any(data.warning[kind].number for kind in unstable):
            return None
        return replace(
            log,
            name=f"{log.name} in MuJoCo",
            position_rad=angle / self.ratio,
            torque_nm=not_logged(angle.shape),
            velocity_rad_s=None,
            joint_position_rad=None,
            temperature_c=None,
        )
