"""Errors of position and velocity of a diagnosis from positions: against MuJoCo's own speeds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from axisight import Log, Robot, Settings
from axisight.cli.show import show_diagnosis
from axisight.gap.facts.result import AxisStages, MotionErrors
from axisight.gap.facts.simulator_variant import AS_GIVEN
from axisight.gap.measure.motion_errors import (
    motion_errors,
    slope,
    speeds_at_samples,
    velocity_from,
)
from axisight.gap.measure.torque_traces import signals_of
from axisight.gap.pipeline import behind_gate
from axisight.gap.views.targets import TargetsView
from axisight.logs import lowpass
from axisight.report import render_report
from diagnosis_data import explained
from servo_arm import MACHINES, NOMINAL, RATE_HZ, simulator

pytest.importorskip("mujoco", reason="MuJoCo comes with the extra `mujoco`")

Array = NDArray[np.float64]
# Of encoder and tachometer, where figures of a motion are meant: too small to count in them.
QUIET_RAD, QUIET_RAD_S = 1e-6, 1e-5
NOISE_RAD, NOISE_RAD_S = 2e-4, 5e-3


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    """The simulator with a clock of 0.5 ms: between two of its samples the law is right to second order."""
    text = simulator(tmp_path_factory.mktemp("servo")).toml
    assert "sample_time = 0.002" in text
    return Robot.from_toml(text.replace("sample_time = 0.002", "sample_time = 0.0005"))


def errors_of(robot: Robot, logs: list[Log]) -> MotionErrors:
    """Return the errors of the simulator as given, which stands for all stages."""
    inputs, view = behind_gate(robot, logs[:2], logs[2:], ()).compared(Settings(threads=1))
    assert isinstance(view, TargetsView)
    source = velocity_from(inputs.validation, inputs.noted)
    found = motion_errors(view, inputs.validation, AS_GIVEN, AS_GIVEN, source)
    assert found is not None
    return found


@pytest.mark.parametrize("logged", [True, False])
def test_they_are_those_of_two_runs_in_mujoco(robot: Robot, logged: bool) -> None:
    """Machine and model under the same targets, the speeds of both taken from MuJoCo."""
    noise = {"noise_rad": QUIET_RAD, "speed_noise_rad_s": QUIET_RAD_S if logged else None}
    lacking = MACHINES["coulomb_friction@2"]
    found = errors_of(robot, [lacking.log(run, **noise) for run in (1, 2, 3)])
    assert found.velocity_from == ("logged" if logged else "positions")
    real, given = (arm.log(3, 0.0, speed_noise_rad_s=0.0) for arm in (lacking, NOMINAL))
    assert real.velocity_rad_s is not None and given.velocity_rad_s is not None
    off = real.position_rad - given.position_rad
    pairs = [
        (found.position_rad, off - off.mean(axis=0)),
        (found.velocity_rad_s, real.velocity_rad_s - given.velocity_rad_s),
    ]
    for errors, difference in pairs:
        passed = lowpass(np.ascontiguousarray(difference), 1 / RATE_HZ, RATE_HZ / 5)
        wanted = np.sqrt(np.mean(passed**2, axis=0))
        # The simulator has MuJoCo's motion to a hundredth of what friction does on its axis.
        np.testing.assert_allclose(errors.before, wanted, rtol=0.02, atol=0.02 * wanted[1])
        # The top of a spectrum has some motion too at 50 Hz, and what is found there is taken for noise.
        assert errors.before[1] > 5 * errors.floor[1]


def test_signals_have_the_positions_that_are_compared(robot: Robot) -> None:
    logs = [MACHINES["coulomb_friction@2"].log(run, QUIET_RAD) for run in (1, 2, 3)]
    inputs, view = behind_gate(robot, logs[:2], logs[2:], ()).compared(Settings(threads=1))
    assert isinstance(view, TargetsView)
    (*_, held) = signals_of(view, inputs.validation, AS_GIVEN, gap_before=np.zeros(robot.n_axes))
    (log,) = inputs.validation
    np.testing.assert_array_equal(held["measured_position_rad"], log.position_rad)
    errors = view.off_by(held["simulated_before_position_rad"].values, log)
    found = errors_of(robot, logs).position_rad.before
    # The same numbers, added in another order.
    np.testing.assert_allclose(np.sqrt(np.mean(errors**2, axis=0)), found, rtol=1e-9)


@pytest.mark.parametrize("logged", [True, False])
def test_of_a_complete_simulator_noise_is_left(robot: Robot, logged: bool) -> None:
    speeds = NOISE_RAD_S if logged else None
    logs = [NOMINAL.log(run, NOISE_RAD, speed_noise_rad_s=speeds) for run in (1, 2, 3)]
    found = errors_of(robot, logs)
    # An rms of 1000 samples of which two fifths are passed is off by 1 / sqrt(800), twice over three axes.
    for errors in (found.position_rad, found.velocity_rad_s):
        np.testing.assert_allclose(errors.before, errors.floor, rtol=4 / np.sqrt(800))
    if logged:
        # Of white noise the low-pass keeps about two fifths.
        assert found.velocity_rad_s.floor == pytest.approx(NOISE_RAD_S * np.sqrt(0.4), rel=0.15)


def test_speeds_that_are_not_of_the_positions_are_left_alone(robot: Robot) -> None:
    good = [NOMINAL.log(run, speed_noise_rad_s=NOISE_RAD_S) for run in (1, 2, 3)]
    wrong = [replace(x, velocity_rad_s=np.degrees(x.velocity_rad_s)) for x in good]
    inputs = behind_gate(robot, wrong[:2], wrong[2:], ())
    assert {f.name for f in inputs.noted} == {"velocity_inconsistent"}
    assert velocity_from(inputs.validation, inputs.noted) == "positions"
    inputs = behind_gate(robot, good[:2], good[2:], ())
    assert not inputs.noted
    assert velocity_from(inputs.validation, inputs.noted) == "logged"
    # One axis without speeds: those of positions for all.
    gaps = np.array(good[2].velocity_rad_s)
    gaps[:, 1] = np.nan
    inputs = behind_gate(robot, good[:2], [replace(good[2], velocity_rad_s=gaps)], ())
    assert velocity_from(inputs.validation, inputs.noted) == "positions"


def test_speeds_are_those_before_a_target_begins_to_hold() -> None:
    """Accelerations that jump at every logged sample; parabolas between are met to rounding."""
    time, step, n = 0.002, 10, 30
    pushes = np.random.default_rng(1).normal(size=n)
    speed = np.concatenate([[0.0], np.cumsum(pushes) * time * step])
    at = time * np.arange(step)[:, None]
    inside = speed[:-1] * at + 0.5 * pushes * at**2
    begun = np.cumsum(np.concatenate([[0.0], (speed[:-1] + speed[1:]) / 2 * time * step]))
    position = np.concatenate([(begun[:-1] + inside).T.ravel(), begun[-1:]])[:, None]
    found = speeds_at_samples(position, time, step)[1:, 0]
    np.testing.assert_allclose(found, speed[1:], rtol=0, atol=1e-9)
    # So long before: still on the parabola that ended there, whatever comes after it.
    position[step::step] += 1e-3
    earlier = speeds_at_samples(position, time, step, 0.001)[1:, 0]
    np.testing.assert_allclose(earlier, speed[1:] - 0.001 * pushes, rtol=0, atol=1e-9)


def test_a_slope_is_right_up_to_a_fifth_of_the_rate() -> None:
    time = 0.02
    t = time * np.arange(400)
    omega = 2 * np.pi * 0.2 / time
    found = slope(np.sin(omega * t)[:, None], time)[20:-20, 0]
    wanted = omega * np.cos(omega * t)[20:-20]
    np.testing.assert_allclose(found, wanted, rtol=0, atol=0.02 * omega)


def test_screen_report_and_verdict_tell_them(capsys: pytest.CaptureFixture) -> None:
    """Figures that nothing else has, in every place."""
    position = AxisStages(*(np.array([k, 2 * k, 3 * k]) for k in (0.00123, 0.9, 0.00045, 0.00021)))
    velocity = AxisStages(*(np.array([k, 2 * k, 3 * k]) for k in (0.0321, 0.9, 0.0054, 0.0032)))
    found = explained()
    told = MotionErrors(position, velocity, "logged")
    found = replace(found, gap=replace(found.gap, motion=told))
    show_diagnosis(found, verbose=True)
    page, notebook = render_report(found), found._repr_html_()
    for text in (capsys.readouterr().out, page, notebook):
        assert "Velocities are those logged" in " ".join(text.split())
        for number in ("0.00123", "0.00045", "0.00021", "0.0321", "0.0054", "0.0032"):
            assert number in text
    motion = found.to_verdict()["gap"]["motion"]
    assert motion["velocity_from"] == "logged"
    assert motion["velocity_rad_s"]["after"] == [0.0054, 0.0108, pytest.approx(0.0162)]
    plain = explained()
    assert plain.to_verdict()["gap"]["motion"] is None
    assert "Errors of position" not in render_report(plain) + plain._repr_html_()
