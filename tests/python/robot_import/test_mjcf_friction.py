"""Dry friction of an MJCF: MuJoCo's soft constraint on speed and acceleration."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from axisight import Robot, simulate
from axisight.effects.stated import DRY_FRICTION, LEAD
from axisight.robot_import import import_robot
from axisight.robot_import.drives import DriveData, JointDrive

Array = NDArray[np.float64]

FRICTION_NM, STEP_S = 0.1, 1e-4
MODEL = """
<mujoco>
  <option timestep="1e-4" gravity="0 0 0"/>
  <worldbody>
    <body>
      <joint name="hinge" axis="0 1 0" damping="0.05" armature="0.02" frictionloss="0.1" {more}/>
      <inertial pos="0 0 -0.1" mass="0.3" diaginertia="5e-4 5e-4 1e-4"/>
    </body>
  </worldbody>
  <actuator><motor joint="hinge" gear="{gear}"/></actuator>
</mujoco>
"""


def _file(folder: Path, more: str = "", gear: float = 1.0) -> Path:
    path = folder / "arm.xml"
    path.write_text(MODEL.format(more=more, gear=gear))
    return path


def _law(robot: Robot) -> dict[str, float]:
    (dry,) = (effect for effect in robot.effects if effect.name == DRY_FRICTION[0])
    return dict(dry.parameters or {})


LAWS = [
    "",
    'solreffriction="0.1 1"',
    'solreffriction="-500 -40"',
    'solreffriction="1e-5 1"',
    'solimpfriction="0.5 0.99 0.001 0.5 2"',
    'solimpfriction="0.5 0.9 0 0.5 2"',
    'solimpfriction="0.5 2 0.001 0.5 2"',
]


@pytest.mark.parametrize("more", LAWS)
def test_the_law_is_that_of_mujocos_constraint(tmp_path: Path, more: str):
    path = _file(tmp_path, more, gear=-5.0)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    (damping,), (softness,) = data.efc_KBIP[:, 1], data.efc_R + model.dof_invweight0
    law = _law(import_robot(path))
    # The same arithmetic in another order: rounding alone.
    assert law[LEAD] == pytest.approx(1.0 / damping, rel=1e-12)
    # Motor side: five turns of the motor for one of the joint.
    assert law[DRY_FRICTION[1]] == pytest.approx(FRICTION_NM / 5, rel=1e-12)
    assert law[DRY_FRICTION[2]] == pytest.approx(5 * FRICTION_NM * softness / damping, rel=1e-12)


def test_friction_that_stops_nothing_keeps_the_usual_corner(tmp_path: Path):
    law = _law(import_robot(_file(tmp_path, 'solreffriction="-500 0"')))
    assert law[LEAD] == 0.0
    assert law[DRY_FRICTION[2]] == 0.01


def test_measured_friction_has_no_lead(tmp_path: Path):
    drives = DriveData(joint={"hinge": JointDrive(coulomb_friction=0.3)})
    law = _law(import_robot(_file(tmp_path), drives=drives))
    assert law[LEAD] == 0.0
    assert law[DRY_FRICTION[1]] == 0.3


def _pushed() -> Array:
    """Return a torque (n,) [Nm] of rising frequency, 2 s long, that turns the joint round often."""
    time = STEP_S * np.arange(20_000)
    return 0.4 * np.sin(2 * np.pi * (1.0 + 3.5 * time) * time)


def test_a_simulation_moves_as_mujoco_does(tmp_path: Path):
    path = _file(tmp_path)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    torque = _pushed()
    wanted = np.empty_like(torque)
    for k, push in enumerate(torque):
        wanted[k] = data.qpos[0]
        data.ctrl[0] = push
        mujoco.mj_step(model, data)
    robot = import_robot(path, drives=DriveData(sample_time=STEP_S))
    plain = [e.with_values({LEAD: 0.0}) for e in robot.effects]

    def off(effects: list[object]) -> float:
        run = simulate(robot, torque_nm=torque[:, None], effects=effects)
        return float(np.std(run["joint_position_rad"].to_numpy()[:, 0] - wanted) / np.std(wanted))

    # MuJoCo's Euler steps move a free joint late by half a step: of the fastest swings, at 15 Hz, 0.5 % of a radian.
    assert off([]) < 0.005
    assert off(plain) > 0.02
