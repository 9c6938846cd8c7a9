"""Logs that cannot give a response are refused, with a message that says why and what to do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import axisight
from axisight import excitation
from axisight.errors import InputError
from axisight.responses import response_of_logs
from response_logs import log, periodic_logs


def refused(logs, **options) -> str:
    with pytest.raises(InputError) as caught:
        response_of_logs(logs, **options)
    return str(caught.value)


def test_too_few_experiments() -> None:
    assert "expected at least 2 experiments for 2 axes" in refused(periodic_logs()[:1])


def test_nothing_excited() -> None:
    still = np.zeros((1000, 2))
    assert "expected an axis that moves" in refused([log("a", still, still, still)])
    noise = np.random.default_rng(0).standard_normal((1000, 2))
    held = [log(name, still, noise, still) for name in ("a", "b")]
    assert "expected an excitation" in refused(held)


def test_different_sample_times_and_axes() -> None:
    first, second = periodic_logs()
    other = log("slow", second.torque_nm, second.position_rad, second.velocity_ref_rad_s, 2e-3)
    assert "slow: sample time: expected 0.001 s as m1e1, got 0.002 s" in refused([first, other])
    wide = log("wide", *(np.hstack([x, x]) for x in (second.torque_nm, second.position_rad)))
    assert "expected 2 axes as in m1e1, got 4 in wide" in refused([first, wide])


def test_different_operating_points() -> None:
    first, second = periodic_logs()
    away = replace(second, position_rad=second.position_rad + 60.0)
    text = refused([first, away])
    assert "operating point: expected mean position of axis" in text
    assert "estimate each operating point apart" in text


def test_different_periods() -> None:
    text = refused([periodic_logs()[0], periodic_logs(n=200)[1]])
    assert "period: expected the same in all logs, got m1e1: 256, m1e2: 200 (samples)" in text


def test_a_period_that_is_not_whole() -> None:
    assert "whole number of samples" in refused(periodic_logs(), period_s=0.25603)


def test_no_reference_for_joint_input_output() -> None:
    bare = [replace(one, velocity_ref_rad_s=None) for one in periodic_logs()]
    assert "reference: expected velocity references" in refused(
        bare, estimator="joint_input_output"
    )
    assert response_of_logs(bare).choices[0].endswith("found from the torque")


def test_no_torque() -> None:
    bare = [replace(one, torque_nm=np.full_like(one.torque_nm, np.nan)) for one in periodic_logs()]
    assert "m1e1: torque of axis 1: expected numbers, got none" in refused(bare)


def test_a_design_of_other_logs() -> None:
    step = 1e-3
    tones = excitation.multisine(0.256, step, lines=[61, 63], seed=1)
    design = excitation.references(tones, 2)
    assert "is it the design of these logs?" in refused(periodic_logs(), design=design)
    slow = excitation.references(excitation.multisine(0.512, 2e-3, lines=[5], seed=1), 2)
    assert "design: expected the sample time of the logs" in refused(periodic_logs(), design=slow)
    wide = excitation.references(tones, 3)
    assert "design: expected 2 axes as the logs, got 3" in refused(periodic_logs(), design=wide)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"estimator": "best"}, "estimator: expected one of"),
        ({"average": "median"}, "average: expected one of"),
        ({"quantity": "jerk"}, "quantity: expected one of"),
        ({"average": "harmonic", "estimator": "h1"}, "average: expected the estimator mfrf"),
        ({"estimator": "robust"}, "expected at least 2 realizations"),
        ({"axes": [3]}, "axes: expected numbers from 1 to 2, got 3"),
        ({"axes": [1, 1]}, "axes: expected each axis once"),
        ({"band_hz": (300.0, 400.0)}, "band_hz: expected excited lines between 300 and 400 Hz"),
        ({"band_hz": (5.0, 5.0)}, "band_hz: expected 0 <= LOW < HIGH"),
        ({"operating_point_rad": [0.0]}, "operating_point_rad: expected 2 angles, got 1"),
        ({"drop_periods": 9}, "expected to keep a period"),
    ],
)
def test_wrong_options(options: dict, words: str) -> None:
    assert words in refused(periodic_logs(), **options)


def test_a_robot_of_other_axes() -> None:
    robot = axisight.load_robot("irb6600_like")
    assert "axes as the logs, got" in refused(periodic_logs(), robot=robot)


def test_estimators_of_periods_need_one() -> None:
    x = np.random.default_rng(1).standard_normal((2, 1000, 2))
    logs = [log(f"e{e}", x[e], x[e] * 2) for e in range(2)]
    assert "for logs that do not repeat, got mfrf; give period_s" in refused(logs, estimator="mfrf")


@pytest.mark.parametrize("square", [False, True])
def test_two_experiments_of_three_axes_are_refused(square: bool) -> None:
    """Noise, friction and a square wave make torques differ between lines; the references do not excite all axes."""
    robot = axisight.load_robot("irb6600_like")
    friction = [axisight.Effect("coulomb_friction", a, {"coulomb_nm": 0.5}) for a in (1, 2, 3)]
    tones = excitation.multisine(1.0, robot.sample_time_s, band_hz=(2, 60), seed=3).scaled(peak=8)
    wave = excitation.square(1.0, robot.sample_time_s, amplitude=20.0) if square else None
    made = excitation.references(tones, 3, directions="t2", square=wave).repeated(4)[:2]
    run = axisight.simulate_batch(robot, made, effects=friction, noise_seed=0)
    logs = [
        log(
            f"e{e}",
            run["torque_cmd_nm"].values[e],
            run["position_rad"].values[e],
            made[e],
            robot.sample_time_s,
        )
        for e in range(2)
    ]
    with pytest.raises(InputError, match="at least 3 experiments for 3 axes"):
        response_of_logs(logs, robot=robot)
