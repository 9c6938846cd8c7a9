"""Logs that creep or turn round where they begin: told from a rest, by positions or by a simulation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from axisight import Log, Robot, diagnose
from axisight.gap.beginning import begins, run_up_is_better
from axisight.gap.begun import from_rest
from gap_data import bare_axis, log_of, scattered
from test_gap_in_motion import QUICK, SECONDS, WITHHELD, rigid_axis, run_up, waves

Array = NDArray[np.float64]

STEP_S = bare_axis().sample_time_s
NOISE_RAD = bare_axis().position_noise_std
# Of the largest speed of the references: one that is far above the noise, and one that is nothing.
CREEPS, STANDS = 0.02, 0.002
CREEP_S, CUT_S = 3.0, 2.0


def creeping(robot: Robot, seed: int, share: float) -> Array:
    """References that creep along for three seconds, then wave."""
    after = waves(robot, seed, SECONDS)
    speed = share * np.abs(after).max()
    rises = np.minimum(np.arange(round(CREEP_S / STEP_S)) / 400, 1.0)
    return np.concatenate([speed * rises[:, None], after + speed])


def creeping_logs(robot: Robot, withheld: str, share: float = CREEPS) -> list[Log]:
    """Logs of a machine that begin while it creeps."""
    machine = scattered(robot, 3)
    return [
        log_of(machine, WITHHELD[withheld], creeping(robot, run, share), run).part(CUT_S)
        for run in range(3)
    ]


def turning_logs(robot: Robot, withheld: str) -> list[Log]:
    """Logs of a machine that begin where it turns round, a second after it began."""
    out = []
    for run in range(3):
        log = log_of(scattered(robot, 3), WITHHELD[withheld], waves(robot, run, SECONDS), run)
        # The mean speed over 3.5 ms, of noise of which a hundredth of the top speed is left.
        ahead = log.position_rad[7:, 0] - log.position_rad[:-7, 0]
        turns = np.flatnonzero(np.diff(np.sign(ahead))) + 4
        out.append(log.part(float(turns[turns * STEP_S > 1.0][0] * STEP_S)))
    return out


def at_once(robot: Robot, kind: str, withheld: str) -> Log:
    """A log from rest whose reference begins with a step, or rises as fast as a machine follows."""
    time = STEP_S * np.arange(round(6.0 / STEP_S))
    speed = {
        "step": 6.0 * np.cos(2 * np.pi * 3.0 * time),
        "rise": np.minimum(40.0 * time, 20.0) * np.cos(2 * np.pi * 0.3 * time),
    }[kind]
    return log_of(scattered(robot, 3), WITHHELD[withheld], speed[:, None], 0)


@pytest.mark.parametrize("robot", [bare_axis(), rigid_axis()], ids=["elastic", "rigid"])
def test_creeping_is_motion_and_standing_is_rest(robot: Robot) -> None:
    for withheld in ("none", "coulomb_friction"):
        assert {begins(x, NOISE_RAD) for x in creeping_logs(robot, withheld)} == {"motion"}
        still = creeping_logs(robot, withheld, STANDS)
        assert {begins(x, NOISE_RAD) for x in still} == {"rest"}


@pytest.mark.parametrize("samples", [1, 2, 4, 5, 6, 9, 17])
def test_a_few_samples_are_told_as_well_as_they_can_be(samples: int) -> None:
    log = at_once(bare_axis(), "step", "none")
    cut = {"time_s": log.time_s, "torque_nm": log.torque_nm, "position_rad": log.position_rad}
    moving = {name: values[4000 : 4000 + samples] for name, values in cut.items()}
    few = replace(log, velocity_ref_rad_s=None, **moving)
    assert begins(few, NOISE_RAD) == ("rest" if samples <= 4 else "motion")


@pytest.mark.parametrize("kind", ["step", "rise"])
@pytest.mark.parametrize("withheld", ["none", "coulomb_friction", "backlash", "input_delay"])
def test_a_step_from_rest_stays_one(kind: str, withheld: str) -> None:
    """Whatever is missing: a simulation that is run up to it is no better."""
    robot = bare_axis()
    log = at_once(robot, kind, withheld)
    assert begins(log, NOISE_RAD) == "open"
    assert not run_up_is_better(robot, log, run_up(robot, log))
    found = from_rest(robot, [log], [log], [])
    assert found.estimation == [log] and not found.findings


def test_one_that_turns_round_is_run_up_to() -> None:
    robot = bare_axis()
    logs = turning_logs(robot, "none")
    assert {begins(x, NOISE_RAD) for x in logs} == {"open"}
    assert all(run_up_is_better(robot, log, run_up(robot, log)) for log in logs)


def test_logs_that_leave_it_open_begin_as_those_beside_them() -> None:
    """One that rises from rest could be either: beside one that turns round it is run up to, too."""
    robot = bare_axis()
    (turning, *_), rising = turning_logs(robot, "none"), at_once(robot, "rise", "none")
    found = from_rest(robot, [rising], [turning], [])
    assert all(log.run_up is not None for log in (*found.estimation, *found.validation))


def test_what_no_simulation_is_run_up_to_is_taken_as_it_was() -> None:
    robot = bare_axis()
    short = [log.part(0.0, 3.0) for log in turning_logs(robot, "none")]
    found = from_rest(robot, short[:2], short[2:], [])
    assert found.estimation == short[:2] and not found.findings


@pytest.mark.parametrize(
    ("robot", "withheld"),
    [
        (bare_axis(), "none"),
        (bare_axis(), "backlash"),
        (rigid_axis(), "none"),
        (rigid_axis(), "coulomb_friction"),
    ],
)
@pytest.mark.parametrize("logged", [creeping_logs, turning_logs])
def test_what_is_withheld_is_named_all_the_same(
    logged: Callable[[Robot, str], list[Log]], robot: Robot, withheld: str
) -> None:
    """Simulated from rest most of these were unknown, and friction of the rigid axis that creeps another law."""
    logs = logged(robot, withheld)
    found = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:], settings=QUICK)
    assert found.mode == "closed_loop"
    assert found.verdict == ("none" if withheld == "none" else "explained")
    assert [c.effect for c in found.causes] == [e.name for e in WITHHELD[withheld]]
    for cause, effect in zip(found.causes, WITHHELD[withheld], strict=True):
        for parameter, value in effect.parameters.items():
            assert cause.parameters[parameter].value == pytest.approx(value, rel=0.03)
    assert [f.name for f in found.findings].count("begins_in_motion") == 3
