"""Backlash as a joint with a range: MuJoCo's motor turns through the play before the arm follows."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from axisight import load_robot
from axisight.cli.outcomes import write_found_model
from axisight.write_back import write_model
from found_causes import several
from import_data import MJCF, changed, written

mujoco = pytest.importorskip("mujoco")

HALF_RAD = 0.004
PLAY = several("backlash", 1, half_width_rad=HALF_RAD)
ARM = """<mujoco>
  <compiler angle="{unit}"/>
  <default><joint damping="0.9" armature="0.3"/></default>
  <option timestep="0.0005" gravity="0 0 0"/>
  <worldbody>
    <body name="arm">
      <joint name="j" axis="0 1 0" pos="0 0 0.1"/>
      <inertial pos="0.1 0 0" mass="2" diaginertia="0.02 0.03 0.02"/>
    </body>
  </worldbody>
  <actuator><motor joint="j"/></actuator>
</mujoco>
"""


@pytest.mark.parametrize("unit", ["radian", "degree"])
def test_the_arm_lags_by_the_play(tmp_path: Path, unit: str):
    """Pushed to and fro, the play joint goes from one end of the play to the other, and not beyond by 2 %."""
    source = written(tmp_path, ARM.format(unit=unit), "arm.xml")
    made = write_model(source, load_robot(source), [PLAY], tmp_path / "new.xml", play_joints=True)
    assert made.left_out == ()
    model = mujoco.MjModel.from_xml_path(str(made.path))
    assert (model.nq, model.nu) == (2, 1)
    np.testing.assert_allclose(model.jnt_range[1], [-HALF_RAD, HALF_RAD])
    np.testing.assert_array_equal(model.jnt_pos[1], model.jnt_pos[0])
    assert model.dof_armature[1] == model.dof_damping[1] == 0
    data, play = mujoco.MjData(model), []
    for k in range(8000):
        data.ctrl[0] = 0.05 * np.sin(2 * np.pi * k * 0.0005)
        mujoco.mj_step(model, data)
        play.append(data.qpos[1])
    assert max(play) == pytest.approx(HALF_RAD, rel=0.02)
    assert min(play) == pytest.approx(-HALF_RAD, rel=0.02)
    # Of both masses, only that of the motor moves within the play.
    mujoco.mj_resetData(model, data)
    data.ctrl[0] = 0.05
    mujoco.mj_step(model, data)
    assert data.qvel[0] == pytest.approx(0.05 / 0.3 * 0.0005, rel=0.01)
    assert data.qvel.sum() == pytest.approx(0.0, abs=1e-3 * abs(data.qvel[0]))


def test_a_play_joint_needs_a_rotor_and_is_written_on_request_only(tmp_path: Path):
    source = written(tmp_path, ARM.format(unit="radian"), "arm.xml")
    made = write_model(source, load_robot(source), [PLAY], tmp_path / "plain.xml")
    assert "play_joints=True" in made.why["backlash@1"]
    text = changed(ARM.format(unit="radian"), ' armature="0.3"', "")
    source = written(tmp_path, text, "light.xml")
    made = write_model(
        source, load_robot(source), [PLAY], tmp_path / "light_new.xml", play_joints=True
    )
    assert "expected an armature" in made.why["backlash@1"]


def test_play_and_other_causes_of_a_joint_are_written_together(tmp_path: Path):
    dry = several("coulomb_friction", 1, coulomb_nm=0.05)
    source = written(tmp_path, MJCF, "arm.xml")
    made = write_model(
        source, load_robot(source), [dry, PLAY], tmp_path / "new.xml", play_joints=True
    )
    assert made.placed == (dry.label, PLAY.label)
    model = mujoco.MjModel.from_xml_path(str(made.path))
    assert model.dof_frictionloss[0] == pytest.approx(2.5)
    assert model.dof_frictionloss[1] == 0
    assert model.joint("play of shoulder").id == 1


def test_the_command_line_writes_a_play_joint_where_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    source = written(tmp_path, ARM.format(unit="radian"), "arm.xml")
    inputs: Any = SimpleNamespace(robot=load_robot(source), robot_source=source)
    options: Any = SimpleNamespace(given=lambda: False)
    found: Any = SimpleNamespace(causes=(PLAY,), refit={}, remainder=None)
    for asked in (False, True):
        new = tmp_path / f"new_{asked}.xml"
        write_found_model(found, inputs, options, new, force=False, play_joints=asked)
        assert ("--play-joints" in " ".join(capsys.readouterr().out.split())) != asked
        assert mujoco.MjModel.from_xml_path(str(new)).njnt == 1 + asked
