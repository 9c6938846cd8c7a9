"""Logs that creep or turn round where they begin: told from a rest, by positions or by a simulation."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from test_run_up import QUICK, SECONDS, WITHHELD, rigid_axis, run_up, waves

from axisight import Effect, Log, Robot, diagnose
from axisight.gap.intake import start_of_logs
from axisight.gap.intake.start_of_logs import from_rest
from axisight.gap.prepare.log_start import begins, run_up_is_better, torques_are_from_rest
from axisight.logs import RunUp
from gap_data import bare_axis, log_of, scattered

Array = NDArray[np.float64]

STEP_S = bare_axis().sample_time_s
NOISE_RAD = bare_axis().position_noise_std
# Of the largest speed of the references: one that is far above the noise, and one that is nothing.
CREEPS, STANDS = 0.02, 0.002
CREEP_S, CUT_S = 3.0, 2.0
# What that of the sensor is in the torque of an axis that stands.
TORQUE_NOISE_NM = 0.25


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


def with_a_second_axis(robot: Robot) -> Robot:
    """The same with a stiff axis at right angles on it that weighs next to nothing."""
    text = re.sub(r"\[\[effect\]\]\n(.+\n)+", "", robot.toml)
    head, tail = text.split("[controller]")
    second = head[head.index("[[joint]]") :].replace('"axis1"', '"axis2"')
    second = second.replace("axis = [0.0, 0.0, 1.0]", "axis = [1.0, 0.0, 0.0]")
    second = re.sub(r"^(stiffness|damping) = .*\n", "", second, flags=re.MULTILINE)
    second = second.replace("mass = 500.0", "mass = 1e-3")
    second = second.replace("inertia = [1130.0, 1130.0, 1130.0,", "inertia = [1e-3, 1e-3, 1e-3,")
    tail = re.sub(r"(kp|ki) = \[(.+)\]", r"\1 = [\2, \2]", tail)
    return Robot.from_toml(f"{head}{second}[controller]{tail}")


def beside_standing(log: Log, held_nm: float) -> Log:
    """A log with a second axis that stands, but for noise."""
    assert log.velocity_ref_rad_s is not None
    still = np.zeros_like(log.position_rad)
    noise = np.random.default_rng(3).standard_normal((2, *still.shape))
    return replace(
        log,
        position_rad=np.hstack([log.position_rad, NOISE_RAD * noise[0]]),
        torque_nm=np.hstack([log.torque_nm, held_nm + TORQUE_NOISE_NM * noise[1]]),
        velocity_ref_rad_s=np.hstack([log.velocity_ref_rad_s, still]),
        axis_kinds=("revolute", "revolute"),
    )


def runs_on(robot: Robot, log: Log) -> bool:
    """Whether a log is told to begin in motion, by a simulation from rest and one that is run up to it."""
    told = torques_are_from_rest(robot, [log])
    return not told and run_up_is_better(robot, log, run_up(robot, log))


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
    assert not runs_on(robot, log)
    found = from_rest(robot, [log], [log], [])
    assert found.estimation == [log] and not found.findings


def test_one_that_turns_round_is_run_up_to() -> None:
    robot = bare_axis()
    logs = turning_logs(robot, "none")
    assert {begins(x, NOISE_RAD) for x in logs} == {"open"}
    assert all(runs_on(robot, log) for log in logs)


@pytest.mark.parametrize("kind", ["step", "rise"])
def test_no_run_up_is_made_where_the_first_torque_is_that_of_a_rest(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = bare_axis()
    log = at_once(robot, kind, "none")
    assert torques_are_from_rest(robot, [log])
    assert not any(torques_are_from_rest(robot, [x]) for x in turning_logs(robot, "none"))

    def refused(*_args: object) -> Log:
        raise AssertionError("a run-up was made")

    monkeypatch.setattr(start_of_logs, "run_up_to", refused)
    assert from_rest(robot, [log], [log], []).estimation == [log]


def started(robot: Robot, withheld: str = "none", machine: Robot | None = None) -> list[Log]:
    """Four logs from rest at one pose, with references that begin with different steps."""
    time = STEP_S * np.arange(round(3.0 / STEP_S))
    return [
        log_of(
            scattered(robot, 3) if machine is None else machine,
            WITHHELD[withheld],
            (scale * np.cos(2 * np.pi * 3.0 * time))[:, None],
            run,
        )
        for run, scale in enumerate((6.0, -4.0, 2.0, 9.0))
    ]


def test_a_load_that_is_missing_is_no_motion() -> None:
    """Logs of one pose are off by one torque; with one that turns round among them they are no rest."""
    robot = bare_axis()
    logs = [replace(log, torque_nm=log.torque_nm + 3.0) for log in started(robot)]
    assert torques_are_from_rest(robot, logs)
    turning = replace(logs[0], torque_nm=logs[0].torque_nm + 4.0)
    assert not torques_are_from_rest(robot, [*logs, turning])
    # One motion recorded several times tells nothing: it could turn round each time.
    assert not torques_are_from_rest(robot, [logs[0]] * 4)


def test_a_loop_that_responds_late_is_no_motion() -> None:
    """A delay changes the first ten milliseconds of every log by another torque, but not the first samples."""
    robot = bare_axis()
    logs = started(robot, "input_delay")
    assert not all(torques_are_from_rest(robot, [log]) for log in logs)
    assert torques_are_from_rest(robot, logs)
    found = from_rest(robot, logs[:3], logs[3:], [])
    assert found.estimation == logs[:3] and not found.findings


def test_logs_that_turn_round_are_told_together() -> None:
    robot = bare_axis()
    assert not torques_are_from_rest(robot, turning_logs(robot, "none"))


@pytest.mark.parametrize("column", ["velocity_ref_rad_s", "torque_nm"])
def test_what_is_wrong_with_an_open_log_is_left_to_the_gate(column: str) -> None:
    """No simulation goes along it: it is taken as from rest, and refused by name later."""
    robot = bare_axis()
    log = at_once(robot, "step", "none")
    values = np.array(getattr(log, column))
    values[3] = np.nan
    broken = replace(log, **{column: values})
    assert begins(broken, NOISE_RAD) == "open"
    found = from_rest(robot, [broken], [broken], [])
    assert found.estimation == [broken] and not found.findings


# Larger than what turns the motor round, of torques with a deviation of 5 Nm.
LARGE = {
    "offset": Effect("torque_offset", 1, {"offset_nm": 2.0}),
    "friction": Effect("coulomb_friction", 1, {"coulomb_nm": 3.0}),
    "constant": Effect("torque_constant", 1, {"relative_error": -0.3}),
}


@pytest.mark.parametrize("missing", LARGE)
def test_what_is_missing_of_both_simulations_does_not_hide_that_it_turns_round(
    missing: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each log by itself: one that is told would do for all."""
    robot = bare_axis()
    monkeypatch.setitem(WITHHELD, missing, [LARGE[missing]])
    for log in turning_logs(robot, missing):
        assert begins(log, NOISE_RAD) == "open"
        assert runs_on(robot, log)
    for kind in ("step", "rise"):
        log = at_once(robot, kind, missing)
        assert not runs_on(robot, log)


@pytest.mark.parametrize("held_nm", [0.0, 0.5, 4.0])
def test_axes_that_stand_do_not_tell(held_nm: float) -> None:
    """One that nothing moves, its torque noise about a constant, beside one that turns round."""
    one = bare_axis()
    (turning, *_), stepping = turning_logs(one, "none"), at_once(one, "step", "none")
    two = with_a_second_axis(one)
    for log, better in ((turning, True), (stepping, False)):
        wide = beside_standing(log, held_nm)
        assert runs_on(two, wide) == better


@pytest.mark.parametrize("cut", [1, 2])
def test_a_sample_that_is_cut_off_is_a_sample(cut: int) -> None:
    """Half of one was none, and the last none of a run all of it."""
    robot = bare_axis()
    log = turning_logs(robot, "none")[0]
    found = run_up(robot, log)
    assert found.run_up is not None
    lead = found.lead - (log.n_samples - found.n_samples) + cut
    short = RunUp(
        position_rad=found.led("position_rad")[:lead],
        torque_nm=found.led("torque_nm")[:lead],
        velocity_ref_rad_s=found.led("velocity_ref_rad_s")[:lead],
    )
    rest = replace(log.part(cut * STEP_S), run_up=short, start_rad=found.start_rad)
    assert log.n_samples - rest.n_samples == cut
    # A sample beside a constant says nothing.
    assert not run_up_is_better(robot, log, rest)


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
