"""--base, --tip and --payload of commands that run a model: explore, simulate, excite."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from axisight import Robot, simulate
from axisight.cli import app
from axisight.excitation import read_references
from axisight.robot_import import import_robot
from import_data import URDF, written
from model_logs import STEP_S, branched, sines, with_load, written_log

TIP = ("--tip", "flange")
SIGNAL = ("--kind", "multisine", "--period-s", 2, "--band-hz", "0.5,3", "--peak-rad-s", 0.5)
DESIGN = (*SIGNAL, "--phases", "schroeder")


def run(*arguments: object) -> tuple[int, str]:
    result = CliRunner().invoke(app, [*map(str, arguments)])
    return result.exit_code, " ".join(result.output.split())


def positions(path: Path) -> np.ndarray:
    return pd.read_parquet(path)[["position_1", "position_2"]].to_numpy()


def at_rate(path: Path, load_kg: float | None = None) -> Robot:
    """Return the arm at the sample time of its logs."""
    drives = f"sample_time = {STEP_S}\n"
    drives += "" if load_kg is None else f"[payload]\nmass = {load_kg}\n"
    file = path.with_name("stated.toml")
    file.write_text(drives)
    return import_robot(path, tip="flange", drives=file)


@pytest.mark.parametrize("load_kg", [None, 0.8])
def test_a_run_takes_tip_and_payload(tmp_path: Path, load_kg: float | None):
    """As drive data that say the same; the sample time is that of the log."""
    path, out = branched(tmp_path), tmp_path / "run.parquet"
    log = written_log(tmp_path, 0, with_load(path, 0.8), lambda q, _: 0 * q)
    command = ("simulate", path, log, "--torque", "--to", 1.0, "--out", out)
    status, said = run(*command)
    assert status == 2 and "got 2 moving branches" in said and "simulate" in said
    given = () if load_kg is None else ("--payload", load_kg)
    status, said = run(*command, *TIP, *given)
    assert status == 0, said
    assert "no gear ratios" in said
    torque = pd.read_parquet(log)[["torque_cmd_1", "torque_cmd_2"]].to_numpy()
    wanted = simulate(at_rate(path, load_kg), torque_nm=torque[: len(positions(out))])
    np.testing.assert_array_equal(positions(out), wanted["position_rad"].values)


def test_a_run_may_begin_further_up(tmp_path: Path):
    path, out = written(tmp_path, URDF), tmp_path / "run.parquet"
    log = written_log(tmp_path, 0, import_robot(path, base="upper"), lambda q, _: 0 * q)
    command = ("simulate", path, log, "--torque", "--to", 1.0, "--out", out)
    assert run(*command)[0] == 2
    status, said = run(*command, "--base", "upper")
    assert status == 0, said
    assert "position_2" not in pd.read_parquet(out)


def test_references_are_made_for_the_arm_that_is_meant(tmp_path: Path):
    """What the load adds to the torque along the references passes a limit between both."""
    path, out = branched(tmp_path), tmp_path / "references.parquet"
    command = ("excite", "--robot", path, *DESIGN, "--out", out)
    status, said = run(*command)
    assert status == 2 and "got 2 moving branches" in said and "excite" in said
    status, said = run(*command, *TIP)
    assert status == 0, said
    assert "no gear ratios" in said
    most = [largest_torque(import_robot(path, tip="flange"), out)]
    most += [largest_torque(with_load(path, 5.0), out)]
    assert most[1] > 1.2 * most[0]
    limit = ("--torque-limit", np.mean(most))
    status, said = run(*command, *TIP, *limit)
    assert status == 0, said
    status, said = run(*command, *TIP, *limit, "--payload", 5.0)
    assert status == 1 and "nothing was written" in said


def largest_torque(robot: Robot, references: Path) -> float:
    """Return the largest torque [Nm] along references from rest at zero, by inverse dynamics."""
    read, largest = read_references(references), 0.0
    for speed in read.period:
        angle = np.cumsum(speed, axis=0) * read.sample_time_s
        faster = np.gradient(speed, read.sample_time_s, axis=0)
        largest = max(largest, np.abs(robot.inverse_dynamics(angle, speed, faster)).max())
    return float(largest)


def test_references_run_at_their_own_rate(tmp_path: Path):
    """A model file says no sample time; its controller needs drive data, of which one is not stated."""
    path, made, out = branched(tmp_path), tmp_path / "made.parquet", tmp_path / "run.parquet"
    drives = path.with_name("arm.drives.toml")
    loop = '[controller]\nkind = "pi_velocity"\nkp = [60.0, 6.0]\nki = [60.0, 6.0]\n'
    drives.write_text(f"sample_time = 0.002\n{loop}")
    status, said = run("excite", "--robot", path, *DESIGN, *TIP, "--out", made)
    assert status == 0, said
    drives.write_text(loop)
    status, said = run("simulate", path, made, "--experiment", 1, *TIP, "--out", out)
    assert status == 0, said
    steps = np.diff(pd.read_parquet(out)["time_s"])
    np.testing.assert_allclose(steps, 0.002, rtol=1e-9)


def test_the_explorer_takes_tip_and_payload(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """What the page would be made of; the page itself is the same for any robot."""
    pytest.importorskip("panel", reason="Panel comes with the extra `explore`")
    explorer = import_module("axisight.explore.app")

    class Page:
        url = "http://127.0.0.1/"

        def run(self) -> None:
            """End at once."""

    seen: list[Any] = []
    monkeypatch.setattr(explorer, "prepared", lambda inputs, *_: seen.append(inputs))
    monkeypatch.setattr(explorer, "served", lambda *_: Page())
    path = branched(tmp_path)
    machine = with_load(path, 0.8)
    logs = [written_log(tmp_path, k, machine, lambda q, _: 0 * q) for k in range(2)]
    status, said = run("explore", path, *logs, "--no-open")
    assert status == 2 and "got 2 moving branches" in said and "explore" in said
    status, said = run("explore", path, *logs, "--no-open", *TIP, "--payload", 0.8)
    assert status == 0, said
    (inputs,) = seen
    assert inputs.robot.sample_time_s == STEP_S
    angle, *_ = sines(0, 2)
    np.testing.assert_array_equal(inputs.robot.gravity(angle), machine.gravity(angle))


@pytest.mark.parametrize("command", ["explore", "simulate", "excite"])
def test_a_robot_file_has_no_use_for_them(tmp_path: Path, command: str):
    log = written_log(tmp_path, 0, import_robot(written(tmp_path, URDF)), lambda q, _: 0 * q)
    out = ("--out", tmp_path / "out.parquet")
    arguments = {
        "explore": ("--model", "irb6600_like", log, log, "--no-open"),
        "simulate": ("irb6600_like", log, *out),
        "excite": ("--robot", "irb6600_like", *DESIGN, *out),
    }
    status, said = run(command, *arguments[command], *TIP)
    assert status == 2
    assert "--tip: expected a model file (URDF" in said
