"""Controllers that are not the stated ones, where only the motion is compared and targets were logged."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from test_speed_loop import positions

from axisight import Diagnosis, Effect, Log, Robot, diagnose
from axisight.gap.controller.speed_loop import other_controllers_of_targets
from gap_data import HELD, PLAN, bare_axis, logs_of, scattered

LOOP = bare_axis()
ANOTHER = {"relative_proportional": 0.3, "relative_integral": -0.2}


def recorded(effects: Sequence[Effect]) -> list[Log]:
    return logs_of(scattered(LOOP, 4), effects, PLAN | HELD)


def by_targets_alone(logs: Sequence[Log]) -> tuple[Robot, list[Log]]:
    """A law of targets without rates that gives the torques of ``logs``, and its logs.

    ``kp target`` is what the speed loop makes of the reference and its sum together.
    """
    kd, kp = 7.0, 180.0
    out = []
    for log in logs:
        rate = log.velocity_ref_rad_s
        assert rate is not None
        summed = (np.cumsum(rate, axis=0) - rate) * log.sample_time_s
        target = summed + kd / kp * rate
        out.append(replace(log, velocity_ref_rad_s=None, position_ref_rad=target))
    return positions(), out


def other_file(extra: str = "", tolerances: str = "") -> Robot:
    """The law of another machine: the gains of its file are off."""
    text = positions(extra, tolerances).toml
    law = "kp = [180.0]\nkd = [7.0]"
    assert law in text
    return Robot.from_toml(text.replace(law, "kp = [225.0]\nkd = [5.0]")).with_effects([])


def said_of(robot: Robot, logs: Sequence[Log]) -> Diagnosis:
    return diagnose(robot=robot, estimation=logs[:3], validation=logs[3:])


@pytest.mark.parametrize("with_rates", [True, False])
def test_gains_are_read_off_the_logs(with_rates: bool):
    """Exact: the law is linear in both gains. Written for positions the speed's is the second."""
    logs = recorded([] if not with_rates else [Effect("controller_gain", 1, ANOTHER)])
    robot = positions()
    if not with_rates:
        # Factors of 180 / 225 and 7 / 5.
        robot, logs = other_file(), by_targets_alone(logs)[1]
    (found,) = other_controllers_of_targets(robot, logs)
    assert (found.name, found.axis) == ("controller_gain", 1)
    wanted = (-0.2, 0.3) if with_rates else (-0.2, 0.4)
    values = [found.values[name].value for name in ANOTHER]
    np.testing.assert_allclose(values, wanted, atol=1e-6)
    assert "times the position and" in found.says


def test_stated_gains_are_no_others():
    robot, logs = by_targets_alone(recorded([]))
    assert other_controllers_of_targets(robot, logs) == ()


def test_laws_that_are_no_algebra_of_two_gains_tell_nothing():
    robot, logs = other_file(), by_targets_alone(recorded([]))[1]
    assert other_controllers_of_targets(robot, logs)
    assert other_controllers_of_targets(other_file("gravity_compensation = true\n"), logs) == ()
    assert other_controllers_of_targets(other_file("", "\n[tolerances]\nkp = 0.1\n"), logs) == ()
    slow = [replace(log, sample_time_s=2 * log.sample_time_s) for log in logs]
    assert other_controllers_of_targets(robot, slow) == ()
    assert other_controllers_of_targets(LOOP, logs) == ()
    bare = [replace(log, position_ref_rad=None) for log in logs]
    assert other_controllers_of_targets(robot, bare) == ()


def test_other_gains_are_named_and_make_none_of_a_gap_by_motion():
    said = said_of(positions(), recorded([Effect("controller_gain", 1, ANOTHER)]))
    assert (said.mode, said.verdict) == ("inverse_dynamics", "explained")
    (cause,) = said.causes
    assert (cause.label, cause.gap_reduction.high) == ("controller_gain@1", 0.0)
    assert "does not feel" in said.headline
    assert any("none of this gap" in check for check in said.checks)


def test_other_gains_stand_behind_what_the_motion_lacks():
    friction = Effect("coulomb_friction", 1, {"coulomb_nm": 3.0, "smoothing_rad_s": 0.05})
    gains = Effect("controller_gain", 1, {"relative_proportional": 0.3})
    said = said_of(positions(), recorded([gains, friction]))
    assert [c.label for c in said.causes] == ["coulomb_friction@1", "controller_gain@1"]
    assert said.causes[0].gap_reduction.value > 0.9
    assert said.causes[1].gap_reduction.high == 0.0
    assert "Adding Coulomb friction on axis 1 cuts" in said.headline


def test_a_torque_reported_too_large_is_one_cause():
    """Both gains off by a share and the torque constant by its inverse: the law tells it from inertias."""
    said = said_of(
        positions(), recorded([Effect("torque_sensor_gain", 1, {"relative_error": 0.15})])
    )
    assert said.mode == "inverse_dynamics"
    assert (said.verdict, said.equivalent) == ("explained", ())
    assert [c.label for c in said.causes] == ["torque_sensor_gain@1"]
    assert said.causes[0].parameters["relative_error"].value == pytest.approx(0.15, abs=0.005)
