"""Signals that begin and end in motion: their curvature goes on beyond the ends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_rotor_inertia import arm, logs_of

from axisight import Robot, Settings, diagnose
from axisight.gap import check_inputs
from axisight.logs import differentiate, lowpass

STEP_S = 0.01
TIME = STEP_S * np.arange(1500)


@pytest.mark.parametrize("shape", [(1500,), (1500, 2)])
def test_a_parabola_is_its_own_extension(shape: tuple[int, ...]):
    """The filter leaves cubics as they are (its gain is flat to the seventh derivative)."""
    x = np.broadcast_to(
        (2.0 - 3.0 * TIME + 0.7 * TIME**2).reshape(-1, *[1] * (len(shape) - 1)), shape
    )
    np.testing.assert_allclose(lowpass(x, STEP_S, 8.0, curved=True), x, atol=1e-9)
    _, acceleration = differentiate(x, STEP_S, 8.0, curved=True)
    np.testing.assert_allclose(acceleration, 1.4, atol=1e-5)
    # Without, a signal that bends at its end is off there by what it bends.
    assert np.abs(differentiate(x, STEP_S, 8.0)[1][:20] - 1.4).max() > 1.0


def test_ends_of_a_sine_are_nearly_as_good_as_its_middle():
    """Three per cent of its acceleration at most, within a period of the cutoff; it was half of it."""
    x = np.sin(2 * TIME + 0.7) + 0.3 * np.sin(5 * TIME)
    wanted = -4 * np.sin(2 * TIME + 0.7) - 7.5 * np.sin(5 * TIME)
    largest = np.abs(wanted).max()
    for curved, share in ((True, 0.03), (False, 0.4)):
        off = np.abs(differentiate(x, STEP_S, 8.0, curved=curved)[1] - wanted) / largest
        ends = max(off[:50].max(), off[-50:].max())
        assert (ends < share) == curved
        assert off[300:-300].max() < 1e-3


def test_the_middle_is_the_same():
    x = np.random.default_rng(0).normal(size=(1500, 2))
    both = [lowpass(x, STEP_S, 8.0, curved=curved) for curved in (False, True)]
    np.testing.assert_allclose(both[0][300:-300], both[1][300:-300], atol=1e-9)


def test_a_complete_simulator_of_logs_in_motion_lacks_nothing(tmp_path):
    """By inverse dynamics such logs came out as unknown: filters bent their ends."""
    robot = arm(tmp_path)
    logs = logs_of(robot, np.zeros(2))
    assert np.abs(np.gradient(logs[0].position_rad[:, 0], STEP_S)[[0, -1]]).min() > 0.1
    # A low cutoff has long ends: without their curvature the gap was 1.6 times the floor.
    found = diagnose(
        robot=robot, estimation=logs[:2], validation=logs[2:], settings=Settings(cutoff_hz=5.0)
    )
    assert found.verdict == "none"
    assert found.gap.pooled.before < 1.3 * found.gap.pooled.floor


def test_a_robot_without_a_controller_has_no_rate_of_its_own(tmp_path):
    """An imported robot file says 1 ms where nothing else is known; its logs come at 10 ms."""
    robot = Robot.from_toml(arm(tmp_path).toml.replace("sample_time = 0.01", "sample_time = 0.001"))
    logs = logs_of(robot, np.zeros(2))
    assert robot.sample_time_s == 0.001
    assert check_inputs(robot, logs[:2], logs[2:]) == ()
    slower = replace(logs[2], sample_time_s=0.02, time_s=2 * logs[2].time_s)
    (fault,) = check_inputs(robot, logs[:2], [slower])
    assert fault.name == "sample_time_differs"
