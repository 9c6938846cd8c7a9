"""The withheld-effect benchmark: another engine, draws, seals, scores."""

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import scipy.stats
from typer.testing import CliRunner

from axisight import Effect, InputError, Robot, load_robot, simulate
from axisight.blind import (
    Judged,
    Share,
    calibration_error,
    figures,
    judged_cases,
    make,
    mujoco_engine,
    pinocchio_engine,
)
from axisight.blind.case_files import CaseFolder
from axisight.blind.drawing import (
    ENGINES,
    ON_REQUEST,
    Choice,
    circumstances,
    draw,
    machine_of,
    scattered,
)
from axisight.blind.formulas import (
    ConstantTorque,
    DelayLine,
    Formula,
    ResonantLoop,
    RunOut,
    StaleSensor,
)
from axisight.blind.laws import Axis, Delay, ExponentialStribeck, Law, MaxwellSlip
from axisight.blind.machine import Machine, Native
from axisight.blind.make import _in_steps, _noise, make_cases
from axisight.blind.motions import MOTIONS, multisines, point_to_point
from axisight.blind.scene import Scene
from axisight.blind.score import _missed, _said, comparable, sizes
from axisight.blind.sealed import SEAL
from axisight.cli import app

IRB = "irb6600_like"


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot(IRB).with_effects([])


RUN = {"mujoco": mujoco_engine.run, "pinocchio": pinocchio_engine.run}
# In which every kind of gap shows in the torque, but those that come late [s].
LOOK_S = 0.5
EVERY = {engine: {**kinds, **ON_REQUEST[engine]} for engine, kinds in ENGINES.items()}
KINDS = [(engine, name) for engine, kinds in EVERY.items() for name in kinds]


@cache
def multisine(name: str) -> np.ndarray:
    """A multisine on all axes of a preset, (n, n_axes)."""
    _, reference = multisines(np.random.default_rng(3), load_robot(name))["multisine_fresh"]
    reference.flags.writeable = False
    return reference


def short(preset: str, seconds: float = 1.0) -> np.ndarray:
    """Its first ``seconds``."""
    return multisine(preset)[: round(seconds / load_robot(preset).sample_time_s)]


def torque_of(engine: str, machine: Machine, reference: np.ndarray) -> np.ndarray:
    """Torque (n, n_axes) without noise."""
    ((torque, _),) = RUN[engine](machine, [reference], [np.zeros_like(reference)])
    return torque


@cache
def bare_torque(engine: str) -> np.ndarray:
    """Torque of the preset without effects along the reference that all kinds are tried on."""
    robot = load_robot(IRB)
    return torque_of(engine, Machine(robot), 1.5 * short(IRB, LOOK_S))


# MuJoCo holds a mass of a milligram in bodies that have none, and settles before it begins: its slowest
# mode has a tenth of that as its time constant. Else all take Runge-Kutta steps of order four: the other
# engines two a sample, of which what is left is the error (fifth power of 0.1 and less at the modes).
@pytest.mark.parametrize(
    ("engine", "arm", "apart"),
    [
        ("mujoco", "irb6600_like", 1e-3),
        ("pinocchio", "irb6600_like", 1e-5),
        ("mujoco", "scara_like", 1e-5),
        ("pinocchio", "scara_like", 1e-5),
        ("mujoco", "cobot_like", 1e-4),
        ("pinocchio", "cobot_like", 1e-4),
        ("pinocchio", "lever_like", 1e-5),
    ],
)
def test_without_effects_the_other_engines_agree_with_ours(engine: str, arm: str, apart: float):
    machine = scattered(np.random.default_rng(1), load_robot(arm))
    reference = short(arm)
    ((torque, angle),) = RUN[engine](Machine(machine), [reference], [np.zeros_like(reference)])
    ours = simulate(machine, reference)
    spread = np.std(ours["torque_cmd_nm"].values, axis=0)
    assert (np.abs(torque - ours["torque_cmd_nm"].values).max(axis=0) / spread < apart).all()
    moved = angle - angle[0] - (ours["position_rad"].values - ours["position_rad"].values[0])
    assert np.abs(moved).max() < 0.1 * apart


@pytest.mark.parametrize(("engine", "name"), KINDS)
def test_every_kind_changes_the_torque(engine: str, name: str, robot: Robot):
    reference = 1.5 * short(IRB, LOOK_S)
    kind, scene = EVERY[engine][name], Scene(robot, [reference])
    axes = kind.axes(scene)
    drawn = kind.draw(np.random.default_rng(5), scene, 2 if 2 in axes else axes[0])
    bare = bare_torque(engine)
    changed = torque_of(engine, machine_of(robot, [drawn]), reference)
    late = name in ("friction_step", "push")
    assert (np.abs(changed - bare).max() > 0.01) != late
    for law in drawn.laws if late else ():
        # They come after the first second; here, at once.
        law.from_s = 0.1
    if late:
        changed = torque_of(engine, machine_of(robot, [drawn]), reference)
        assert np.abs(changed - bare).max() > 0.01


@pytest.mark.parametrize(
    ("native", "laws", "ours"),
    [
        (Native(lag_s=6.2e-4), [], Effect("actuator_bandwidth", 1, {"time_constant_s": 6.2e-4})),
        (
            Native(),
            [ResonantLoop(1e-3, 0.4)],
            Effect("current_loop", 1, {"time_constant_s": 1e-3, "damping": 0.4}),
        ),
        (Native(), [DelayLine(1.2e-3)], Effect("input_delay", 1, {"delay_s": 1.2e-3})),
        (Native(), [StaleSensor(3)], Effect("sensor_delay", 1, {"delay_s": 1.5e-3})),
        (Native(), [ConstantTorque(0.4)], Effect("torque_offset", 1, {"offset_nm": 0.4})),
        (Native(gear=0.05), [], Effect("torque_constant", 1, {"relative_error": 0.05})),
        (Native(spring=-0.2), [], Effect("joint_stiffness", 1, {"relative_change": -0.2})),
        (Native(armature=0.2), [], Effect("motor_inertia", 1, {"relative_change": 0.2})),
        (
            Native(longer_m=(0.03, -0.02, 0.04)),
            [],
            Effect("link_geometry", 1, {"x_m": 0.03, "y_m": -0.02, "z_m": 0.04}),
        ),
        (Native(damper=0.7), [], Effect("joint_damping", 1, {"relative_change": 0.7})),
        (Native(turns_next=0.1), [], Effect("axis_coupling", None, {"share": 0.1}, (1, 2))),
        (
            Native(),
            [RunOut(0.1, 0.4)],
            Effect(
                "encoder_eccentricity",
                1,
                {"cosine_rad": 0.1 * np.sin(0.4), "sine_rad": 0.1 * np.cos(0.4)},
            ),
        ),
        (
            Native(kp=0.1, ki=-0.2),
            [],
            Effect(
                "controller_gain",
                1,
                {"relative_proportional": 0.1, "relative_integral": -0.2},
            ),
        ),
        (
            Native(for_rate=5e-3, for_speed=7e-3),
            [],
            Effect(
                "feedforward_missing",
                1,
                {"acceleration_nm_s2_rad": 5e-3, "speed_nm_s_rad": 7e-3},
            ),
        ),
    ],
)
def test_what_has_one_formula_only_is_what_ours_is(
    native: Native, laws: list[Formula], ours: Effect, robot: Robot
):
    reference = short(IRB, 0.5)
    machine = Machine(robot, {0: native}, laws={0: laws})
    torque = torque_of("pinocchio", machine, reference)
    expected = simulate(robot, reference, effects=[ours])["torque_cmd_nm"].values
    bare = simulate(robot, reference)["torque_cmd_nm"].values
    size = np.sqrt(np.mean((expected - bare)[:, 0] ** 2))
    # It settles for a second before, ours for ever: a hundredth of an offset is still to come.
    assert np.sqrt(np.mean((torque - expected)[:, 0] ** 2)) < 0.02 * size


@pytest.mark.parametrize("engine", sorted(RUN))
def test_a_machine_with_a_fast_clock_is_ours(engine: str, robot: Robot):
    reference = short(IRB, 0.5)
    fast = Effect("clock_drift", None, {"relative_rate": 8e-3})
    torque = torque_of(engine, Machine(robot, fast=8e-3), reference)
    expected = simulate(robot, reference, effects=[fast])["torque_cmd_nm"].values
    bare = simulate(robot, reference)["torque_cmd_nm"].values
    # Splines against lines between samples, and half a step of the engine.
    off, size = (np.sqrt(np.mean((x - expected) ** 2)) for x in (torque, bare))
    assert off < 0.1 * size


@pytest.mark.parametrize("engine", sorted(RUN))
def test_a_gear_that_is_turned_along_is_ours_in_every_engine(engine: str, robot: Robot):
    reference = short(IRB, 0.5)
    coupled = Effect("axis_coupling", None, {"share": 0.1}, (2, 3))
    torque = torque_of(engine, Machine(robot, {1: Native(turns_next=0.1)}), reference)
    expected = simulate(robot, reference, effects=[coupled])["torque_cmd_nm"].values
    bare = simulate(robot, reference)["torque_cmd_nm"].values
    off, size = (np.sqrt(np.mean((x - expected) ** 2)) for x in (torque, bare))
    assert off < 0.1 * size


def test_runs_of_a_machine_do_not_feel_one_another(robot: Robot):
    reference = short(IRB, 0.2)
    others = [0.5 * reference, reference, -reference]
    drawn = ENGINES["pinocchio"]["coulomb_friction"].draw(
        np.random.default_rng(5), Scene(robot, others), 1
    )
    machine = machine_of(robot, [drawn])
    together = RUN["pinocchio"](machine, others, [np.zeros_like(reference)] * 3)
    np.testing.assert_array_equal(together[1][0], torque_of("pinocchio", machine, reference))
    assert np.abs(together[1][0] - together[0][0]).max() > 0.1


def test_an_engine_refuses_what_it_has_no_formula_for(robot: Robot):
    reference = short(IRB, 0.1)
    with pytest.raises(InputError, match="play and dry friction as formulas"):
        torque_of("pinocchio", Machine(robot, {0: Native(friction_nm=0.3)}), reference)
    with pytest.raises(InputError, match="expected a Formula of this engine, got Delay"):
        torque_of("pinocchio", Machine(robot, laws={0: [Delay(1e-3)]}), reference)


def test_a_case_is_a_function_of_seed_and_number():
    fixed = Choice("pinocchio", "irb6600_like", "multisines")
    a, b, c = draw(1, 7, fixed), draw(1, 7, fixed), draw(1, 9, fixed)
    assert [(e.effect, e.axis, e.parameters) for e in a.effects] == [
        (e.effect, e.axis, e.parameters) for e in b.effects
    ]
    assert a.machine.robot.parameters() == b.machine.robot.parameters()
    assert a.machine.robot.parameters() != c.machine.robot.parameters()
    for name, (role, reference) in a.references.items():
        assert b.references[name][0] == role
        np.testing.assert_array_equal(b.references[name][1], reference)
    assert draw(1, 8).effects == ()
    pairs = [draw(1, number).effects for number in range(1, 60, 6)]
    assert all(len({e.axis for e in pair}) == len(pair) for pair in pairs)
    assert any(len(pair) == 2 for pair in pairs)


def test_some_logs_have_no_references_and_some_torques_steps(tmp_path: Path):
    drawn = [draw(0, n, Choice(arm="lever_like", motions="slow_and_short")) for n in range(32)]
    bare = [d for d in drawn if not d.referenced]
    assert 0 < len(bare) < 16
    assert not {e.effect for d in bare for e in d.effects} & {"controller_gain", "clock_drift"}
    stepped = [d for d in drawn if d.bits is not None]
    assert 0 < len(stepped) < 16 and all(12 <= d.bits <= 15 for d in stepped)
    torque = np.random.default_rng(0).uniform(-5, 5, (1000, 1))
    rounded = _in_steps(torque, np.array([5.0]), 12)
    step = 20.0 / 2**12
    np.testing.assert_allclose(rounded / step, np.round(rounded / step), atol=1e-9)
    assert np.abs(rounded - torque).max() <= step / 2 * (1 + 1e-9)
    assert _in_steps(torque, np.array([5.0]), None) is torque
    case = CaseFolder(tmp_path, "x")
    case.add("moves", "estimation", np.arange(3.0), None, torque[:3], torque[:3])
    columns = pd.read_parquet(tmp_path / "logs" / "moves.parquet").columns
    assert list(columns) == ["time_s", "torque_cmd_1", "position_1"]


def test_noise_of_some_sensors_is_coloured_and_as_large():
    drawn = [draw(3, n, Choice(arm="lever_like", motions="slow_and_short")) for n in range(12)]
    coloured = [d for d in drawn if d.corner_hz is not None]
    assert 0 < len(coloured) < len(drawn) and all(300 < d.corner_hz < 800 for d in coloured)
    for d in (coloured[0], next(d for d in drawn if d.corner_hz is None)):
        x = _noise(np.random.default_rng(1), d, (40000, 1))[:, 0]
        keep = 0.0
        if d.corner_hz is not None:
            keep = np.exp(-2 * np.pi * d.corner_hz * d.robot.sample_time_s)
        # 40,000 samples: variances and correlations to 1 %, five deviations of each.
        assert x.std() / d.robot.position_noise_std == pytest.approx(1.0, abs=0.05)
        assert np.mean(x[1:] * x[:-1]) / x.var() == pytest.approx(keep, abs=0.05)


def test_engines_arms_and_motions_are_drawn_unless_they_are_chosen():
    engines, arms, motions = map(set, zip(*(circumstances(2, n) for n in range(60)), strict=True))
    assert engines == set(ENGINES)
    assert motions == set(MOTIONS)
    assert arms == {"irb6600_like", "scara_like", "lever_like", "cobot_like"}
    one = draw(2, 3)
    assert (one.engine, one.arm, one.motions) == circumstances(2, 3)
    chosen = Choice(arm="lever_like")
    assert circumstances(2, 3, chosen) == (one.engine, "lever_like", one.motions)
    with pytest.raises(InputError, match="arm: expected one of irb6600_like, "):
        Choice(arm="nothing")


def test_a_chosen_effect_is_withheld_alone_in_every_case():
    cases = [draw(5, n, Choice(effect="viscous_asymmetry")) for n in range(6)]
    assert {(e.effect, len(d.effects)) for d in cases for e in d.effects} == {
        ("viscous_asymmetry", 1)
    }
    # One that every engine has, or that the chosen engine has.
    Choice(engine="mujoco", effect="cubic_damper")
    for engine in (None, "pinocchio"):
        with pytest.raises(InputError, match="effect: expected one of coulomb_friction, "):
            Choice(engine=engine, effect="cubic_damper")
    # A lever hangs on its only axis, and a deadband shows without weight only.
    with pytest.raises(InputError, match="effect: expected one that shows on an axis of"):
        draw(5, 0, Choice(arm="lever_like", effect="torque_deadband"))


def test_seeds_keep_their_draws():
    """Cases of published benchmarks can be made again; another name in `ENGINES` would change all of them."""
    drawn = {n: draw(189, n) for n in (2, 10, 13, 18, 19)}
    assert {
        n: (d.engine, d.arm, *(f"{e.effect}@{e.axis}" for e in d.effects)) for n, d in drawn.items()
    } == {
        2: ("mujoco", "irb6600_like", "outside_tone@3"),
        10: ("mujoco", "irb6600_like", "asymmetric_friction@1"),
        13: ("mujoco", "irb6600_like", "joint_stiffness@2", "resolver_ripple@1"),
        18: ("mujoco", "scara_like", "presliding_friction@2"),
        19: ("pinocchio", "irb6600_like", "coulomb_friction@3", "link_com@1"),
    }
    (uneven,) = drawn[10].effects
    assert uneven.parameters["forward_nm"] == pytest.approx(0.250308, abs=1e-6)


def at(motor_speed: float = 0.0, deflection: float = 0.0) -> Axis:
    return Axis(0.0, deflection / 0.004, motor_speed, 0.0, 0.0, 0.004, 0.0)


def test_friction_takes_energy():
    law = ExponentialStribeck(0.4, 0.7, 3.0, 0.05)
    for speed in (-20.0, -0.1, 0.0, 0.3, 8.0):
        motor, joint = law.torque(at(motor_speed=speed))
        assert motor * speed <= 0
        assert joint == 0.0
    # Far above the speed over which it falls it is dry friction.
    assert law.torque(at(motor_speed=500.0))[0] == pytest.approx(-0.4, rel=1e-3)


def test_springs_that_slip_close_a_loop_of_the_size_of_what_they_lose():
    law = MaxwellSlip([3e5], [1e-4])
    law.begin(1e-4)
    swing = 4e-4 * np.sin(np.linspace(0, 4 * np.pi, 40_001))
    torque = np.array([law.torque(at(deflection=float(d)))[1] for d in swing])
    # Second turn: slider force times the path on which it slips, 4 (amplitude - slip).
    second = slice(20_000, None)
    work = np.trapezoid(torque[second], swing[second])
    assert work == pytest.approx(3e5 * 1e-4 * 4 * (4e-4 - 1e-4), rel=1e-3)


def test_a_delay_is_as_long_as_it_says():
    law = Delay(1e-3)
    law.begin(2.5e-4)
    out = [law.command(float(k)) for k in range(8)]
    # Steps of a quarter of a millisecond: four of them.
    assert out[4:] == [0.0, 1.0, 2.0, 3.0]


def test_a_law_does_nothing_unless_told():
    law = Law()
    law.begin(1e-3)
    assert law.torque(at(1.0)) == (0.0, 0.0)
    assert (law.sensor(1.0), law.command(2.0), law.reported(3.0)) == (0.0, 2.0, 3.0)


# Scores.


def judged(
    truth: tuple[str, ...], named: tuple[str, ...], verdict: str = "explained", **more: object
) -> Judged:
    values: Mapping[str, object] = {
        "name": "case",
        "truth": truth,
        "in_library": True,
        "severity": 10.0,
        "verdict": verdict,
        "named": named,
        "probabilities": (0.9,) * len(named),
        "allowed": frozenset(named),
        "where": frozenset(),
        "ratios": (),
        "covered": (),
        "setting": {
            "engine": "mujoco",
            "arm": "irb6600_like",
            "motions": "multisines",
            "references": "logged",
        },
    }
    return Judged(**{**values, **more})  # type: ignore[arg-type]


def test_intervals_are_wilsons():
    # Nothing of n: from zero to z^2 / (n + z^2); all of n is its mirror image.
    square = scipy.stats.norm.isf(0.025) ** 2
    assert Share(0, 10).interval() == pytest.approx((0.0, square / (10 + square)))
    assert Share(30, 30).interval() == pytest.approx((30 / (30 + square), 1.0))
    assert Share(0, 0).interval() == (0.0, 1.0)


def test_figures_count_what_they_say():
    cases = [
        judged(("backlash@1",), ("backlash@1",)),
        judged(("backlash@1",), ("coulomb_friction@1",)),
        judged(("backlash@2",), (), "unknown", where=frozenset({2})),
        judged(("backlash@3",), (), "none", severity=0.5),
        judged((), (), "none", severity=0.0),
        judged((), ("payload",), "explained", severity=0.0),
        judged(("outside_tone@1",), (), "unknown", in_library=False),
        judged(("backlash@1", "payload"), ("payload", "backlash@1")),
        judged(("backlash@1", "payload"), ("payload", "torque_offset@1")),
    ]
    shares = {name: (s.hits, s.of) for name, s in figures(cases).items()}
    # A tilted base of an arm of one axis is on that.
    lever = [judged(("link_com@1",), ("base_tilt",), n_axes=n) for n in (1, 2)]
    assert [figures([j])["axis"].hits for j in lever] == [1, 0]
    assert shares["effect first, severity 3 and more"] == (1, 3)
    assert shares["axis"] == (3, 4)
    assert shares["false alarms on nothing withheld"] == (1, 2)
    assert shares["out of the library: unknown"] == (1, 1)
    assert shares["wrong cause explained"] == (3, 9)
    assert shares["pairs: both"] == (1, 2)
    assert shares["pairs: spurious third"] == (1, 2)
    assert [c.right for c in cases] == [True, False, False, False, True, False, True, True, False]
    # Seven causes named at 0.9, four of them true.
    assert calibration_error(cases) == pytest.approx(0.9 - 4 / 7)


def test_what_is_missed_is_held_against_the_limit_said_of_it():
    withheld = [
        {"effect": "backlash", "axis": 1, "parameters": {"half_width_rad": 2e-4}},
        {
            "effect": "torque_ripple",
            "axis": 2,
            "parameters": {"order_1": 2.0, "amplitude_1_nm": 0.1},
        },
        {"effect": "torque_offset", "axis": 3, "parameters": {"offset_nm": -0.1}},
        {"effect": "payload", "axis": None, "parameters": {"mass_kg": 3.0}},
        {"effect": "push", "axis": 1, "parameters": {"torque_nm": 3.0}},
    ]
    limits = [
        {"effect": "backlash", "axis": 1, "parameter": "half_width_rad", "value": 8e-4},
        {"effect": "torque_ripple", "axis": 2, "parameter": "cosine_1_nm", "value": 0.02},
        {"effect": "torque_offset", "axis": 3, "parameter": "offset_nm", "value": None},
    ]
    found = _missed(withheld, {"payload"}, limits, 3)
    assert found == pytest.approx(
        {"backlash@1": 0.25, "torque_ripple@2": 5.0, "torque_offset@3": 0.0}
    )
    assert np.isnan(_missed(withheld[3:], set(), limits, 3)["payload"])


def test_what_is_said_of_a_cause_counts_for_its_twin():
    cause = {"effect": "torque_offset", "axis": 2, "probability": 0.76}
    # Four to one among the twins: both together are five quarters of what is named.
    assert _said(cause, 3) == pytest.approx(0.95)
    assert _said({"effect": "backlash", "axis": 2, "probability": 0.76}, 3) == 0.76


def test_waves_are_compared_by_their_order():
    true = {"order_1": 2.0, "amplitude_1_nm": 0.5, "order_2": 6.0, "amplitude_2_nm": 0.1}
    found = {
        "order_1": {"value": 6.0, "ci95": [6.0, 6.0]},
        "cosine_1_nm": {"value": 0.06, "ci95": [0.05, 0.07]},
        "sine_1_nm": {"value": -0.08, "ci95": [-0.09, -0.07]},
    }
    assert sizes(true) == {"amplitude of order 2": 0.5, "amplitude of order 6": 0.1}
    # As an effect states it, and without a size.
    waves = {"order_1": 6.0, "cosine_1_nm": 0.06, "sine_1_nm": -0.08, "order_2": 9.0}
    assert sizes(waves) == {"amplitude of order 6": pytest.approx(0.1)}
    value, low, high = comparable(found)["amplitude of order 6"]
    assert (value, low, high) == pytest.approx((0.1, 0.09, 0.11))


def test_from_machine_to_score(tmp_path: Path):
    cases, truth, out = tmp_path / "cases", tmp_path / "truth", tmp_path / "out"
    shell = CliRunner()
    fixed = Choice("mujoco", "lever_like", "multisines")
    choice = ["--engine", "mujoco", "--arm", "lever_like", "--motions", "multisines"]
    count = ["--count", "1", "--workers", "1"]
    made = shell.invoke(app, ["blind", "make", str(cases), "--truth", str(truth), *count, *choice])
    assert made.exit_code == 0, made.output
    (case,) = cases.iterdir()
    assert not list(case.rglob("*truth*.json"))
    before = (case / "logs" / "moves.parquet").read_bytes()
    # What is there stays, and would come out the same.
    make_cases(cases, truth, [0], 0, 1, lambda *_: None, fixed)
    (case / SEAL).unlink()
    make_cases(cases, truth, [0], 0, 1, lambda *_: None, fixed)
    assert (case / "logs" / "moves.parquet").read_bytes() == before
    solved = shell.invoke(app, ["blind", "run", str(cases), "--out", str(out), "--workers", "1"])
    assert solved.exit_code == 0, solved.output
    (found,) = judged_cases(cases, truth, out)
    assert (found.kind, found.verdict, found.right) == ("nothing", "none", True)
    assert found.setting == {
        "engine": "mujoco",
        "arm": "lever_like",
        "motions": "multisines",
        "references": "logged",
    }
    table = tmp_path / "score.md"
    drawn = tmp_path / "plots"
    arguments = ["--truth", str(truth), "--verdicts", str(out), "--out", str(table)]
    arguments += ["--plots", str(drawn)]
    scored = shell.invoke(app, ["blind", "score", str(cases), *arguments])
    assert scored.exit_code == 0, scored.output
    assert "| false alarms on nothing withheld | 0/1 = 0 %" in table.read_text("utf-8")
    assert {p.name for p in drawn.iterdir()} == {"confusion.svg", "calibration.svg"}
    # What cannot be diagnosed counts, and stops nothing else.
    (case / "robot.toml").write_text("schema = 1", "utf-8")
    again = shell.invoke(app, ["blind", "run", str(cases), "--out", str(out), "--workers", "1"])
    assert again.exit_code == 1
    assert f"{case.name}: " in again.output and "robot.toml" in again.output
    (lost,) = judged_cases(cases, truth, out)
    assert (lost.verdict, lost.named, lost.right) == ("failed", (), False)
    # A truth that was changed later is no truth.
    path = truth / f"{case.name}.json"
    path.write_text(json.dumps({**json.loads(path.read_text("utf-8")), "seed": 5}), "utf-8")
    with pytest.raises(InputError, match="sealed"):
        judged_cases(cases, truth, out)


def test_effects_are_drawn_where_they_are_what_they_are_called():
    lever, slide = (Scene(load_robot(n), []) for n in ("lever_like", "scara_like"))
    kinds = ENGINES["mujoco"]
    # Its only axis carries weight: a deadband is an offset there, a knee another stiffness.
    assert kinds["torque_deadband"].axes(lever) == kinds["piecewise_stiffness"].axes(lever) == []
    assert kinds["torque_deadband"].axes(slide) == [1, 2]
    assert kinds["joint_zero_offset"].axes(slide) == [1, 2]
    assert kinds["backlash"].axes(slide) == [1, 2, 3]
    assert slide.play(3) < 0.1 and slide.play(1) == lever.play(1) == 1.0


def test_a_machine_that_runs_away_is_drawn_again(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    asked: list[Machine] = []

    def engine(machine: Machine, references: list[np.ndarray], noises: list[np.ndarray]):
        asked.append(machine)
        if len(asked) == 1:
            raise InputError("machine: unstable")
        torque = 1e3 if len(asked) == 2 else 1e-3
        return [(np.full_like(x, torque), np.cumsum(x, axis=0)) for x in references]

    monkeypatch.setattr(make, "_engine", lambda _: engine)
    fixed = Choice("mujoco", "lever_like", "slow_and_short")
    make._make(tmp_path / "c", tmp_path / "t", 3, fixed, 8)
    # The third of them works; nothing is withheld from it, and no severity to be had.
    assert len(asked) == 3
    stiffness = [m.robot.parameters()["axis1.stiffness"] for m in asked]
    assert len(set(stiffness)) == 3
    truth = json.loads((tmp_path / "t" / "case_0003_0008.json").read_text("utf-8"))
    assert truth["effects"] == [] and truth["severity"] == [0.0]


def test_truths_stay_apart_from_cases(tmp_path: Path):
    with pytest.raises(InputError, match="truth: expected another folder"):
        make_cases(tmp_path, tmp_path, [0], 0, 1, lambda *_: None)


@pytest.mark.parametrize("arm", ["irb6600_like", "lever_like", "scara_like"])
def test_a_limit_of_torque_holds_the_arm_and_cuts_what_moves_it(arm: str):
    robot = load_robot(arm)
    moves = [ref for _, ref in point_to_point(np.random.default_rng(2), robot).values()]
    scene, rng = Scene(robot, moves[:1]), np.random.default_rng(6)
    for axis in robot.axis_numbers():
        held, largest = scene.at_rest_nm(axis), float(scene.largest_nm[axis - 1])
        for _ in range(5):
            limit = (
                ENGINES["mujoco"]["torque_saturation"].draw(rng, scene, axis).parameters["limit_nm"]
            )
            assert held + 0.7 * (largest - held) < limit < largest
