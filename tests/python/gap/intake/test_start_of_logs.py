"""Logs of a loop that begin in motion."""

from __future__ import annotations

import numpy as np
import pytest

from axisight import Effect, Log, Settings, diagnose
from axisight.gap.intake.start_of_logs import first_rest_s, from_rest
from axisight.gap.prepare.log_start import begins
from axisight.gap.prepare.used_part import Used
from gap_data import bare_axis, log_of, logs_of, scattered

QUICK = Settings(bootstrap=50)
FRICTION = Effect("coulomb_friction", 1, {"coulomb_nm": 0.5, "smoothing_rad_s": 0.05})
STEP_S = bare_axis().sample_time_s
NOISE_RAD = bare_axis().position_noise_std
# Moves with rests, as a controller that goes from point to point makes them.
REST_S = (2.0, 3.0)


def moves(seconds: float = 8.0, scale: float = 1.0) -> np.ndarray:
    """A speed reference that is zero from the second to the third second."""
    time = STEP_S * np.arange(int(seconds / STEP_S))
    speed = scale * 20.0 * np.sin(2 * np.pi * 0.5 * time) * np.minimum(time, 1.0)
    later = scale * 25.0 * np.sin(2 * np.pi * 0.4 * (time - REST_S[1]))
    out = np.where(time < REST_S[0], speed, np.where(time < REST_S[1], 0.0, later))
    return out[:, None]


@pytest.fixture(scope="module")
def machine_logs() -> list[Log]:
    machine = scattered(bare_axis(), 3)
    return [
        log_of(machine, [FRICTION], moves(scale=scale), run)
        for run, scale in enumerate((1.0, 0.7, 1.2))
    ]


def test_a_start_at_rest_is_told_from_one_in_motion(machine_logs):
    for log in machine_logs:
        assert begins(log, NOISE_RAD) == "rest"
        assert begins(log.part(0.7), NOISE_RAD) == "motion"
        rest = first_rest_s(log.part(0.7))
        # Behind the half of a rest, once the machine has come to it.
        assert REST_S[0] + 0.09 - 0.7 <= rest <= REST_S[1] - 0.7
    # None is left where the rest lies behind the middle.
    assert first_rest_s(machine_logs[0].part(0.7, 3.3)) is None


def test_what_is_used_while_a_log_moves_begins_at_rest():
    still = np.zeros((int(1.5 / STEP_S), 1))
    reference = np.concatenate([still, moves(), still])
    log = log_of(scattered(bare_axis(), 3), [FRICTION], reference, 0)
    (moving,) = Used(moving=True).of(log)
    # A second before and after the motion is left out.
    assert moving.duration_s == pytest.approx(8.0 + 0.6, abs=0.25)
    one, two = Used(runs=True).of(log)
    assert two.duration_s == pytest.approx(5.0 + 0.6, abs=0.25)
    assert all(begins(part, NOISE_RAD) == "rest" for part in (moving, one, two))
    given = from_rest(bare_axis(), [one], [two], [])
    assert (given.estimation, given.validation, given.findings) == ([one], [two], ())


def test_logs_that_begin_at_rest_stay_as_they_are(machine_logs):
    found = from_rest(bare_axis(), machine_logs[:2], machine_logs[2:], [])
    assert found.estimation == machine_logs[:2] and not found.findings


def test_a_log_is_taken_from_where_it_stands(machine_logs):
    cut = [log.part(0.7) for log in machine_logs]
    found = diagnose(robot=bare_axis(), estimation=cut[:2], validation=cut[2:], settings=QUICK)
    assert found.mode == "closed_loop" and found.verdict == "explained"
    assert [(c.effect, c.axis) for c in found.causes] == [("coulomb_friction", 1)]
    value = found.causes[0].parameters["coulomb_nm"].value
    assert value == pytest.approx(0.5, rel=0.05)
    said = [f for f in found.findings if f.name == "begins_in_motion"]
    assert len(said) == 3 and all(f.severity == "flag" for f in said)


def test_the_users_own_simulation_is_cut_alike(machine_logs):
    cut = [log.part(0.7) for log in machine_logs]
    found = from_rest(bare_axis(), cut[:2], cut[2:], cut)
    for log, sim in zip([*found.estimation, *found.validation], found.simulated, strict=True):
        np.testing.assert_array_equal(log.position_rad, sim.position_rad)
        assert log.n_samples < cut[0].n_samples


def test_where_nothing_rests_and_too_little_is_left_torques_are_predicted_from_the_motion():
    machine = scattered(bare_axis(), 4)
    plan = {"one": ("multisine", 1), "two": ("multisine", 2), "three": ("multisine", 3)}
    logs = [log.part(1.3, 4.8) for log in logs_of(machine, [FRICTION], plan)]
    found = diagnose(robot=bare_axis(), estimation=logs[:2], validation=logs[2:], settings=QUICK)
    assert found.mode == "inverse_dynamics"
    (said,) = [f for f in found.findings if f.name == "begins_in_motion"]
    assert "one, two, three" in said.message
    assert "takes 1.89 s to forget how it began, more than half of 3.5 s" in said.message
