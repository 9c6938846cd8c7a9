"""The command ``axisight check --robot``: what a diagnosis would say of a log before it fits anything."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from axisight import load_robot
from axisight.cli import app
from axisight.cli.demo import write_demo_case
from axisight.errors import LogError
from axisight.logs import read_log
from import_data import URDF, written
from model_logs import sines, written_log, written_table

DIRECT = URDF.replace("<mechanicalReduction>50<", "<mechanicalReduction>1<")
HELD = """[controller]
kind = "pd_position"
kp = [900.0, 300.0]
kd = [60.0, 20.0]
"""


def run(*arguments: str | Path, status: int) -> str:
    done = CliRunner().invoke(app, [*map(str, arguments)])
    assert done.exit_code == status, (done.output, done.exception)
    # Without the borders of the table, across which texts are folded.
    return " ".join(re.sub("[│┃]", " ", done.output).split())


@pytest.fixture(scope="module")
def demo_case(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_demo_case(tmp_path_factory.mktemp("made") / "case")


@pytest.fixture
def case(demo_case: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(demo_case, tmp_path / "case"))


def exchanged(log: Path, one: str, other: str) -> None:
    frame = pd.read_parquet(log)
    frame[[one, other]] = frame[[other, one]]
    frame.to_parquet(log, index=False)


def test_what_diagnose_refuses_is_told_in_its_words(case: Path) -> None:
    log, robot = case / "logs" / "moves.parquet", case / "robot.toml"
    said = run("check", log, "--robot", robot, status=0)
    assert "Torques are compared in closed loop" in said
    assert "refused" not in said
    exchanged(log, "torque_cmd_1", "torque_cmd_2")
    assert "0 errors" in run("check", log, status=0)
    said = run("check", log, "--robot", robot, status=1)
    assert "refused: axes_swapped: moves: torque_cmd_1: " in said
    assert "would be refused" in said
    by_diagnose = run("diagnose", case, status=2)
    messages = by_diagnose.split("error: ")[1].split(" axes_swapped: ")
    assert len(messages) == 2
    assert all(message in said for message in messages)


def test_a_sign_beside_a_urdf(tmp_path: Path) -> None:
    model = written(tmp_path, DIRECT)
    robot = load_robot(model)
    log = written_log(tmp_path, 1, robot.with_effects([]), lambda q, v: np.zeros_like(q))
    said = run("check", log, "--robot", model, status=0)
    assert "imported from" in said
    assert "Torques are compared by inverse dynamics" in said
    frame = pd.read_parquet(log)
    frame.assign(torque_cmd_1=-frame.torque_cmd_1).to_parquet(log, index=False)
    said = run("check", log, "--robot", model, status=1)
    assert "refused: sign_flipped: run1: torque_cmd_1: " in said


def test_a_doubt_is_told_once(case: Path) -> None:
    log, robot = case / "logs" / "moves.parquet", case / "robot.toml"
    frame = pd.read_parquet(log)
    limit = 0.5 * frame.torque_cmd_1.max()
    frame.assign(torque_cmd_1=frame.torque_cmd_1.clip(upper=limit)).to_parquet(log, index=False)
    said = run("check", log, "--robot", robot, status=0)
    assert said.count("saturates") == 1


def test_a_log_of_another_robot(case: Path) -> None:
    log = case / "logs" / "moves.parquet"
    said = run("check", log, "--robot", "two_mass_axis", status=1)
    assert "refused: " in said
    assert "expected 1 axes, got columns for 3 [axes_differ]" in said
    assert "no_such_robot" in run("check", log, "--robot", "no_such_robot", status=2)


def test_positions_and_targets(tmp_path: Path) -> None:
    model, log = written(tmp_path, URDF), tmp_path / "run.parquet"
    robot = load_robot(model)
    angle, _, _ = sines(1, 2, 400)
    wave = angle - angle[0]
    wave = wave * np.clip(np.arange(400) / 100, 0, 1)[:, None] / robot.gear_ratio
    written_table(log, wave, wave, step_s=0.02)
    frame = pd.read_parquet(log)
    renamed = frame.rename(columns={f"torque_cmd_{k}": f"position_ref_{k}" for k in (1, 2)})
    renamed.to_parquet(log, index=False)
    said = run("check", log, status=0)
    assert "positions under the same targets" in said
    said = run("check", log, "--robot", model, status=1)
    assert "refused: torque: expected logged torques, or a robot file" in said
    (tmp_path / "arm.drives.toml").write_text(HELD)
    said = run("check", log, "--robot", model, status=0)
    assert "positions are compared under the same targets, up to 10 Hz" in said


def uneven(folder: Path) -> Path:
    """Write a CSV of 2 axes at 250 Hz whose stamps are off by up to a fifth of a sample."""
    time = 0.004 * (np.arange(2000) + np.random.default_rng(0).uniform(-0.2, 0.2, 2000))
    angle, _, _ = sines(0, 2, 2000)
    columns = {"time_s": time - time[0]}
    for i in range(2):
        columns |= {f"position_{i + 1}": angle[:, i], f"torque_cmd_{i + 1}": 3 * angle[:, i]}
    path = folder / "a run.csv"
    pd.DataFrame(columns).to_csv(path, index=False)
    return path


def test_uneven_stamps_are_refused_with_the_command_that_helps(tmp_path: Path) -> None:
    log, columns = uneven(tmp_path), tmp_path / "columns.toml"
    with pytest.raises(LogError, match="resample_hz = 250 in ") as refused:
        read_log(log)
    # The words between backticks, as a shell would read them.
    (command,) = re.findall("`axisight (.*?)`", str(refused.value))
    words = [columns if word == "columns.toml" else word for word in shlex.split(command)]
    assert words[:3] == ["columns", "guess", str(log)]
    assert "resample_hz = 250" in run("check", log, status=1)
    run(*words, status=0)
    assert read_log(log, columns).sample_rate_hz == pytest.approx(250.0)
    assert "0 errors" in run("check", log, "--columns", columns, status=0)


def test_uneven_stamps_in_a_map_are_refused_with_its_line(tmp_path: Path) -> None:
    log, columns = uneven(tmp_path), tmp_path / "columns.toml"
    axes = [
        f'[[axis]]\nposition = {{ name = "position_{k}", unit = "rad" }}\n'
        f'torque = {{ name = "torque_cmd_{k}", unit = "Nm" }}'
        for k in (1, 2)
    ]
    lines = ['schema = "axisight.columns/1"', '[time]\nname = "time_s"\nunit = "s"', *axes]
    columns.write_text("\n".join(lines))
    said = run("check", log, "--columns", columns, status=1)
    assert "columns guess" not in said
    (line,) = re.findall(r"by the line (resample_hz = \S+) in \[time\]", said)
    lines.insert(2, line)
    columns.write_text("\n".join(lines))
    assert "0 errors" in run("check", log, "--columns", columns, status=0)
    # Said of samples that are uniform in truth: the rate alone.
    (rate,) = re.findall(r"by (sample_rate_hz = \S+) at its top instead of \[time\]", said)
    columns.write_text("\n".join([lines[0], rate, *axes]))
    assert "0 errors" in run("check", log, "--columns", columns, status=0)
