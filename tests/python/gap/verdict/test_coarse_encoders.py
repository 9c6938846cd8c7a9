"""Positions that come in steps: named where they are what the gap is made of."""

from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect, diagnose
from axisight.fitting import Weighting
from axisight.gap.controller.loop_decay import slowest_decay_1_s
from axisight.gap.signals.encoder_steps import encoder_steps
from axisight.gap.views.closed_loop import TRACKING_SPEED, records_of
from gap_data import PLAN, bare_axis, logs_of, scattered

STEP = 1e-3
# Repeats of one motion have the same steps: most rows would be copies.
HELD = {"fresh": ("multisine", 9), "other": ("multisine", 4)}


def steps_of(size: float) -> Effect:
    return Effect("position_quantization", 1, {"increment_rad": size})


@pytest.fixture(scope="module")
def logs():
    return logs_of(scattered(bare_axis(), 4), [steps_of(STEP)], PLAN)


def test_steps_are_read_off_the_logs(logs):
    np.testing.assert_allclose(encoder_steps(bare_axis(), logs), [STEP], rtol=1e-6)


def test_what_is_finer_than_the_noise_is_no_step():
    std = bare_axis().position_noise_std
    fine = logs_of(bare_axis(), [steps_of(2.0 * std)], PLAN, seconds=2.0)
    assert encoder_steps(bare_axis(), fine) == [0.0]


def test_logs_have_to_agree(logs):
    whole = replace(
        logs[0], position_rad=logs[0].position_rad + 1e-5 * np.pi * logs[0].time_s[:, None]
    )
    assert encoder_steps(bare_axis(), [*logs, whole]) == [0.0]


def test_a_simulator_with_steps_lacks_none(logs):
    assert encoder_steps(bare_axis().with_effects([steps_of(STEP)]), logs) == [0.0]


def test_steps_are_the_cause_of_a_gap_that_they_make(logs):
    held = logs_of(scattered(bare_axis(), 4), [steps_of(STEP)], HELD)
    said = diagnose(robot=bare_axis(), estimation=logs, validation=held)
    assert said.verdict == "explained"
    (cause,) = said.causes
    assert cause.label == "position_quantization@1"
    assert cause.parameters["increment_rad"].value == pytest.approx(STEP, rel=1e-3)
    assert cause.gap_reduction.value > 0.8
    assert "steps of the encoders" in said.headline
    assert said.axes[0].verdict == "explained"


def test_steps_are_named_beside_another_cause(logs):
    friction = Effect("coulomb_friction", 1, {"coulomb_nm": 8.0, "smoothing_rad_s": 0.05})
    both = [logs_of(scattered(bare_axis(), 4), [steps_of(STEP), friction], p) for p in (PLAN, HELD)]
    said = diagnose(robot=bare_axis(), estimation=both[0], validation=both[1])
    assert [c.label for c in said.causes] == ["coulomb_friction@1", "position_quantization@1"]
    # Each takes its own part of the gap.
    assert said.causes[0].gap_reduction.value > 0.9
    assert said.axes[0].causes == (0, 1)
    assert "Adding Coulomb friction on axis 1 cuts" in said.headline


def in_motion(logs):
    """Logs without references that begin in motion: no loop is known by which they could be simulated."""
    return [
        replace(
            x,
            velocity_ref_rad_s=None,
            **{k: getattr(x, k)[1000:] for k in ("time_s", "torque_nm", "position_rad")},
        )
        for x in logs
    ]


def test_steps_that_the_predicted_torque_does_not_feel_are_named_and_make_none_of_the_gap(logs):
    held = logs_of(scattered(bare_axis(), 4), [steps_of(STEP)], HELD)
    said = diagnose(
        robot=bare_axis(),
        estimation=in_motion(logs),
        validation=in_motion(held),
    )
    assert said.mode == "inverse_dynamics"
    assert (said.verdict, [c.label for c in said.causes]) == (
        "explained",
        ["position_quantization@1"],
    )
    assert said.causes[0].gap_reduction.high == 0.0
    assert "does not feel" in said.headline
    assert any("none of this gap" in check for check in said.checks)


def test_steps_about_as_fine_as_the_stated_noise_are_no_cause_by_themselves(logs):
    std = bare_axis().position_noise_std
    # Noise of steps, over the square root of twelve, of twice the sensor's: another sensor has three times.
    fine = logs_of(scattered(bare_axis(), 4), [steps_of(2 * np.sqrt(12.0) * std)], PLAN | HELD)
    said = diagnose(
        robot=bare_axis(),
        estimation=in_motion(fine[:-2]),
        validation=in_motion(fine[-2:]),
    )
    assert encoder_steps(bare_axis(), fine) > 0
    assert (said.verdict, said.causes) == ("none", ())


def test_where_something_is_unknown_the_floor_tells_nothing_of_steps(logs):
    hand = [
        replace(x, torque_nm=x.torque_nm + 15 * np.sin(2 * np.pi * 3.3 * x.time_s)[:, None])
        for x in logs
    ]
    said = diagnose(robot=bare_axis(), estimation=hand[:-1], validation=hand[-1:])
    assert said.verdict == "unknown"
    assert "position_quantization" not in {c.effect for c in said.causes}


def test_edges_of_logs_with_steps_do_not_count(logs):
    """A held motor swings between two steps before its log begins: until the loop forgets, none knows how."""
    robot = bare_axis().with_controller_speed(TRACKING_SPEED)
    flat = Weighting(np.array([0.0, 500.0]), np.ones((1, 2)), 1)
    (_, _, certain, _, _), *_ = records_of(robot, logs, flat)
    time_s = np.arange(len(certain)) * robot.sample_time_s
    counted = np.flatnonzero(certain[:, 0] > 0)
    forgets_s = -np.log(0.01) / slowest_decay_1_s(robot, np.zeros(1))
    assert time_s[counted[0]] >= min(forgets_s, 0.25 * time_s[-1])
    assert time_s[-1] - time_s[counted[-1]] == pytest.approx(0.5, abs=2 * robot.sample_time_s)
    fine = [
        replace(x, position_rad=x.position_rad + 1e-5 * np.pi * x.time_s[:, None]) for x in logs
    ]
    (_, _, certain, _, _), *_ = records_of(robot, fine, flat)
    assert certain[:3].all()
