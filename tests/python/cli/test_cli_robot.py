"""Effects that a robot file states: which commands use them, and what they say."""

import json
import os
import shutil
from pathlib import Path

import jsonschema
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from test_diagnose import bare_axis, logs_of
from typer.testing import CliRunner

from axisight import Effect, Log, load_robot, montecarlo, simulate
from axisight.cli import app
from axisight.errors import InputError
from axisight.gap import verdict_schema
from axisight.gap.facts.settings import DEFAULT_TOLERANCES
from axisight.gap.hypotheses.candidates import all_candidates
from axisight.gap.hypotheses.ripple_orders import Turning
from axisight.gap.hypotheses.start_context import StartData
from axisight.logs import read_log
from axisight.robot_file import Provenance, hash_file, identified, load_identified, write_identified
from axisight.robot_file.effect_tables import stated
from montecarlo_data import small_study

COULOMB = Effect("coulomb_friction", 1, {"coulomb_nm": 0.5, "smoothing_rad_s": 0.05})
SPRING = Effect("nonlinear_stiffness", 1, {"cubic_nm_rad3": 3.7e10})
# One that does nothing.
NEUTRAL = Effect("stribeck_friction", 1, {})
LINE = "with the effects of {}: nonlinear_stiffness@1, coulomb_friction@1"
CHIRP = ("--kind", "chirp", "--period-s", 0.5, "--band-hz", "4,20", "--peak-rad-s", 8)
CASE = """
schema = "axisight.case/1"
name = "axis"
robot = "axis.toml"

[[log]]
file = "log.parquet"
role = "estimation"

[[log]]
file = "log2.parquet"
role = "validation"
"""
PLAN = {"multisine": ("multisine", 1), "second": ("multisine", 2), "moves": ("moves", 0)}
HELD = {"fresh": ("multisine", 9)}


def run(*arguments: object, code: int = 0) -> str:
    result = CliRunner().invoke(app, [*map(str, arguments)])
    assert result.exit_code == code, result.output
    assert result.exception is None or isinstance(result.exception, SystemExit)
    return " ".join(result.output.split())


def write_robot(path: Path, *effects: Effect) -> Path:
    stiffness = 1.46e6
    found = identified({"axis1.stiffness": stiffness}, Provenance("test"), effects=effects)
    write_identified(bare_axis(), path, found)
    return path


def earlier_files(axis: Path) -> Path:
    """The robot without its effects, as a file of version 1, and they in a sidecar of version 1."""
    old = axis.with_name("old.toml")
    robot = load_robot(axis)
    old.write_text(stated(robot.toml, []).replace("axisight.robot/2", "axisight.robot/1"))
    content = json.loads(axis.with_name("axis.identified.json").read_text())
    content |= {"schema": "axisight.identified/1", "robot": old.name}
    content["robot_sha256"] = hash_file(old)
    content["effects"] = [
        {"name": e.name, "axis": e.axis, "parameters": e.parameters} for e in robot.effects
    ]
    old.with_name("old.identified.json").write_text(json.dumps(content))
    return old


def write_log(path: Path, log: Log) -> Path:
    columns = {"time_s": log.time_s, "velocity_ref_1": log.velocity_ref_rad_s[:, 0]}
    columns |= {"torque_cmd_1": log.torque_nm[:, 0], "position_1": log.position_rad[:, 0]}
    pd.DataFrame(columns).to_parquet(path, index=False)
    return path


@pytest.fixture
def axis(tmp_path: Path) -> Path:
    return write_robot(tmp_path / "axis.toml", SPRING, COULOMB, NEUTRAL)


@pytest.fixture
def log(tmp_path: Path) -> Path:
    (made,) = logs_of(bare_axis(), [], {"moves": ("moves", 0)})
    return write_log(tmp_path / "log.parquet", made)


def simulated(axis: Path, log: Path, *more: object) -> tuple[np.ndarray, str]:
    out = axis.with_name("out.parquet")
    text = run("simulate", axis, log, "--out", out, *more)
    return pd.read_parquet(out)["torque_cmd_1"].to_numpy(), text


def truth(log: Path, *effects: Effect) -> np.ndarray:
    reference = pd.read_parquet(log)[["velocity_ref_1"]].to_numpy()
    return simulate(bare_axis(), reference, effects=effects)["torque_cmd_nm"].values[:, 0]


def test_simulate_takes_them_and_says_so(axis: Path, log: Path) -> None:
    torque, text = simulated(axis, log)
    np.testing.assert_array_equal(torque, truth(log, SPRING, COULOMB))
    assert LINE.format(axis) in text
    assert "stribeck" not in text


def test_a_given_effect_replaces_one_of_the_file(axis: Path, log: Path) -> None:
    torque, text = simulated(axis, log, "--effect", "coulomb_friction@1:coulomb_nm=0.2")
    other = Effect("coulomb_friction", 1, {"coulomb_nm": 0.2})
    np.testing.assert_array_equal(torque, truth(log, SPRING, other))
    assert f"with the effects of {axis}: nonlinear_stiffness@1 " in text


def test_a_robot_edited_since_keeps_its_effects(axis: Path, log: Path) -> None:
    axis.write_text(axis.read_text() + "# looked at\n")
    axis.with_name("axis.identified.json").write_text("spoilt")
    torque, _ = simulated(axis, log)
    np.testing.assert_array_equal(torque, truth(log, SPRING, COULOMB))


def test_nothing_is_said_where_there_is_nothing(log: Path, tmp_path: Path) -> None:
    _, text = simulated(write_robot(tmp_path / "bare.toml", NEUTRAL), log)
    assert "with the effects" not in text
    _, text = simulated(write_robot(tmp_path / "bare2.toml"), log)
    assert "with the effects" not in text


def test_effects_beside_a_robot_file_are_refused_until_written_again(
    axis: Path, log: Path, tmp_path: Path
) -> None:
    """As earlier versions left them: a robot of version 1, effects in its sidecar."""
    old = earlier_files(axis)
    for command in (
        ("simulate", old, log, "--out", tmp_path / "x.parquet"),
        ("diagnose", log, log, "--model", old),
        ("montecarlo", study_file(tmp_path, old, "nonlinear"), "--out", tmp_path / "x"),
        ("identify", "axis", log, log, "--robot", old),
        ("excite", "--robot", old, *CHIRP, "--torque-limit", 0.1),
    ):
        text = run(*command, code=2)
        assert "old.identified.json: expected effects in the robot file" in text
        assert "got nonlinear_stiffness@1, coulomb_friction@1 beside it" in text
    # Stated in the robot file by hand.
    by_hand = old.with_name("by_hand.toml")
    by_hand.write_text(axis.read_text())
    shutil.copy(old.with_name("old.identified.json"), by_hand.with_name("by_hand.identified.json"))
    torque, _ = simulated(by_hand, log)
    np.testing.assert_array_equal(torque, truth(log, SPRING, COULOMB))
    # As the message says.
    found = load_identified(old)
    assert found.robot.effects == found.effects == (SPRING, COULOMB, NEUTRAL)
    write_identified(found.robot, old, found, overwrite=True)
    assert load_robot(old).effects == load_identified(old).effects == found.effects
    torque, _ = simulated(old, log)
    np.testing.assert_array_equal(torque, truth(log, SPRING, COULOMB))


# The diagnosis.


def diagnosed(axis: Path, friction_nm: float, *more: object) -> tuple[dict, str]:
    """Diagnose a machine with so much friction, its cubic spring left away."""
    effect = Effect("coulomb_friction", 1, {"coulomb_nm": friction_nm, "smoothing_rad_s": 0.05})
    folder = axis.parent
    paths = [
        write_log(folder / f"{made.name}.parquet", made)
        for made in logs_of(bare_axis(), [effect, SPRING], PLAN | HELD)
    ]
    held = ["--validation", paths.pop()]
    verdict = folder / "verdict.json"
    text = run("diagnose", *paths, *held, "--model", axis, "--json", verdict, *more)
    found = json.loads(verdict.read_text())
    jsonschema.validate(found, verdict_schema())
    return found, text


def test_diagnose_knows_what_was_identified(axis: Path) -> None:
    found, text = diagnosed(axis, 0.5)
    assert LINE.format(axis) in text
    assert found["verdict"] == "none"
    assert found["provenance"]["robot_effects"] == ["nonlinear_stiffness@1", "coulomb_friction@1"]


def test_the_robot_of_a_case_has_its_effects_too(axis: Path, log: Path, monkeypatch) -> None:
    seen = []

    def stop(**inputs) -> None:
        seen.append(inputs["robot"].effects)
        raise InputError("seen")

    monkeypatch.setattr("axisight.cli.diagnose.diagnose", stop)
    command = ["diagnose", log, log, "--model", axis]
    assert "with the effects of" in run(*command, code=2)
    case = axis.parent / "case.toml"
    case.write_text(CASE)
    shutil.copy(log, log.with_name("log2.parquet"))
    assert "with the effects of" in run("diagnose", axis.parent, code=2)
    assert seen == [(SPRING, COULOMB, NEUTRAL), (SPRING, COULOMB, NEUTRAL)]


GIVEN = "coulomb_friction@1 coulomb_nm=0.2"


def stopped(monkeypatch, attribute: str = "robot") -> list:
    """What `diagnose` is called with, and nothing more."""
    seen: list = []

    def stop(**inputs) -> None:
        seen.append(inputs if attribute == "all" else inputs[attribute])
        raise InputError("seen")

    monkeypatch.setattr("axisight.cli.diagnose.diagnose", stop)
    return seen


def test_diagnose_takes_effects_of_the_command_line(axis: Path, log: Path, monkeypatch) -> None:
    seen = stopped(monkeypatch)
    more = ("--effect", GIVEN, "--effect", "payload mass_kg=2")
    text = run("diagnose", log, log, "--model", axis, *more, code=2)
    assert f"with the effects of {axis}: nonlinear_stiffness@1 " in text
    labels = {e.label: e for e in seen[0].effects}
    assert set(labels) == {SPRING.label, COULOMB.label, NEUTRAL.label, "payload"}
    assert labels["coulomb_friction@1"].parameters["coulomb_nm"] == 0.2
    assert labels["payload"].parameters["mass_kg"] == 2.0
    refused = run("diagnose", log, log, "--model", axis, "--effect", "backlash@7", code=2)
    assert "--effect" in refused and "axis: expected 1 or a joint name (axis1), got 7" in refused


def test_a_given_effect_is_no_longer_missing(axis: Path) -> None:
    bare = write_robot(axis.with_name("bare.toml"))
    effects = "coulomb_friction@1 coulomb_nm=0.5 smoothing_rad_s=0.05"
    more = ("--effect", effects, "--effect", "nonlinear_stiffness@1 cubic_nm_rad3=3.7e10")
    found, _ = diagnosed(bare, 0.5, *more)
    assert found["verdict"] == "none"
    assert found["provenance"]["robot_effects"] == ["coulomb_friction@1", "nonlinear_stiffness@1"]


def open_loop(path: Path) -> Path:
    frame = pd.read_parquet(path).drop(columns="velocity_ref_1")
    out = path.with_name(f"open_{path.name}")
    frame.to_parquet(out, index=False)
    return out


def test_diagnose_uses_the_part_asked_for(axis: Path, log: Path, monkeypatch) -> None:
    seen = stopped(monkeypatch, "all")
    free = open_loop(log)
    run("diagnose", free, free, "--model", axis, "--from", 2, "--to", 4.5, code=2)
    (inputs,) = seen
    whole = read_log(free)
    for used in (*inputs["estimation"], *inputs["validation"]):
        np.testing.assert_array_equal(used.position_rad, whole.position_rad[4000:9000])
        assert used.notes == ("from 2 s to 4.5 s",)
    # An end alone leaves the start at rest, where a closed loop begins.
    run("diagnose", log, log, "--model", axis, "--to", 4.5, code=2)
    assert seen[1]["estimation"][0].n_samples == 9000
    assert "--from" in run("diagnose", free, free, "--model", axis, "--from", 7, code=2)
    assert len(seen) == 2


def moves_and_rests(path: Path, *starts_s: float) -> Path:
    """Write a log of 12 s at 250 Hz that turns for two seconds from each start on, and rests between."""
    time = 0.004 * np.arange(3000)
    turns = [np.clip(time - start, 0.0, 2.0) for start in starts_s]
    angle = sum(1.0 - np.cos(np.pi * turn) for turn in turns)
    angle = angle + 1e-5 * np.random.default_rng(0).normal(size=time.size)
    frame = {"time_s": time, "position_1": angle, "torque_cmd_1": 0.1 * time}
    pd.DataFrame(frame).to_parquet(path, index=False)
    return path


def test_logs_are_used_while_they_move(axis: Path, tmp_path: Path, monkeypatch) -> None:
    seen = stopped(monkeypatch, "all")
    log = moves_and_rests(tmp_path / "moves.parquet", 3.0, 7.0)
    run("diagnose", log, log, "--model", axis, "--moving", code=2)
    for used in (*seen[0]["estimation"], *seen[0]["validation"]):
        (note,) = used.notes
        _, start, _, _, stop, _ = note.split()
        # Rest before, from which a simulation begins, and after; torques tell the time.
        assert 2.6 < float(start) < 2.9 and 9.1 < float(stop) < 9.4
        assert used.torque_nm[0, 0] == pytest.approx(0.1 * float(start))
    run("diagnose", log, log, "--model", axis, "--moving", "--from", 6, code=2)
    assert seen[1]["estimation"][0].duration_s == pytest.approx(2.5, abs=0.2)
    still = moves_and_rests(tmp_path / "still.parquet", 20.0)
    said = run("diagnose", still, still, "--model", axis, "--moving", code=2)
    assert "still.parquet: --moving: expected an axis that moves, got none" in said


def test_one_log_is_cut_into_runs(axis: Path, tmp_path: Path, monkeypatch) -> None:
    seen = stopped(monkeypatch, "all")
    log = moves_and_rests(tmp_path / "moves.parquet", 1.0, 3.4, 8.0)
    run("diagnose", log, "--model", axis, "--cut-at-rests", "--simulated", log, code=2)
    # Four tenths of a second between two motions are no rest; the last run is held out.
    (one,), (two,) = seen[0]["estimation"], seen[0]["validation"]
    assert [one.name, two.name] == ["moves#1", "moves#2"]
    assert [s.notes for s in seen[0]["simulated"]] == [one.notes, two.notes]
    assert one.duration_s == pytest.approx(4.9, abs=0.3)
    assert two.torque_nm[0, 0] == pytest.approx(0.77, abs=0.03)
    single = moves_and_rests(tmp_path / "single.parquet", 3.0)
    said = run("diagnose", single, "--model", axis, "--cut-at-rests", code=2)
    assert "--validation: expected a log to hold out" in said
    # Of several logs all runs of the last are held out.
    run("diagnose", log, log, "--model", axis, "--cut-at-rests", code=2)
    assert [len(seen[1][role]) for role in ("estimation", "validation")] == [2, 2]


def test_options_of_the_search_arrive(axis: Path, log: Path, monkeypatch) -> None:
    seen = stopped(monkeypatch, "settings")
    options = ("--cutoff-hz", 12.5, "--max-causes", 2, "--threads", 1, "--seed", 3)
    run("diagnose", log, log, "--model", axis, *options, code=2)
    run("diagnose", log, log, "--model", axis, code=2)
    given, default = seen
    assert (given.cutoff_hz, given.max_causes, given.threads, given.seed) == (12.5, 2, 1, 3)
    assert (default.cutoff_hz, default.threads) == (None, os.cpu_count())


@pytest.mark.parametrize("cutoff_hz", [0, -3, 1000])
def test_a_cutoff_that_is_none_is_refused(axis: Path, log: Path, cutoff_hz: float) -> None:
    rows = pd.read_parquet(open_loop(log))
    halves = [log.with_name("first.parquet"), log.with_name("second.parquet")]
    for half, part in zip(halves, np.array_split(np.arange(len(rows)), 2), strict=True):
        rows.iloc[part].assign(time_s=rows["time_s"].iloc[: len(part)].values).to_parquet(half)
    text = run("diagnose", *halves, "--model", axis, "--cutoff-hz", cutoff_hz, code=2)
    wanted = "cutoff_hz: expected between 0 and the Nyquist frequency 1000 Hz"
    assert f"{wanted}, got {cutoff_hz} Hz" in text


def test_a_part_is_passed_on_as_it_is(axis: Path, log: Path, monkeypatch) -> None:
    seen = stopped(monkeypatch, "all")
    run("diagnose", log, log, "--model", axis, "--from", 2, code=2)
    made = pd.read_parquet(log)[["torque_cmd_1"]].to_numpy()
    # Whether it begins in motion is for the diagnosis to see.
    np.testing.assert_array_equal(seen[0]["estimation"][0].torque_nm, made[4000:])


def test_candidates_begin_where_the_simulator_is(axis: Path, log: Path) -> None:
    ripple = Effect("torque_ripple", 1, {"order_2": 6.0, "cosine_2_nm": 0.3, "sine_2_nm": 0.1})
    robot = load_robot(axis).with_effects([COULOMB, NEUTRAL, ripple])
    data = read_log(log)
    rng = np.random.default_rng(0)
    speed = np.gradient(data.position_rad[:, 0], data.sample_time_s)
    angle, time = data.position_rad[:, 0], data.sample_time_s
    # A ripple at another order than the simulator's stands out of noise.
    residual = rng.normal(size=data.n_samples) + 2 * np.cos(9 * angle)
    turned = Turning(residual, angle, speed, time)
    at = StartData([[turned]], lambda _effect, _axis, f: np.ones(len(f), complex), np.ones(1))
    found = {c.effect.label: c for c in all_candidates(robot, [data], at)}
    friction = found["coulomb_friction@1"]
    assert friction.effect.values() == COULOMB.values()
    low, high = friction.bounds["smoothing_rad_s"]
    assert low <= 0.05 <= high
    waves = found["torque_ripple@1"]
    assert waves.effect.parameters["order_2"] == 6.0
    assert waves.effect.parameters["cosine_2_nm"] == 0.3
    # The other places are for orders that stand out of what is left.
    assert {"cosine_1_nm", "cosine_2_nm", "sine_2_nm"} <= set(waves.free)
    bare = {c.effect.label: c for c in all_candidates(bare_axis(), [data], at)}
    expected = bare["torque_ripple@1"].effect.parameters["order_1"]
    assert expected not in (0.0, 1.0, 6.0)
    assert waves.effect.parameters["order_1"] == expected
    assert found.keys() == bare.keys()
    assert found["stribeck_friction@1"] == bare["stribeck_friction@1"]


@pytest.mark.parametrize("friction_nm", [0.3, 0.8])
def test_diagnose_names_other_values_of_an_identified_effect(axis, friction_nm: float) -> None:
    found, text = diagnosed(axis, friction_nm)
    assert found["verdict"] == "explained", text
    (cause,) = found["causes"]
    assert (cause["effect"], cause["axis"]) == ("coulomb_friction", 1)
    # The value the machine has, not what comes on top; its own parameters trade with it.
    assert cause["parameters"]["coulomb_nm"]["value"] == pytest.approx(friction_nm, rel=0.05)
    # With its own friction besides, the simulator would be further off than before.
    assert found["gap"]["after"] < 1.2 * found["gap"]["floor"]
    assert "Coulomb friction of axis 1 is wrong in the simulator" in " ".join(text.split())


# Studies and excitations.


def study_file(folder: Path, robot: Path, model: str) -> Path:
    study = small_study(
        robot=str(robot),
        runs=2,
        effect=[],
        plant=montecarlo.Plant(model=model),
    )
    path = folder / "study.toml"
    path.write_text(study.to_toml())
    return path


def test_montecarlo_takes_them(axis: Path, tmp_path: Path) -> None:
    study = study_file(tmp_path, axis, "nonlinear")
    text = run("montecarlo", study, "--out", tmp_path / "with", "--threads", 1)
    assert LINE.format(axis) in text
    bare = write_robot(tmp_path / "bare.toml")
    given = montecarlo.read_study(study).model_copy(update={"robot": str(bare)})
    entries = [
        montecarlo.EffectEntry(name=e.name, axis=e.axis, parameters=e.parameters)
        for e in (SPRING, COULOMB, NEUTRAL)
    ]
    wanted = montecarlo.run(given.model_copy(update={"effect": entries}), threads=1)
    without = montecarlo.run(given, threads=1)
    stored = mean_of(tmp_path / "with")
    np.testing.assert_array_equal(stored, wanted["arithmetic_mean"].values)
    off = np.abs(stored - without["arithmetic_mean"].values).max()
    assert off > 0.01 * np.abs(stored).max()
    # In Python too, without the command line.
    python = montecarlo.run(study, threads=1)
    np.testing.assert_array_equal(stored, python["arithmetic_mean"].values)


def test_montecarlo_takes_effects_of_the_command_line(axis: Path, tmp_path: Path) -> None:
    study = study_file(tmp_path, axis, "nonlinear")
    common = ("montecarlo", study, "--threads", 1)
    run(*common, "--out", tmp_path / "with", "--effect", GIVEN)
    given = montecarlo.read_study(study)
    entry = montecarlo.EffectEntry(name="coulomb_friction", axis=1, parameters={"coulomb_nm": 0.2})
    wanted = montecarlo.run(given.model_copy(update={"effect": [entry]}), threads=1)
    np.testing.assert_array_equal(mean_of(tmp_path / "with"), wanted["arithmetic_mean"].values)
    refused = run(*common, "--out", tmp_path / "not", "--effect", "wobble@1", code=2)
    assert "--effect 'wobble@1'" in refused
    # The study's own of that name and axis gives way.
    own = study.with_name("own.toml")
    own.write_text(given.model_copy(update={"effect": [entry]}).to_toml())
    run(
        "montecarlo", own, "--threads", 1, "--out", tmp_path / "own",
        "--effect", "coulomb_friction@1 coulomb_nm=0.3",
    )  # fmt: skip
    stored = (tmp_path / "own" / "study.toml").read_text()
    assert stored.count("coulomb_friction") == 1 and "coulomb_nm = 0.3" in stored


def mean_of(folder: Path) -> np.ndarray:
    store = xr.open_zarr(folder / "study.zarr", group="result", consolidated=False)
    return store["arithmetic_mean"].values


def test_a_study_may_replace_and_spread_them(axis: Path, tmp_path: Path) -> None:
    study = montecarlo.read_study(study_file(tmp_path, axis, "nonlinear"))
    half = montecarlo.EffectEntry(
        name="coulomb_friction", axis=1, parameters={**COULOMB.parameters, "coulomb_nm": 0.25}
    )
    other = write_robot(tmp_path / "half.toml", Effect(half.name, 1, half.parameters), SPRING)
    one = montecarlo.run(study.model_copy(update={"effect": [half]}), threads=1)
    two = montecarlo.run(study.model_copy(update={"robot": str(other)}), threads=1)
    # The effects add up in another order: equal to rounding.
    np.testing.assert_allclose(one["arithmetic_mean"], two["arithmetic_mean"], rtol=1e-6)
    spread = montecarlo.Spread(parameter="coulomb_friction@1.coulomb_nm", relative=0.5)
    varied = montecarlo.run(study.model_copy(update={"spread": [spread]}), threads=1)
    plain = montecarlo.run(study, threads=1)
    assert np.abs(varied["arithmetic_mean"] - plain["arithmetic_mean"]).max() > 0


def test_a_linear_study_refuses_friction(axis: Path, tmp_path: Path) -> None:
    study = study_file(tmp_path, axis, "linear")
    text = run("montecarlo", study, "--out", tmp_path / "results", "--threads", 1, code=2)
    assert "coulomb_friction" in text


def test_excite_checks_limits_with_them(axis: Path, tmp_path: Path) -> None:
    options = ["--robot", axis, *CHIRP, "--out", tmp_path / "refs.parquet", "--force"]
    assert "with the effects" not in run("excite", *options)
    assert LINE.format(axis) in run("excite", *options, "--torque-limit", 0.1)


def test_excite_checks_limits_with_effects_of_the_command_line(axis: Path, tmp_path: Path) -> None:
    options = ["--robot", axis, *CHIRP, "--out", tmp_path / "refs.parquet", "--force"]
    plain = run("excite", *options, "--torque-limit", 0.1)
    loaded = run(
        "excite", *options, "--torque-limit", 0.1, "--effect", "coulomb_friction@1 coulomb_nm=5"
    )
    assert f"with the effects of {axis}: nonlinear_stiffness@1 " in loaded
    assert loaded.split("torque ")[1] != plain.split("torque ")[1]


# Tolerances of the file.


@pytest.mark.parametrize(
    ("options", "wanted"),
    [
        ((), {"stiffness": 0.2, "damping": 0.5}),
        (("--tolerance", "stiffness=0.07"), {"stiffness": 0.07, "damping": 0.5}),
    ],
)
def test_diagnose_takes_tolerances_of_the_file(axis, log, monkeypatch, options, wanted) -> None:
    seen = []

    def stop(**inputs) -> None:
        seen.append(inputs["settings"].tolerances)
        raise InputError("seen")

    monkeypatch.setattr("axisight.cli.diagnose.diagnose", stop)
    axis.write_text(axis.read_text() + "[tolerances]\nstiffness = 0.2\ndamping = 0.5\n")
    run("diagnose", log, log, "--model", axis, *options, code=2)
    assert seen == [{**DEFAULT_TOLERANCES, **wanted}]
