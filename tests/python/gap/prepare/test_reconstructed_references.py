"""References that were not logged: found from torque and position by the law of the controller."""

import re
from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect, Log, diagnose, load_robot, simulate
from axisight.gap.prepare import reconstructed_references
from axisight.gap.prepare.reconstructed_references import (
    SAYS,
    _has_every_sample,
    reference_of,
    with_references,
)
from gap_data import HELD, PLAN, bare_axis, log_of, logs_of, reference, scattered

FRICTION = Effect("coulomb_friction", 1, {"coulomb_nm": 0.5, "smoothing_rad_s": 0.1})


def without(logs: list[Log]) -> list[Log]:
    return [replace(log, velocity_ref_rad_s=None) for log in logs]


@pytest.mark.parametrize("arm", ["two_mass_axis", "irb6600_like"])
def test_references_are_those_of_the_machine(arm: str):
    """An identity: whatever the machine, its controller saw them."""
    robot = load_robot(arm).with_effects([])
    machine = scattered(robot, 3)
    time = np.arange(2000) * robot.sample_time_s
    wave = 20.0 * np.sin(2 * np.pi * np.outer(time, 0.5 + np.arange(robot.n_axes)))
    log = log_of(machine, [FRICTION], wave, 0)
    found = reference_of(robot, log)
    np.testing.assert_allclose(found, wave, atol=1e-8 * np.abs(wave).max())


def test_a_first_step_of_a_reference_is_told_from_a_load():
    robot = load_robot("irb6600_like").with_effects([])
    wave = np.full((1000, 3), 5.0)
    found = reference_of(robot, log_of(scattered(robot, 3), [], wave, 0))
    # What holds the machine is off by a per cent or two of its weight; forgotten with time.
    assert np.abs(found - wave).max() < 0.05 * 5.0
    np.testing.assert_allclose(found[-1], wave[-1], atol=1e-3)
    load = Effect("torque_offset", 2, {"offset_nm": 0.3})
    slow = 4.0 * wave * np.sin(np.arange(1000) / 200.0)[:, None]
    np.testing.assert_allclose(reference_of(robot, log_of(robot, [load], slow, 0)), slow, atol=1e-8)


def test_a_cascade_has_its_own_law(tmp_path):
    text = bare_axis().toml.replace('"pi_velocity"', '"cascade"')
    text = re.sub(r"(?m)^ki = .*$", r"\g<0>\nkv = [20.0]", text)
    path = tmp_path / "cascade.toml"
    path.write_text(text)
    robot = load_robot(path)
    wave = reference("moves", 1, 2000, robot.sample_time_s)
    found = reference_of(robot, log_of(scattered(robot, 3), [FRICTION], wave, 0))
    # Noise of the first position is a way to go for the controller, and none for whoever reads the log.
    np.testing.assert_allclose(found, wave, atol=20.0 * 5 * robot.position_noise_std)


def test_what_another_controller_commanded_has_no_reference():
    robot = bare_axis()
    other = robot.with_controller_speed(1.5)
    logs = without(logs_of(other, [], PLAN, seconds=2.0))
    assert with_references(robot, logs) is None
    assert with_references(other, logs) is not None


def test_rigid_robots_and_logs_with_references_stay_as_they_are(monkeypatch):
    logs = logs_of(bare_axis(), [], PLAN, seconds=2.0)
    assert with_references(bare_axis(), without(logs)) is not None
    assert with_references(bare_axis(), logs) is None
    assert with_references(bare_axis(), [*without(logs[:1]), *logs[1:]]) is None
    monkeypatch.setattr(reconstructed_references, "rigid_below_hz", lambda _: np.inf)
    assert with_references(bare_axis(), without(logs)) is None


def test_a_log_of_every_tenth_sample_has_none():
    robot = bare_axis()
    wave = reference("moves", 0, 6000, robot.sample_time_s)
    data = simulate(robot, wave)
    (bare,) = without([log_of(robot, [], wave, 0)])
    torque, position = data.torque_cmd_nm.values, data.position_rad.values
    every = replace(bare, torque_nm=torque, position_rad=position)
    few = replace(
        every,
        sample_time_s=10 * every.sample_time_s,
        time_s=every.time_s[::10],
        torque_nm=every.torque_nm[::10],
        position_rad=every.position_rad[::10],
    )
    # Without noise of its own, a log has the stated one.
    assert with_references(robot, [every]) is not None
    assert with_references(robot, [few]) is None
    assert _has_every_sample(every, robot) and not _has_every_sample(few, robot)


def test_a_log_that_begins_in_motion_has_none():
    logs = without(logs_of(bare_axis(), [], PLAN, seconds=2.0))
    assert with_references(bare_axis(), logs) is not None
    at = int(np.argmax(np.abs(np.diff(logs[-1].position_rad[:, 0]))))
    cut = replace(
        logs[-1],
        time_s=logs[-1].time_s[at:],
        torque_nm=logs[-1].torque_nm[at:],
        position_rad=logs[-1].position_rad[at:],
    )
    assert with_references(bare_axis(), [*logs[:-1], cut]) is None


def test_the_verdict_is_that_with_references():
    robot, machine = bare_axis(), scattered(bare_axis(), 4)
    fit, held = logs_of(machine, [FRICTION], PLAN), logs_of(machine, [FRICTION], HELD)
    known = diagnose(robot=robot, estimation=fit, validation=held)
    found = diagnose(robot=robot, estimation=without(fit), validation=without(held))
    assert known.mode == found.mode == "closed_loop"
    assert [c.label for c in found.causes] == [c.label for c in known.causes]
    assert found.causes[0].label == "coulomb_friction@1"
    value, same = (d.causes[0].parameters["coulomb_nm"].value for d in (found, known))
    assert value == pytest.approx(same, rel=1e-3)
    assert SAYS in found.checks and SAYS not in known.checks
    assert found.provenance["references"] == "recovered"
    assert known.provenance["references"] == "logged"
