"""Effects that identification put beside a robot file: which commands use them, and what they say."""

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from typer.testing import CliRunner

from axisight import Effect, Log, Robot, load_robot, montecarlo, simulate
from axisight.cli import app
from axisight.errors import InputError
from axisight.gap.candidates import Situation, all_candidates
from axisight.logs import read_log
from axisight.robot_file import Provenance, identified, load_with_effects, write_identified
from montecarlo_data import small_study
from test_diagnose import bare_axis, logs_of

COULOMB = Effect("coulomb_friction", 1, {"coulomb_nm": 0.5, "smoothing_rad_s": 0.05})
SPRING = Effect("nonlinear_stiffness", 1, {"cubic_nm_rad3": 3.7e10})
# What identification writes for an effect that the fit stands in the place of: it does nothing.
NEUTRAL = Effect("stribeck_friction", 1, {})
TEXT = "coulomb_friction@1:coulomb_nm=0.5,smoothing_rad_s=0.05"
LINE = "with the effects in {}: coulomb_friction@1, nonlinear_stiffness@1 (--no-identified-effects"
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


def write_log(path: Path, log: Log) -> Path:
    columns = {"time_s": log.time_s, "velocity_ref_1": log.velocity_ref_rad_s[:, 0]}
    columns |= {"torque_cmd_1": log.torque_nm[:, 0], "position_1": log.position_rad[:, 0]}
    pd.DataFrame(columns).to_parquet(path, index=False)
    return path


@pytest.fixture
def axis(tmp_path: Path) -> Path:
    return write_robot(tmp_path / "axis.toml", COULOMB, SPRING, NEUTRAL)


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
    np.testing.assert_array_equal(torque, truth(log, COULOMB, SPRING))
    assert LINE.format(axis.with_name("axis.identified.json")) in text
    assert "stribeck" not in text


def test_simulate_does_without_when_told(axis: Path, log: Path) -> None:
    torque, text = simulated(axis, log, "--no-identified-effects")
    np.testing.assert_array_equal(torque, truth(log))
    assert "identified" not in text


def test_a_given_effect_goes_before_the_identified_one(axis: Path, log: Path) -> None:
    torque, text = simulated(axis, log, "--effect", "coulomb_friction@1:coulomb_nm=0.2")
    other = Effect("coulomb_friction", 1, {"coulomb_nm": 0.2})
    # The effects add up in another order: equal to rounding.
    np.testing.assert_allclose(torque, truth(log, other, SPRING), rtol=0, atol=1e-9)
    assert ": nonlinear_stiffness@1 (" in text


def test_a_robot_edited_since_goes_without_and_says_so(axis: Path, log: Path) -> None:
    axis.write_text(axis.read_text() + "# looked at\n")
    torque, text = simulated(axis, log)
    np.testing.assert_array_equal(torque, truth(log))
    sidecar = axis.with_name("axis.identified.json")
    assert f"axis.toml was changed after {sidecar} was written: its effects are not used" in text
    assert "coulomb_friction@1" in text


def test_nothing_is_said_where_there_is_nothing(axis: Path, log: Path, tmp_path: Path) -> None:
    _, text = simulated(write_robot(tmp_path / "bare.toml", NEUTRAL), log)
    assert "identified" not in text
    axis.with_name("axis.identified.json").unlink()
    _, text = simulated(axis, log)
    assert "identified" not in text


def test_a_spoilt_sidecar_is_refused_unless_left_out(axis: Path, log: Path) -> None:
    sidecar = axis.with_name("axis.identified.json")
    sidecar.write_text(sidecar.read_text().replace("axisight.identified/1", "other/1"))
    out = axis.with_name("out.parquet")
    assert "axis.identified.json: schema" in run("simulate", axis, log, "--out", out, code=2)
    assert not out.exists()
    run("simulate", axis, log, "--out", out, "--no-identified-effects")


def test_the_function_behind_it(axis: Path, tmp_path: Path) -> None:
    assert load_robot(axis).effects == ()  # the file is a contract
    robot, line = load_with_effects(axis)
    assert robot.effects == (COULOMB, SPRING, NEUTRAL)
    assert line.endswith("axis.identified.json: coulomb_friction@1, nonlinear_stiffness@1")
    preset, line = load_with_effects("two_mass_axis")
    assert (preset.effects, line) == (load_robot("two_mass_axis").effects, "")
    # Renamed together, both still belong together: the hash decides.
    for name in ("axis.toml", "axis.identified.json"):
        (tmp_path / name).rename(tmp_path / name.replace("axis", "arm"))
    assert load_with_effects(tmp_path / "arm.toml")[0].effects == robot.effects
    (tmp_path / "arm.toml").write_text((tmp_path / "arm.toml").read_text() + "\n")
    assert load_with_effects(tmp_path / "arm.toml")[0].effects == ()
    with pytest.raises(InputError, match="changed after it was written"):
        load_with_effects(tmp_path / "arm.toml", check=True)


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
    return json.loads(verdict.read_text()), text


def test_diagnose_knows_what_was_identified(axis: Path) -> None:
    found, text = diagnosed(axis, 0.5)
    assert LINE.format(axis.with_name("axis.identified.json")) in text
    assert found["verdict"] == "none"
    assert found["provenance"]["robot_effects"] == ["coulomb_friction@1", "nonlinear_stiffness@1"]


def test_diagnose_does_without_when_told(axis: Path, log: Path, monkeypatch) -> None:
    seen = []

    def stop(**inputs) -> None:
        seen.append(inputs["robot"].effects)
        raise InputError("seen")

    monkeypatch.setattr("axisight.cli.application.diagnose", stop)
    command = ["diagnose", log, log, "--model", axis]
    assert "with the effects in" in run(*command, code=2)
    assert "identified" not in run(*command, "--no-identified-effects", code=2)
    # A case brings its own robot, which may have a sidecar too.
    case = axis.parent / "case.toml"
    case.write_text(CASE)
    shutil.copy(log, log.with_name("log2.parquet"))
    assert "with the effects in" in run("diagnose", axis.parent, code=2)
    assert seen == [(COULOMB, SPRING, NEUTRAL), (), (COULOMB, SPRING, NEUTRAL)]


def test_candidates_begin_where_the_simulator_is(axis: Path, log: Path) -> None:
    ripple = Effect("torque_ripple", 1, {"order_2": 6.0, "cosine_2_nm": 0.3, "sine_2_nm": 0.1})
    robot = Robot(load_robot(axis).core, [COULOMB, NEUTRAL, ripple])
    data = read_log(log)
    rng = np.random.default_rng(0)
    speed = np.gradient(data.position_rad[:, 0], data.sample_time_s)
    residual = [[rng.normal(size=data.n_samples)]]
    at = Situation(residual, [[data.position_rad[:, 0]]], [[speed]], 20.0)
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
    assert "lacks the machine's values of coulomb friction on axis 1" in text


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


def test_montecarlo_puts_them_into_the_study(axis: Path, tmp_path: Path) -> None:
    study = study_file(tmp_path, axis, "nonlinear")
    text = run("montecarlo", study, "--out", tmp_path / "with", "--threads", 1)
    assert "with the effects in" in text
    read = montecarlo.read_study(study)
    entries = [
        montecarlo.EffectEntry(name=e.name, axis=e.axis, parameters=e.parameters)
        for e in (COULOMB, SPRING)
    ]
    wanted = montecarlo.run(read.model_copy(update={"effect": entries}), threads=1)
    with_them = montecarlo.run(study, out=tmp_path / "bare", threads=1)
    stored = [mean_of(tmp_path / name) for name in ("with", "bare")]
    np.testing.assert_array_equal(stored[0], wanted["arithmetic_mean"].values)
    np.testing.assert_array_equal(stored[1], with_them["arithmetic_mean"].values)
    assert np.abs(stored[0] - stored[1]).max() > 0.01 * np.abs(stored[1]).max()


def mean_of(folder: Path) -> np.ndarray:
    store = xr.open_zarr(folder / "study.zarr", group="result", consolidated=False)
    return store["arithmetic_mean"].values


def test_a_linear_study_needs_to_do_without_friction(axis: Path, tmp_path: Path) -> None:
    study = study_file(tmp_path, axis, "linear")
    out = tmp_path / "results"
    text = run("montecarlo", study, "--out", out, "--threads", 1, code=2)
    assert "--no-identified-effects" in text
    assert "coulomb_friction" in text
    run("montecarlo", study, "--out", out, "--threads", 1, "--no-identified-effects")


def test_excite_checks_limits_with_them(axis: Path, tmp_path: Path) -> None:
    options = ["--robot", axis, "--kind", "chirp", "--period-s", 0.5, "--band-hz", "4,20"]
    options += ["--peak-rad-s", 8, "--out", tmp_path / "refs.parquet", "--force"]
    assert "identified" not in run("excite", *options)
    limits = ["--torque-limit", 0.1]
    assert "with the effects in" in run("excite", *options, *limits)
    assert "identified" not in run("excite", *options, *limits, "--no-identified-effects")
