"""The command line: bad input gives a message and status 2, and nothing half-written."""

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from axisight.cli import app
from axisight.demo import write_demo_case

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


def test_effects_are_listed():
    result = CliRunner().invoke(app, ["effects"])
    assert result.exit_code == 0
    assert "backlash" in result.output
