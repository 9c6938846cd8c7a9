"""Torque limits that logs show by themselves."""

from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect
from axisight.gap.controller.torque_limits import missing, reported, torque_limits
from gap_data import HELD, PLAN, bare_axis, logs_of, scattered

LIMIT = 4.0


def cut(logs, limit: float = LIMIT):
    return [replace(x, torque_nm=np.clip(x.torque_nm, -limit, limit)) for x in logs]


def limited(plan):
    machine = scattered(bare_axis(), 4)
    return logs_of(machine, [Effect("torque_saturation", 1, {"limit_nm": LIMIT})], plan)


def test_a_limit_is_found_with_its_level_and_how_often_it_was_met():
    logs = cut(limited(PLAN))
    (found,) = torque_limits(bare_axis(), logs)
    assert found.axis == 1
    assert found.values["limit_nm"].value == pytest.approx(LIMIT, rel=1e-12)
    at_top = sum(int((np.abs(x.torque_nm) == LIMIT).sum()) for x in logs)
    # Single samples at the limit are not counted.
    assert 0.9 * at_top < found.samples <= at_top
    assert found.explained > 0.99


def test_no_limit_where_none_is_met():
    assert torque_limits(bare_axis(), logs_of(scattered(bare_axis(), 4), [], PLAN)) == ()


def test_a_torque_reported_before_the_limit_shows_none():
    assert torque_limits(bare_axis(), limited(PLAN)) == ()


def test_flat_tops_that_the_controller_asked_for_are_no_limit():
    """A log cut after the fact, of a machine that was not: the law does not hold elsewhere either."""
    robot = bare_axis()
    logs = logs_of(scattered(robot, 4), [], PLAN)
    flat = [
        replace(
            x,
            torque_nm=np.where(
                np.arange(x.n_samples)[:, None] % 997 < 30, LIMIT, 0.3 * x.torque_nm
            ),
        )
        for x in logs
    ]
    assert torque_limits(robot, flat) == ()


def test_a_limit_that_the_simulator_has_is_not_missing():
    robot = bare_axis()
    found = torque_limits(robot, cut(limited(HELD)))
    assert missing(found, robot) == found
    own = Effect("torque_saturation", 1, {"limit_nm": LIMIT})
    assert missing(found, robot.with_effects([own])) == ()
    other = Effect("torque_saturation", 1, {"limit_nm": 2 * LIMIT})
    assert missing(found, robot.with_effects([other])) == found


def test_simulated_commands_are_cut_as_the_drive_reports_them():
    found = torque_limits(bare_axis(), cut(limited(HELD)))
    command = np.array([[-9.0], [1.0], [5.0]])
    effect = Effect("torque_saturation", 1, {"limit_nm": 3.0})
    np.testing.assert_array_equal(reported(command, found, [effect]), [[-3.0], [1.0], [3.0]])
    # A drive that reports the command before its limit is not cut.
    np.testing.assert_array_equal(reported(command, (), [effect]), command)
    np.testing.assert_array_equal(reported(command, found, []), command)
