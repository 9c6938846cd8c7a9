"""Logs that begin in motion and never rest: simulated in the loop from an estimated beginning."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from axisight import Effect, Log, Robot, Settings, _core, diagnose, load_robot, simulate
from axisight.errors import InputError
from axisight.fitting import FitOptions, Weighting
from axisight.gap.controller.loop_decay import slowest_decay_1_s
from axisight.gap.facts.simulator_variant import AS_GIVEN
from axisight.gap.intake.start_of_logs import from_rest
from axisight.gap.prepare.run_up import FORGOTTEN, RUN_UP_S, NotRunUpError, run_up_to
from axisight.gap.simulator.closed_loop_runs import simulated_run
from axisight.gap.views.closed_loop import TRACKING_SPEED
from axisight.logs import RunUp
from gap_data import bare_axis, log_of, scattered

Array = NDArray[np.float64]

QUICK = Settings(bootstrap=50)
WITHHELD = {
    "none": [],
    "coulomb_friction": [Effect("coulomb_friction", 1, {"coulomb_nm": 0.5})],
    "backlash": [Effect("backlash", 1, {"half_width_rad": 3e-4})],
    "input_delay": [Effect("input_delay", 1, {"delay_s": 0.0015})],
}
# In mid-motion: no reference stands there.
CUT_S = 1.234
SECONDS = 9.0
CASCADE = '[controller]\nkind = "cascade"\nkv = [20.0]\nkp = [7.0]\nki = [70.0]\n'


def rigid_axis() -> Robot:
    """The two masses on a stiff shaft."""
    text = load_robot("two_mass_axis").toml
    rigid = re.sub(r"^(stiffness|damping) = .*\n", "", text, flags=re.MULTILINE)
    return Robot.from_toml(re.sub(r"\[\[effect\]\]\n(.+\n)+", "", rigid))


def cascaded_axis() -> Robot:
    """The same with a loop of position around that of speed."""
    text = rigid_axis().toml
    return Robot.from_toml(re.sub(r"\[controller\]\n(.+\n)+", CASCADE, text))


ROBOTS = {"elastic": bare_axis, "rigid": rigid_axis, "cascade": cascaded_axis}


def waves(robot: Robot, seed: int, seconds: float) -> Array:
    """References (n, n_axes) [rad/s] that never rest once they have faded in: slow turns and faster waves."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds / robot.sample_time_s)) * robot.sample_time_s

    def sines(low: float, high: float, count: int) -> Array:
        each = [
            np.sin(2 * np.pi * (np.outer(t, f) + rng.uniform(size=robot.n_axes)))
            for f in rng.uniform(low, high, (count, robot.n_axes))
        ]
        return np.sum(each, axis=0)

    fading = np.minimum(t / 0.5, 1.0)[:, None]
    return np.asarray((3.0 * sines(0.3, 12.0, 10) + 15.0 * sines(0.25, 0.5, 1)) * fading)


def whole_logs(robot: Robot, effects: list[Effect]) -> list[Log]:
    """Three logs of a machine, from rest."""
    return [log_of(robot, effects, waves(robot, run, SECONDS), run) for run in range(3)]


def logs_in_motion(robot: Robot, effects: list[Effect]) -> list[Log]:
    """The same, cut in mid-motion."""
    return [log.part(CUT_S) for log in whole_logs(robot, effects)]


def run_up(robot: Robot, log: Log) -> Log:
    return run_up_to(robot, (robot, robot.with_controller_speed(TRACKING_SPEED)), log)


def test_the_slowest_mode_is_that_of_a_run() -> None:
    """Oracle: the envelope of a simulated loop after a kick of its reference."""
    robot = bare_axis()
    kick = np.zeros((round(2.5 / robot.sample_time_s), 1))
    kick[:200] = 5.0
    moved = simulate(robot, kick, method="rk4")["torque_cmd_nm"].values[:, 0]
    first, second = (
        np.abs(moved[round(a / robot.sample_time_s) :][:400]).max() for a in (0.6, 1.6)
    )
    rate = slowest_decay_1_s(robot, np.zeros(1))
    # Peaks of half waves of 90 ms lie up to a tenth of a second apart.
    assert np.log(first / second) == pytest.approx(rate, rel=0.1)


@pytest.mark.parametrize("kind", ["p", "pi", "cascade"])
def test_a_stiff_loop_decays_as_its_polynomial_says(kind: str) -> None:
    """Oracle: roots of the continuous loop around one inertia, a hundred times slower than its samples."""
    robot = {"cascade": cascaded_axis, "pi": rigid_axis, "p": rigid_axis}[kind]()
    if kind == "p":
        robot = Robot.from_toml(
            robot.toml.replace("pi_velocity", "p_velocity").replace("ki = [180.0]\n", "")
        )
    values, gains = robot.parameters(), {k: float(v[0]) for k, v in robot.controller_gains.items()}
    inertia = 0.0121 + 1130.0 * float(robot.gear_ratio[0]) ** 2
    kp, ki, kv = gains["kp"], gains.get("ki", 0.0), gains.get("kv", 0.0)
    friction = values["axis1.viscous_friction"]
    polynomial = {
        "p": [inertia, friction + kp, 0.0],
        "pi": [inertia, friction + kp, ki],
        "cascade": [inertia, friction + kp, kp * kv + ki, ki * kv],
    }[kind]
    want = -np.roots(polynomial).real.max()
    assert slowest_decay_1_s(robot, np.zeros(1)) == pytest.approx(want, rel=0.05, abs=1e-6)


@pytest.mark.parametrize("name", ["elastic", "rigid", "cascade", "irb6600_like"])
def test_a_run_up_ends_in_the_motion_of_the_machine(name: str) -> None:
    """A simulator that is the machine has its torque and motion where the comparison begins, and stays on it.

    Without noise. What is left is a thousandth of the torque, a tenth of what errors of formulas count for.
    """
    robot = ROBOTS[name]() if name in ROBOTS else load_robot(name).with_effects([])
    quiet = Robot.from_toml(
        re.sub(r"position_noise_std = .*", "position_noise_std = 0.0", robot.toml)
    )
    quiet = quiet.with_effects([])
    log = logs_in_motion(quiet, [])[0]
    found = run_up(quiet, log)
    assert found.lead + found.n_samples == log.n_samples + round(RUN_UP_S / log.sample_time_s)
    size = log.torque_nm.std(axis=0)
    torque, position = simulated_run(quiet, AS_GIVEN, found)
    first = round(0.2 / log.sample_time_s)
    assert (np.abs(torque - found.torque_nm)[:first].max(axis=0) < 3e-3 * size).all()
    assert np.abs(position - found.position_rad).max() < 0.01
    kept = added_torque(quiet.with_controller_speed(TRACKING_SPEED), found)
    assert (np.abs(kept)[:first].max(axis=0) < 3e-3 * size).all()
    # Begun at rest where the log does, as a simulation without a run-up would be, it is nowhere near.
    bare = replace(found, run_up=None)
    torque, _ = simulated_run(quiet, AS_GIVEN, bare)
    assert (np.abs(torque - found.torque_nm)[:first].max(axis=0) > 0.1 * size).all()


def added_torque(tracking: Robot, log: Log) -> Array:
    """What the feedback that keeps a simulator on a log adds (n, n_axes) [Nm]."""
    record = log.led("position_rad"), log.led("torque_nm"), None, log.start_rad, log.lead
    flat = Weighting.flat(tracking.n_axes).core()
    logs = _core.SimulatedLogs(tracking.core, [record], flat, input="tracking", output="torque")
    at = logs.evaluate([], [], FitOptions())
    return at.residual.reshape(tracking.n_axes, -1).T


@pytest.mark.parametrize(
    ("name", "withheld"),
    [
        ("elastic", "none"),
        ("elastic", "coulomb_friction"),
        ("elastic", "backlash"),
        ("rigid", "none"),
        ("rigid", "coulomb_friction"),
        ("rigid", "input_delay"),
        ("cascade", "none"),
        ("cascade", "coulomb_friction"),
        ("cascade", "input_delay"),
    ],
)
def test_what_is_withheld_is_named_as_from_rest(name: str, withheld: str) -> None:
    robot, effects = ROBOTS[name](), WITHHELD[withheld]
    whole = whole_logs(scattered(robot, 3), effects)
    moving = [log.part(CUT_S) for log in whole]
    rest, found = (
        diagnose(robot=robot, estimation=logs[:2], validation=logs[2:], settings=QUICK)
        for logs in (whole, moving)
    )
    assert found.mode == rest.mode == "closed_loop"
    causes = [] if withheld == "none" else [(withheld, 1)]
    for verdict in (rest, found):
        assert (verdict.verdict == "none") == (withheld == "none")
        assert [(c.effect, c.axis) for c in verdict.causes] == causes
    for cause, effect in zip(found.causes, effects, strict=True):
        for parameter, value in effect.parameters.items():
            assert cause.parameters[parameter].value == pytest.approx(value, rel=0.03)
    said = [f for f in found.findings if f.name == "begins_in_motion"]
    assert [f.log for f in said] == ["run0", "run1", "run2"]
    assert all("run up from rest" in f.message for f in said)
    others = {f.name for f in found.findings} - {"begins_in_motion", "refit_worse"}
    assert not others and not [f for f in rest.findings if f.name == "begins_in_motion"]


def test_logs_that_are_too_short_are_compared_without_references() -> None:
    robot = bare_axis()
    short = [log.part(0.0, 3.0) for log in logs_in_motion(robot, [])]
    rate = min(
        slowest_decay_1_s(r, np.zeros(1))
        for r in (robot, robot.with_controller_speed(TRACKING_SPEED))
    )
    assert -np.log(FORGOTTEN) / rate > 1.5
    with pytest.raises(NotRunUpError, match=r"run0: the loop takes 1\.89 s to forget"):
        run_up(robot, short[0])
    found = from_rest(robot, short[:2], short[2:], [])
    assert all(log.velocity_ref_rad_s is None for log in found.estimation)
    (said,) = found.findings
    assert "the loop takes 1.89 s" in said.message and "without the references" in said.message


def test_a_loop_that_does_not_settle_is_not_run_up_to() -> None:
    robot = rigid_axis()
    (log, *_) = logs_in_motion(robot, [])
    loose = robot.with_controller_speed(1e3)
    assert slowest_decay_1_s(loose, np.zeros(1)) < 0
    with pytest.raises(NotRunUpError, match="does not settle"):
        run_up_to(robot, (robot, loose), log)


def test_the_users_own_simulation_is_cut_alike() -> None:
    robot = bare_axis()
    logs = logs_in_motion(scattered(robot, 3), WITHHELD["coulomb_friction"])
    own = [replace(log, name=f"own {log.name}") for log in logs_in_motion(robot, [])]
    found = diagnose(
        robot=robot, estimation=logs[:2], validation=logs[2:], simulated=own, settings=QUICK
    )
    assert found.simulator is not None and found.simulator.taken_off
    # Nothing but noise: the model is that simulator.
    assert found.simulator.of_gap.max() < 0.5 and not found.simulator.where
    assert [(c.effect, c.axis) for c in found.causes] == [("coulomb_friction", 1)]


def test_only_the_whole_beginning_has_a_run_up() -> None:
    robot = rigid_axis()
    found = run_up(robot, logs_in_motion(robot, [])[0])
    assert found.run_up is not None and found.part(0.0, 2.0).run_up is found.run_up
    assert found.part(1.0).run_up is None and found.part(1.0).lead == 0
    with pytest.raises(InputError, match=r"run_up: expected shape \(m, 1\), got \(5, 2\)"):
        two = np.zeros((5, 2))
        replace(found, run_up=RunUp(position_rad=two, torque_nm=two, velocity_ref_rad_s=two))
    with pytest.raises(InputError, match=r"run_up.torque_nm: expected shape \(5, 2\)"):
        RunUp(position_rad=two, torque_nm=two[:4], velocity_ref_rad_s=two)
    with pytest.raises(InputError, match=r"position_rad: expected shape \(m, axes\)"):
        RunUp(position_rad=two[0], torque_nm=two[0], velocity_ref_rad_s=two[0])
