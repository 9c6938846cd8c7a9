"""The command line: bad input gives a message and status 2, and nothing half-written."""

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from axisight import Effect, load_robot, simulate
from axisight.cli import app
from axisight.cli.demo import write_demo_case

ROBOT = "two_mass_axis"


@pytest.fixture(scope="module")
def demo_case(tmp_path_factory) -> Path:
    return write_demo_case(tmp_path_factory.mktemp("demo") / "case")


@pytest.fixture
def case(demo_case, tmp_path) -> Path:
    return Path(shutil.copytree(demo_case, tmp_path / "case"))


def refused(case: Path, *more: str) -> str:
    out = case.parent / "out"
    result = CliRunner().invoke(
        app,
        ["diagnose", str(case), "--json", f"{out}/v.json", "--report", f"{out}/r.html", *more],
    )
    assert result.exit_code == 2, result.output
    assert not out.exists()
    return " ".join(result.output.split())


def edit(path: Path, change) -> None:
    frame = pd.read_parquet(path)
    change(frame).to_parquet(path, index=False)


def test_truncated_parquet(case):
    path = case / "logs" / "moves.parquet"
    path.write_bytes(path.read_bytes()[:5000])
    assert "moves.parquet" in refused(case)


def test_wrong_column(case):
    edit(case / "logs" / "moves.parquet", lambda f: f.rename(columns={"torque_cmd_2": "torque_2"}))
    message = refused(case)
    assert "moves.parquet" in message
    assert "torque_cmd_2" in message


def test_nan(case):
    def spoil(frame):
        frame.loc[100:109, "position_1"] = np.nan
        return frame

    edit(case / "logs" / "moves.parquet", spoil)
    message = refused(case)
    assert "position_1" in message
    assert "10" in message


def test_missing_axis(case):
    for path in (case / "logs").iterdir():
        edit(path, lambda f: f.drop(columns=[c for c in f if c.endswith("_3")]))
    assert "3 axes" in refused(case)


def test_unequal_rates(case):
    edit(case / "logs" / "moves.parquet", lambda f: f.assign(time_s=f.time_s * 2))
    assert "moves" in refused(case)


def test_time_that_runs_backward(case):
    def swap(frame):
        frame.loc[[50, 51], "time_s"] = frame.loc[[51, 50], "time_s"].to_numpy()
        return frame

    edit(case / "logs" / "moves.parquet", swap)
    assert "time_s" in refused(case)


def test_unknown_key_in_case(case):
    path = case / "case.toml"
    path.write_text('colour = "red"\n' + path.read_text())
    assert "colour" in refused(case)


def test_unknown_key_in_robot(case):
    path = case / "robot.toml"
    path.write_text(path.read_text().replace("[sensor]", "[sensor]\ncolour = 1.0"))
    message = refused(case)
    assert "colour" in message
    assert "line" in message


def test_no_mass_on_a_loaded_link(case):
    path = case / "robot.toml"
    path.write_text(path.read_text().replace("mass = 260.0", "mass = 0.0"))
    assert "mass" in refused(case)


def test_log_shorter_than_a_second(case):
    edit(case / "logs" / "moves.parquet", lambda f: f.iloc[:1500])
    message = refused(case)
    assert "moves.parquet" in message
    assert "second" in message or "1 s" in message


def test_model_with_another_axis_count(case):
    assert "1" in refused(case, "--model", ROBOT)


def test_logs_need_a_model(case):
    result = CliRunner().invoke(app, ["diagnose", str(case / "logs" / "moves.parquet")])
    assert result.exit_code == 2
    assert "--model" in result.output


def test_tolerance_names_what_it_expects(case):
    assert "stiffness" in refused(case, "--tolerance", "colour=0.1")
    assert "NAME=VALUE" in refused(case, "--tolerance", "mass")


def test_check_reports_and_fails_on_a_bad_log(case):
    good = CliRunner().invoke(app, ["check", str(case / "logs" / "moves.parquet")])
    assert good.exit_code == 0, good.output
    edit(case / "logs" / "moves.parquet", lambda f: f.assign(position_1=np.nan))
    bad = CliRunner().invoke(app, ["check", str(case / "logs" / "moves.parquet")])
    assert bad.exit_code == 1


def test_simulate_writes_a_log_that_reads(case, tmp_path):
    out = tmp_path / "run.parquet"
    source = str(case / "logs" / "moves.parquet")
    result = CliRunner().invoke(app, ["simulate", "irb6600_like", source, "--out", str(out)])
    assert result.exit_code == 0, result.output
    assert len(pd.read_parquet(out)) == len(pd.read_parquet(source))


def simulated(case: Path, *more: str, robot: str = "irb6600_like") -> pd.DataFrame:
    """The log that ``axisight simulate`` writes along the moves of the case."""
    out = case.parent / "run.parquet"
    source = str(case / "logs" / "moves.parquet")
    result = CliRunner().invoke(app, ["simulate", robot, source, "--out", str(out), *more])
    assert result.exit_code == 0, result.output
    return pd.read_parquet(out)


def columns(frame: pd.DataFrame, name: str) -> np.ndarray:
    return frame[[f"{name}_{i}" for i in (1, 2, 3)]].to_numpy()


def short(case: Path) -> Path:
    """The case with logs of a second, the least that is read."""
    edit(case / "logs" / "moves.parquet", lambda f: f.iloc[:2100])
    return case


OPTIONS = {
    "nothing": ([], {}),
    "linear": (["--model", "linear"], {"model": "linear"}),
    "rk4": (["--method", "rk4", "--substeps", "3"], {"method": "rk4", "substeps": 3}),
    "rodas4": (
        ["--method", "rodas4", "--tolerance", "1e-3"],
        {"method": "rodas4", "tolerance": 1e-3},
    ),
    "start": (["--start", "-0.1,0.2,0"], {"start_rad": [-0.1, 0.2, 0.0]}),
    "resolution": (["--resolution", "1e-4"], {"position_resolution_rad": 1e-4}),
    "white noise": (["--noise-seed", "3"], {"noise_seed": 3}),
    "coloured noise": (
        ["--noise-seed", "3", "--run", "7", "--noise-cutoff-hz", "50"],
        {"noise_seed": 3, "run": 7, "noise_cutoff_hz": 50.0},
    ),
    "effects": (
        [
            "--effect",
            "coulomb_friction@2 coulomb_nm=0.5 smoothing_rad_s = 0.2",
            "--effect",
            "payload:mass_kg=30",
            "--effect",
            "backlash@1",
        ],
        {
            "effects": [
                Effect("coulomb_friction", 2, {"coulomb_nm": 0.5, "smoothing_rad_s": 0.2}),
                Effect("payload", None, {"mass_kg": 30.0}),
                Effect("backlash", 1),
            ]
        },
    ),
}


@pytest.mark.parametrize("torque", [False, True], ids=["reference", "torque"])
@pytest.mark.parametrize("name", OPTIONS)
def test_simulate_does_what_the_library_does(case, name, torque):
    arguments, options = OPTIONS[name]
    got = simulated(short(case), *arguments, *(["--torque"] if torque else []))
    source = pd.read_parquet(case / "logs" / "moves.parquet")
    driven = "torque_nm" if torque else "velocity_ref_rad_s"
    inputs = columns(source, "torque_cmd" if torque else "velocity_ref")
    want = simulate(load_robot("irb6600_like"), **{driven: inputs}, **options)
    assert np.array_equal(columns(got, "torque_cmd"), want["torque_cmd_nm"])
    assert np.array_equal(columns(got, "position"), want["position_rad"])
    assert ("velocity_ref_1" in got) == (not torque)
    if name != "nothing":
        plain = simulated(case, *(["--torque"] if torque else []))
        assert not np.array_equal(columns(got, "position"), columns(plain, "position"))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--effect", "wobble@1"], ["unknown effect 'wobble'", "axisight effects"]),
        (
            ["--effect", "columb_friction@1"],
            ["unknown effect 'columb_friction'. Did you mean 'coulomb_friction'?"],
        ),
        (["--effect", "backlash@one"], ["1 to 3 or a joint name (axis1, axis2, axis3)", "'one'"]),
        (["--effect", "backlash@-1"], ["1 to 3 or a joint name", "'-1'"]),
        (["--effect", "backlash@axis_2"], ["Did you mean 'axis2'?"]),
        (["--effect", "backlash@1,2,3"], ["one axis or two after @", "'1,2,3'"]),
        (["--effect", "backlash@1:half_width_rad"], ["PARAM=VALUE", "half_width_rad"]),
        (["--effect", "backlash@1:half_width_rad=wide"], ["half_width_rad", "numbers", "wide"]),
        (["--effect", "backlash@1:width=1"], ["width", "half_width_rad"]),
        (["--effect", "backlash@1:half_width_rad=1e-4,half_width_rad=2e-4"], ["twice"]),
        (["--effect", "backlash@4:half_width_rad=1e-4"], ["expected 1 to 3", "got 4"]),
        (["--effect", "backlash"], ["backlash", "no axis"]),
        (["--effect", "payload@1:mass_kg=3"], ["payload"]),
        (["--effect", "backlash@1 half_width_rad 1e-4"], ["PARAM=VALUE", "'half_width_rad'"]),
        (["--effect", "backlash@1 half_width_rad=-1"], ["--effect", "half_width_rad", "-1"]),
        (["--effect", "backlash@1 half_width_rad=nan"], ["half_width_rad"]),
        (["--effect", "backlash@1", "--effect", "backlash@1"], ["backlash@1 once", "twice"]),
        (["--effect", ""], ["unknown effect ''"]),
        (["--from", "-1"], ["--from", "not below zero", "-1"]),
        (["--from", "9"], ["--from", "less than 5", "9 s"]),
        (["--from", "3", "--to", "2"], ["--from", "less than 2 s", "3 s"]),
        (["--to", "0"], ["--to", "positive"]),
        (["--to", "0.5"], ["--from, --to", "at least 1 s", "0.5 s"]),
        (["--start", "0,zero,0"], ["--start", "numbers", "0,zero,0"]),
        (["--start", "0,0"], ["start_rad", "3"]),
        (["--method", "euler"], ["method", "rodas4", "euler"]),
        (["--model", "affine"], ["model", "linear", "affine"]),
        (["--tolerance", "2"], ["tolerance", "2"]),
        (["--substeps", "0"], ["substeps", "0"]),
        (["--resolution", "-1"], ["resolution", "-1"]),
        (["--noise-seed", "-1"], ["seed", "-1"]),
        (["--noise-cutoff-hz", "5"], ["noise_cutoff_hz", "noise_seed"]),
        (["--model", "linear", "--effect", "backlash@1:half_width_rad=1e-4"], ["nonlinear"]),
    ],
)
def test_simulate_refuses_by_name(case, arguments, words):
    out = case.parent / "run.parquet"
    source = str(case / "logs" / "moves.parquet")
    result = CliRunner().invoke(
        app, ["simulate", "irb6600_like", source, "--out", str(out), *arguments]
    )
    assert result.exit_code == 2, result.output
    assert not out.exists()
    message = " ".join(result.output.split())
    for word in words:
        assert word in message


def test_simulate_needs_what_drives_it(case):
    edit(
        case / "logs" / "moves.parquet",
        lambda f: f.drop(columns=[f"velocity_ref_{i}" for i in (1, 2, 3)]),
    )
    out = case.parent / "run.parquet"
    source = str(case / "logs" / "moves.parquet")
    result = CliRunner().invoke(app, ["simulate", "irb6600_like", source, "--out", str(out)])
    assert result.exit_code == 2
    assert "--torque" in result.output
    assert len(simulated(case, "--torque")) > 2000


def test_simulate_needs_the_rate_of_the_robot(case):
    edit(case / "logs" / "moves.parquet", lambda f: f.assign(time_s=f.time_s * 2))
    out = case.parent / "run.parquet"
    source = str(case / "logs" / "moves.parquet")
    result = CliRunner().invoke(app, ["simulate", "irb6600_like", source, "--out", str(out)])
    assert result.exit_code == 2
    assert "0.0005 s, got 0.001 s" in " ".join(result.output.split())


def test_simulate_writes_what_there_is_of_a_failed_run(case):
    robot = case / "robot.toml"
    text = robot.read_text()
    assert "kp = [7.039" in text
    robot.write_text(text.replace("kp = [7.039", "kp = [-7.039"))
    out = case.parent / "run.parquet"
    source = str(case / "logs" / "moves.parquet")
    result = CliRunner().invoke(app, ["simulate", str(robot), source, "--out", str(out)])
    assert result.exit_code == 1
    assert "step_size_collapsed" in result.output
    assert 1 < len(pd.read_parquet(out)) < 2000


def test_simulate_uses_the_part_asked_for(case):
    # The case's robot begins at rest wherever the references do.
    got = simulated(case, "--from", "1", "--to", "2.5")
    source = pd.read_parquet(case / "logs" / "moves.parquet")
    part = source.iloc[2000:5000]
    assert len(got) == 3000
    assert got["time_s"][0] == 0.0
    assert np.array_equal(columns(got, "velocity_ref"), columns(part, "velocity_ref"))


def test_effects_are_listed():
    result = CliRunner().invoke(app, ["effects"])
    assert result.exit_code == 0
    assert "backlash" in result.output
