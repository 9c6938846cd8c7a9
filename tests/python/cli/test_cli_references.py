"""The command ``axisight simulate`` along references that ``axisight excite`` wrote."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from axisight import load_robot, simulate
from axisight.cli import app
from axisight.excitation import read_references

EXCITE = "excite --robot irb6600_like --period-s 0.5 --band-hz 2,60 --peak-rad-s 20 --phases random"


def excited(folder: Path, ending: str) -> str:
    path = folder / f"references{ending}"
    result = CliRunner().invoke(app, [*EXCITE.split(), "--out", str(path)])
    assert result.exit_code == 0, result.output
    return str(path)


@pytest.mark.parametrize("ending", [".parquet", ".csv", ".mat"])
def test_references_are_simulated_period_after_period(tmp_path: Path, ending: str):
    path, out = excited(tmp_path, ending), tmp_path / "run.parquet"
    command = ["simulate", "irb6600_like", path, "--experiment", "2", "--periods", "3"]
    result = CliRunner().invoke(app, [*command, "--out", str(out)])
    assert result.exit_code == 0, result.output
    got = pd.read_parquet(out)
    robot, period = load_robot("irb6600_like"), read_references(path).period[1]
    want = simulate(robot, np.tile(period, (3, 1)))["position_rad"].values
    np.testing.assert_array_equal(got[["position_1", "position_2", "position_3"]], want)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ([], "--experiment: expected one of 1 to 3"),
        (["--experiment", "4"], "--experiment: expected one of 1 to 3"),
        (["--experiment", "1", "--periods", "0"], "--periods: expected a positive number, got 0"),
        (["--experiment", "1", "--torque"], "--from, --to, --moving, --torque: expected a log"),
        (
            ["--experiment", "1", "--from", "0.1"],
            "--from, --to, --moving, --torque: expected a log",
        ),
    ],
)
def test_what_references_have_not_is_refused(tmp_path: Path, more: list[str], words: str):
    command = ["simulate", "irb6600_like", excited(tmp_path, ".parquet"), *more]
    result = CliRunner().invoke(app, [*command, "--out", str(tmp_path / "run.parquet")])
    assert result.exit_code == 2
    assert words in " ".join(result.output.split())


def test_references_of_another_rate_are_refused(tmp_path: Path):
    robot = tmp_path / "robot.toml"
    text = load_robot("irb6600_like").toml
    slower = text.replace("sample_time = 5.0e-4", "sample_time = 1.0e-3")
    assert slower != text
    robot.write_text(slower, "utf-8")
    command = ["simulate", str(robot), excited(tmp_path, ".parquet"), "--experiment", "1"]
    result = CliRunner().invoke(app, [*command, "--out", str(tmp_path / "run.parquet")])
    assert "expected the sample time of the robot, 0.001 s, got 0.0005 s" in " ".join(
        result.output.split()
    )


def test_a_log_has_no_experiments(tmp_path: Path):
    path, out = excited(tmp_path, ".parquet"), str(tmp_path / "run.parquet")
    made = CliRunner().invoke(
        app, ["simulate", "irb6600_like", path, "--experiment", "1", "--out", out]
    )
    assert made.exit_code == 0, made.output
    again = ["simulate", "irb6600_like", out, "--experiment", "1"]
    result = CliRunner().invoke(app, [*again, "--out", str(tmp_path / "again.parquet")])
    assert result.exit_code == 2
    assert "--experiment, --each, --periods: expected references, got the log" in " ".join(
        result.output.split()
    )
