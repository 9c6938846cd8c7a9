"""Gravity that an MJCF compensates: torques at rest are MuJoCo's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from axisight import load_robot
from axisight.robot_import.load import import_robot
from axisight.write_back import write_model
from found_causes import several
from import_data import written

mujoco = pytest.importorskip("mujoco")


def arm(first: float, second: float, held: tuple[str, str] = ("false", "false")) -> str:
    """Return an MJCF of two bodies with shares of compensation, carried by the actuators of joints."""
    return f"""<mujoco><worldbody>
    <body name="a" gravcomp="{first}"><joint name="j1" axis="0 1 0" actuatorgravcomp="{held[0]}"/>
      <inertial pos="0.2 0 0.1" mass="3" diaginertia="0.03 0.04 0.02"/>
      <body name="b" pos="0.4 0 0" gravcomp="{second}">
        <joint name="j2" axis="0 1 0" actuatorgravcomp="{held[1]}"/>
        <inertial pos="0.1 0 0" mass="1" diaginertia="0.01 0.02 0.02"/></body></body>
    </worldbody><actuator><position joint="j1" kp="90" kv="9"/><position joint="j2" kp="40" kv="3"/>
    </actuator></mujoco>"""


def holding(path: Path, pose: list[float]) -> np.ndarray:
    """Return the torque (2,) [Nm] beyond passive forces that holds the arm in MuJoCo."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    data.qpos[:] = pose
    mujoco.mj_inverse(model, data)
    return np.array(data.qfrc_inverse)


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_gravity_that_nothing_carries_is_no_gravity(tmp_path: Path, share: float):
    path = written(tmp_path, arm(share, share), "arm.xml")
    robot = load_robot(path)
    pose = [0.3, -0.8]
    weight = robot.gravity(pose)
    np.testing.assert_allclose(weight, holding(path, pose), atol=1e-9)
    assert ("gravcomp of all bodies" in robot.toml) == (share > 0)


def test_gravity_that_actuators_carry_is_the_controllers(tmp_path: Path):
    """Their forces contain the weight, as MuJoCo adds it to qfrc_actuator."""
    path = written(tmp_path, arm(1.0, 1.0, ("true", "true")), "arm.xml")
    robot = load_robot(path)
    assert "gravity_compensation = true" in robot.toml
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    data.qpos[:] = data.ctrl[:] = [0.3, -0.8]
    mujoco.mj_forward(model, data)
    weight = robot.gravity([0.3, -0.8])
    np.testing.assert_allclose(data.qfrc_actuator, weight, atol=1e-9)


@pytest.mark.parametrize(
    ("first", "second", "held"),
    [
        (1.0, 0.5, ("false", "false")),
        (1.0, 1.0, ("true", "false")),
        (0.5, 0.5, ("true", "true")),
    ],
)
def test_gravity_that_is_compensated_in_part_is_said(
    tmp_path: Path, first: float, second: float, held: tuple[str, str]
):
    path = written(tmp_path, arm(first, second, held), "arm.xml")
    text = import_robot(path).toml
    assert "gravcomp of 'a', 'b' left out: gravity acts on all of their masses" in text
    assert ("joint 'j1': actuatorgravcomp left out" in text) == (held[0] == "true")


def test_a_tilt_of_the_base_turns_the_gravity_of_the_file(tmp_path: Path):
    """The share that is compensated stays with the bodies."""
    path = written(tmp_path, arm(0.4, 0.4), "arm.xml")
    tilt = several("base_tilt", None, about_x_rad=0.0, about_y_rad=0.1)
    made = write_model(path, load_robot(path), [tilt], tmp_path / "new.xml")
    assert made.left_out == ()
    gravity = mujoco.MjModel.from_xml_path(str(made.path)).opt.gravity
    assert np.linalg.norm(gravity) == pytest.approx(9.81)
    assert abs(gravity[0]) == pytest.approx(9.81 * np.sin(0.1))
