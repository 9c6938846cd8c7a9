"""Ripple with any number of harmonics: the sum of (8.2) in simulation, and its refusals."""

import numpy as np
import pytest

import axisight
from axisight.errors import InputError

CONSTANT = [(k + 0.5, 0.01 * k, 0.3 * k) for k in range(1, 8)]
PROPORTIONAL = [(18.0, 0.04, 0.2), (7.0, 0.03, -1.1), (3.0, 0.02, 2.0)]


def sines(harmonics, angle):
    return sum(a * np.sin(n * angle + phase) for n, a, phase in harmonics)


@pytest.fixture(scope="module")
def robot():
    return axisight.load_robot("irb6600_like")


def moved(robot, effects):
    time_s = np.arange(400) * robot.sample_time_s
    reference = np.outer(5 * np.sin(12 * time_s), np.ones(3))
    return axisight.simulate(robot, reference, effects=effects)


def test_torque_ripple_is_the_sum_of_its_harmonics(robot):
    effects = axisight.torque_ripple(2, constant_nm=CONSTANT, proportional=PROPORTIONAL)
    assert len(effects) == 3
    run = moved(robot, effects)
    angle, command = run["motor_position_rad"].values[:, 1], run["torque_cmd_nm"].values[:, 1]
    expected = sines(CONSTANT, angle) + command * sines(PROPORTIONAL, angle)
    # Closed form at the samples; rounding only.
    assert run["torque_disturbance_nm"].values[:, 1] == pytest.approx(expected, abs=1e-11)
    assert not run["torque_disturbance_nm"].values[:, [0, 2]].any()


def test_resolver_ripple_is_the_sum_of_its_harmonics(robot):
    harmonics = [(n, 1e-4, phase) for n, _, phase in CONSTANT]
    effects = axisight.resolver_ripple(1, harmonics)
    assert [e.label for e in effects] == ["resolver_ripple@1"] * 2
    run = moved(robot, effects)
    expected = sines(harmonics, run["motor_position_rad"].values[:, 0])
    assert run["position_disturbance_rad"].values[:, 0] == pytest.approx(expected, abs=1e-14)


def test_the_linear_robot_has_every_harmonic(robot):
    """Against the nonlinear robot in small motion, whose linearization is exact to second order."""
    effects = axisight.torque_ripple(1, proportional=PROPORTIONAL)
    time_s = np.arange(400) * robot.sample_time_s
    reference = np.outer(0.5 * np.sin(12 * time_s), [1.0, 0.0, 0.0])
    linear, full = (
        axisight.simulate(robot, reference, effects=effects, model=kind)
        for kind in ("linear", "nonlinear")
    )
    ripple = [run["torque_disturbance_nm"].values[:, 0] for run in (linear, full)]
    # All three harmonics act: without the last two, the ripple is another one by more than a tenth.
    scale = np.abs(ripple[1]).max()
    assert np.abs(ripple[0] - ripple[1]).max() < 0.02 * scale
    angle, command = (full[x].values[:, 0] for x in ("motor_position_rad", "torque_cmd_nm"))
    assert np.abs(command * sines(PROPORTIONAL[:1], angle) - ripple[1]).max() > 0.1 * scale


@pytest.mark.parametrize(
    ("harmonics", "message"),
    [
        ([], "expected at least one harmonic"),
        ([(0.0, 0.1, 0.0)], "order > 0"),
        ([(3.0, float("nan"), 0.0)], "all finite"),
        ([(3.0, 0.1)], "phase in rad"),
    ],
)
def test_wrong_tables_are_refused(harmonics, message):
    with pytest.raises(InputError, match=message):
        axisight.torque_ripple(1, constant_nm=harmonics)


def test_a_robot_keeps_all_its_harmonics(robot):
    effects = axisight.torque_ripple(2, constant_nm=CONSTANT, proportional=PROPORTIONAL)
    own = robot.with_effects(effects)
    assert list(own.effects) == effects
    ripple = [moved(*case)["torque_disturbance_nm"] for case in ((own, ()), (robot, effects))]
    assert ripple[0].identical(ripple[1])
