"""A cascade whose targets are positions: its law, and diagnoses from positions and targets alone."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from axisight import Effect, Robot, diagnose, load_robot, simulate
from axisight.errors import InputError, RobotError
from axisight.gap.controller.feedback import told_as_torque, told_gain
from axisight.gap.facts.simulator_variant import AS_GIVEN
from axisight.gap.prepare.position_targets import with_commands
from axisight.gap.simulator.closed_loop_runs import simulated_positions
from cascade_arm import PI, SAMPLE_S, Cascade, P, log_of, simulator
from servo_arm import HOME_RAD, MACHINES, NOMINAL, targets

pytest.importorskip("mujoco", reason="MuJoCo comes with the extra `mujoco`")

Array = NDArray[np.float64]
FED = replace(PI, fed=True)
LAWS = {"PI": PI, "P": P, "fed": FED}
# Rounding of sums of a few terms of a hundred newton metres, over thousands of samples.
ROUNDING_NM = 1e-9


def robot_of(folder: Path, law: Cascade) -> Robot:
    return simulator(folder, NOMINAL, law).with_operating_point(HOME_RAD)


def rates(n: int = 100) -> Array:
    """Return rates of targets of 10 samples each (10 n, 3) [rad/s], in lines."""
    return np.repeat(np.diff(targets(1)[: n + 1], axis=0) * 50.0, 10, axis=0)


@pytest.mark.parametrize("law", LAWS)
def test_commands_are_the_stated_law(tmp_path: Path, law: str) -> None:
    robot = robot_of(tmp_path, LAWS[law])
    assert robot.controller_kind == "cascade_position"
    assert (robot.told_positions, robot.told_speeds) == (True, False)
    assert robot.velocity_feedforward is LAWS[law].fed
    reference = rates()
    out = simulate(robot, reference, method="rk4")
    position = out["position_rad"].values
    target = position[0] + (np.cumsum(reference, axis=0) - reference) * SAMPLE_S
    speed = np.diff(position, axis=0, prepend=position[:1]) / SAMPLE_S
    gains = robot.controller_gains
    error = LAWS[law].fed * reference - speed + gains["kv"] * (target - position)
    summed = (np.cumsum(error, axis=0) - error) * SAMPLE_S
    held = robot.equilibrium()["motor_torque_nm"].values
    expected = held + gains["kp"] * error + gains["ki"] * summed
    assert np.abs(out["torque_cmd_nm"].values - expected).max() < ROUNDING_NM


@pytest.mark.parametrize("law", LAWS)
def test_a_drive_in_mujoco_does_the_same(tmp_path: Path, law: str) -> None:
    """Both integrate by Runge-Kutta of fourth order, to rounding here; the drive is written anew."""
    robot = simulator(tmp_path, NOMINAL, LAWS[law])
    log = log_of(NOMINAL, LAWS[law], 1, noise_rad=0.0)
    found = with_commands(robot, [log])
    assert found is not None
    assert found.step == 10
    # But for what a spline between samples does not know of steps of targets, beside torques of 15 to 30 Nm.
    assert np.abs(found.logs[0].torque_nm[-1] - found.logs[0].torque_nm[0]).max() < 2.0
    (angle,) = simulated_positions(found.robot, AS_GIVEN, found.logs)
    error = angle[:: found.step] - log.position_rad
    assert np.abs(error - error.mean(axis=0)).max() < 1e-9


def test_commands_that_are_late_are_targets_that_are(tmp_path: Path) -> None:
    """Three samples late: the loop at the motor is not."""
    robot = robot_of(tmp_path, PI)
    late = [Effect("input_delay", axis, {"delay_s": 3 * SAMPLE_S}) for axis in (1, 2, 3)]
    reference = rates(60)
    shifted = np.vstack([np.zeros((3, 3)), reference[:-3]])
    found, same, on_time = (
        simulate(robot, r, effects=e, method="rk4")["position_rad"].values
        for r, e in ((reference, late), (shifted, []), (reference, []))
    )
    assert np.abs(found - same).max() < 1e-12
    assert np.abs(found - on_time).max() > 1e-4


def test_a_faster_loop_and_pickle_keep_the_law(tmp_path: Path) -> None:
    robot = robot_of(tmp_path, FED).with_velocity_feedforward(on=False).with_controller_speed(2.0)
    again = pickle.loads(pickle.dumps(robot))
    assert again.controller_kind == "cascade_position"
    assert not again.velocity_feedforward
    for key, factor in (("kv", 2), ("kp", 2), ("ki", 4)):
        assert again.controller_gains[key].tolist() == [factor * x for x in getattr(FED, key)]


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("velocity_feedforward = false", "continuous = true", "continuous"),
        ("velocity_feedforward = false", "velocity_feedforward = 0", "velocity_feedforward"),
        ('"cascade_position"', '"cascade"', "velocity_feedforward"),
        ("axisight.robot/2", "axisight.robot/1", "kind"),
    ],
)
def test_what_it_does_not_have_is_refused_by_name(
    tmp_path: Path, old: str, new: str, named: str
) -> None:
    text = robot_of(tmp_path, PI).toml
    assert text.count(old) == 1
    with pytest.raises(RobotError, match=named):
        Robot.from_toml(text.replace(old, new))


@pytest.mark.parametrize("law", LAWS)
def test_errors_are_told_by_the_gains_without_the_integral(tmp_path: Path, law: str) -> None:
    """Of a sine by its own response, once it has swung in."""
    robot = robot_of(tmp_path, LAWS[law])
    f, n = 5.0, 1000
    wave = np.exp(2j * np.pi * f * SAMPLE_S * np.arange(n))[:, None] * np.ones(3)
    speed = np.diff(wave, axis=0, prepend=wave[:1]) / SAMPLE_S
    told = [told_as_torque(robot, part(speed), part(wave)) for part in (np.real, np.imag)]
    size = np.abs(told[0] + 1j * told[1])[1:]
    np.testing.assert_allclose(size, np.tile(told_gain(robot, np.array([f])).T, (n - 1, 1)))


@pytest.mark.parametrize("lacks", ["coulomb_friction@2", "input_delay", None])
def test_what_a_machine_lacks_is_named(tmp_path: Path, lacks: str | None) -> None:
    robot = simulator(tmp_path, NOMINAL, PI)
    arm = NOMINAL if lacks is None else MACHINES[lacks]
    logs = [log_of(arm, PI, run) for run in (1, 2, 3)]
    found = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:])
    assert found.verdict == ("none" if lacks is None else "explained")
    assert found.gap.compared == "positions"
    assert not found.findings
    names = {c.label for c in found.causes}
    if lacks == "input_delay":
        assert names == {f"input_delay@{axis}" for axis in (1, 2, 3)}
        for cause in found.causes:
            assert cause.parameters["delay_s"].value == pytest.approx(arm.late_s, abs=SAMPLE_S / 8)
    else:
        assert names == ({lacks} if lacks else set())
        for cause in found.causes:
            # A tenth, as of the law of `test_targets`: the corner of the fitted friction is not MuJoCo's.
            assert cause.parameters["coulomb_nm"].value == pytest.approx(2.5, rel=0.1)


@pytest.mark.parametrize("law", ["PI", "P"])
def test_logs_that_begin_in_motion_are_run_up_to(tmp_path: Path, law: str) -> None:
    """Without an integral too, whose sum would never be forgotten."""
    robot = simulator(tmp_path, NOMINAL, LAWS[law])
    logs = [log_of(NOMINAL, LAWS[law], run).part(6.5) for run in (1, 2, 3)]
    found = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:])
    assert found.verdict == "none"
    assert [f.name for f in found.findings] == ["begins_in_motion"] * 3


def test_logs_that_do_not_tell_its_command_are_refused(tmp_path: Path) -> None:
    log = replace(log_of(NOMINAL, FED, 1).part(0.0, 3.0), velocity_ref_rad_s=None)
    with pytest.raises(InputError, match=r"velocity_ref: expected the rates .*'run1'"):
        with_commands(simulator(tmp_path, NOMINAL, FED), [log])
    path = tmp_path / "speeds.toml"
    text = simulator(tmp_path, NOMINAL, PI).toml.replace("velocity_feedforward = false\n", "")
    path.write_text(text.replace('"cascade_position"', '"cascade"'), "utf-8")
    with pytest.raises(InputError, match="pd_position or cascade_position"):
        with_commands(load_robot(path), [log])
