"""Limits of force of MJCF actuators and joints, and actuators that are told speeds: MuJoCo says what they do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from axisight import Robot, load_robot
from axisight.gap.facts.result import Cause, Interval
from axisight.gap.facts.simulator_variant import AS_GIVEN
from axisight.gap.prepare.position_targets import with_commands
from axisight.gap.simulator.closed_loop_runs import simulated_positions
from axisight.logs import Log
from axisight.logs.log import not_logged
from axisight.write_back import write_model
from import_data import MJCF, changed, written
from servo_arm import HOME_RAD, NOMINAL, targets

mujoco = pytest.importorskip("mujoco", reason="MuJoCo comes with the extra `mujoco`")

Array = NDArray[np.float64]
MOTOR = '<motor joint="shoulder" gear="50"/>'
LIMITED = {
    "motor": '<motor joint="shoulder" gear="50" forcerange="-4 4"/>',
    "motor and its command": '<motor joint="shoulder" gear="50" ctrlrange="-3 3" forcerange="-4 4"/>',
    "gain": '<general joint="shoulder" gear="50" gainprm="1.6" forcerange="-4 4"/>',
    "position": '<position joint="shoulder" gear="50" kp="9" kv="2" forcerange="-4 4"/>',
    "velocity": '<velocity joint="shoulder" gear="-50" kv="2" forcerange="-4 4"/>',
    "intvelocity": '<intvelocity joint="shoulder" gear="50" kp="9" actrange="-9 9" forcerange="-4 4"/>',
}


def cause(effect: str, axis: int, **values: float) -> Cause:
    found = {name: Interval(x, 0.9 * x, 1.1 * x) for name, x in values.items()}
    return Cause(effect, axis, 0.9, found, dict.fromkeys(found, "Nm"), Interval(50.0, 40.0, 60.0))


def largest_torque(path: Path, joint: str = "shoulder") -> float:
    """Return the largest torque [Nm] that the actuators of a joint give, whatever they are told."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    data.act[:] = 1e4
    data.ctrl[:] = 1e4
    mujoco.mj_forward(model, data)
    return float(abs(data.joint(joint).qfrc_actuator[0]))


def limit_of(robot: Robot, axis: int) -> float:
    """Return the largest torque [Nm] of a joint that the torque path of a robot gives."""
    values = {(e.name, e.axis): e.values()[0] for e in robot.effects}
    gain = 1 + values.get(("torque_constant", axis), 0.0)
    limit = values[("torque_saturation", axis)]
    return float(gain * limit / abs(robot.gear_ratio[axis - 1]))


@pytest.mark.parametrize("joint_nm", [None, 120.0, 1e3])
@pytest.mark.parametrize("actuator", LIMITED)
def test_limits_of_force_are_those_of_the_torque(
    tmp_path: Path, actuator: str, joint_nm: float | None
) -> None:
    text = changed(MJCF, MOTOR, LIMITED[actuator])
    if joint_nm is not None:
        limit = f'name="shoulder" actuatorfrcrange="{-joint_nm} {joint_nm}"'
        text = changed(text, 'name="shoulder"', limit)
    source = written(tmp_path, text, "arm.xml")
    robot = load_robot(source)
    assert limit_of(robot, 1) == pytest.approx(largest_torque(source))
    assert "limits of its force" not in robot.toml and "limits of the force" not in robot.toml


@pytest.mark.parametrize("limit_nm", [2.5, 6.0])
@pytest.mark.parametrize("joint_nm", [None, 120.0])
@pytest.mark.parametrize("actuator", LIMITED)
def test_a_limit_that_was_found_is_what_acts(
    tmp_path: Path, actuator: str, joint_nm: float | None, limit_nm: float
) -> None:
    """Smaller or larger than those in the file, with the gain beside it that stands before them."""
    text = changed(MJCF, MOTOR, LIMITED[actuator])
    if joint_nm is not None:
        limit = f'name="shoulder" actuatorfrcrange="{-joint_nm} {joint_nm}"'
        text = changed(text, 'name="shoulder"', limit)
    source = written(tmp_path, text, "arm.xml")
    found = cause("torque_saturation", 1, limit_nm=limit_nm)
    weaker = cause("torque_constant", 1, relative_error=-0.2)
    robot = load_robot(source)
    made = write_model(source, robot, [found], tmp_path / "new.xml")
    assert made.left_out == ()
    gain = 1.6 if actuator == "gain" else 1.0
    assert largest_torque(made.path) == pytest.approx(50 * gain * limit_nm)
    assert limit_of(load_robot(made.path), 1) == pytest.approx(50 * gain * limit_nm)
    if actuator == "velocity":
        made = write_model(source, robot, [weaker], tmp_path / "weaker.xml")
        assert made.why == {
            weaker.label: "expected a motor, <velocity> has a limit, its law is none here"
        }
        return
    both = write_model(source, robot, [found, weaker], tmp_path / "both.xml")
    assert both.left_out == ()
    assert largest_torque(both.path) == pytest.approx(50 * 0.8 * limit_nm)
    # A motor that gives less reaches its limit of command at less.
    alone = write_model(source, robot, [weaker], tmp_path / "weaker.xml")
    assert largest_torque(alone.path) == pytest.approx(largest_torque(source) * 0.8 / gain)


def test_limits_that_are_not_alike_both_ways_stay(tmp_path: Path) -> None:
    text = changed(MJCF, MOTOR, '<position joint="shoulder" kp="9" forcerange="-4 5"/>')
    source = written(tmp_path, text, "arm.xml")
    robot = load_robot(source)
    assert not [e for e in robot.effects if e.name == "torque_saturation"]
    found = cause("torque_saturation", 1, limit_nm=3.0)
    made = write_model(source, robot, [found], tmp_path / "new.xml")
    assert made.why == {
        found.label: "expected limits of force in the file that are the same both ways"
    }
    assert made.path.read_bytes() == source.read_bytes()


def test_an_arm_with_a_gear_of_the_drive_data_is_the_same_arm(tmp_path: Path) -> None:
    """Gains and limits of the file's motors become those of the motors that are meant."""
    text = NOMINAL.mjcf().replace(
        '<position joint="j2"', '<position joint="j2" forcerange="-60 60"'
    )
    source = written(tmp_path, text, "arm.xml")
    plain = load_robot(source)
    written(tmp_path, "[joint.j2]\ngear_ratio = 0.01\n", "arm.drives.toml")
    geared = load_robot(source)
    for key in ("kp", "kd"):
        stiffness = geared.controller_gains[key] / geared.gear_ratio**2
        np.testing.assert_allclose(stiffness, plain.controller_gains[key])
    assert geared.stepped is not None and plain.stepped is not None
    np.testing.assert_allclose(geared.stepped[1] / geared.gear_ratio**2, plain.stepped[1])
    assert limit_of(geared, 2) == pytest.approx(60.0)
    made = write_model(
        source, geared, [cause("torque_saturation", 2, limit_nm=0.4)], tmp_path / "new.xml"
    )
    assert largest_torque(made.path, "j2") == pytest.approx(40.0)


def test_an_arm_that_is_told_speeds_is_imported_and_says_so(tmp_path: Path) -> None:
    text = NOMINAL.mjcf().replace("<position ", "<velocity ")
    for kp in NOMINAL.kp:
        text = text.replace(f'kp="{kp}" ', "")
    robot = load_robot(written(tmp_path, text, "arm.xml"))
    assert robot.controller_kind == "none"
    assert (
        "# actuators that are told speeds (j1 120, j2 110, j3 25 Nm s/rad): no controller"
        in robot.toml
    )
    assert "no plain motor" not in robot.toml


@pytest.mark.parametrize("late", [False, True])
def test_actuators_that_sum_up_speeds_have_targets(tmp_path: Path, late: bool) -> None:
    """What MuJoCo does with them is what their law does with the targets that they summed up.

    Speeds that are late are so before they are summed up: the targets in the log are late already.
    """
    text = NOMINAL.mjcf().replace("<position ", '<intvelocity actrange="-9 9" ')
    if late:
        pytest.importorskip("mujoco", minversion="4.0")
        text = text.replace("<intvelocity ", '<intvelocity delay="0.02" nsample="41" ')
    source = written(tmp_path, text, "arm.xml")
    robot = load_robot(source, sample_time_s=NOMINAL.step_s)
    assert [e.label for e in robot.effects if e.name == "input_delay"] == []
    assert ("its delay left out: its activation has it" in robot.toml) == late
    assert robot.controller_kind == "pd_position"
    model = mujoco.MjModel.from_xml_path(str(source))
    data = mujoco.MjData(model)
    data.qpos[:] = data.act[:] = HOME_RAD
    mujoco.mj_step(model, data, 8000)
    rates = np.repeat(np.diff(targets(1)[:200], axis=0) * 50.0, 40, axis=0)
    told, position = np.empty_like(rates), np.empty_like(rates)
    for k, rate in enumerate(rates):
        told[k], position[k] = data.act, data.qpos
        data.ctrl[:] = rate
        mujoco.mj_step(model, data)
    log = Log(
        name="run",
        sample_time_s=NOMINAL.step_s,
        time_s=NOMINAL.step_s * np.arange(len(told)),
        torque_nm=not_logged(told.shape),
        position_rad=position,
        position_ref_rad=told,
        source=Path("run"),
    )
    found = with_commands(robot, [log])
    assert found is not None
    (angle,) = simulated_positions(found.robot, AS_GIVEN, found.logs)
    error = (angle - position)[:: found.step]
    # As of actuators that are told positions: the square of a step's share in the fastest motion.
    assert (error - error.mean(axis=0)).std(axis=0).max() < 1e-4
    assert position.std(axis=0).min() > 0.05
