"""Currents in logs: torques by the torque constants of drives."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from axisight import RobotError, load_robot
from axisight.cli import app
from axisight.errors import InputError, LogError
from axisight.logs import check_log, parse_column_map, read_case, read_log
from axisight.robot_import import import_robot
from import_data import URDF, written

TIME_S = 0.01 * np.arange(300)
CURRENT_A = np.column_stack([np.sin(TIME_S), 2 * np.cos(TIME_S)])
DRIVES = "[joint.shoulder]\ntorque_constant = 0.12\n[joint.elbow]\ntorque_constant = 0.05\n"


def column_map(side: str = "motor", second: str = "", unit: str = "A") -> str:
    axes = "".join(
        f'[[axis]]\nposition = {{ name = "q{k}", unit = "rad" }}\n'
        f'torque = {{ name = "i{k}", unit = "{unit}", sign = -1{more} }}\n'
        for k, more in enumerate(("", second))
    )
    return f'schema = "axisight.columns/1"\nside = "{side}"\ntime = {{ name = "t" }}\n{axes}'


def written_log(folder: Path) -> Path:
    path = folder / "run.csv"
    columns = {f"{name}{k}": CURRENT_A[:, k] for name in "qi" for k in (0, 1)}
    pd.DataFrame({"t": TIME_S, **columns}).to_csv(path, index=False)
    return path


def arm(folder: Path, drives: str = DRIVES) -> Path:
    written(folder, drives, "arm.drives.toml")
    return written(folder, URDF)


@pytest.mark.parametrize("side", ["motor", "joint"])
def test_a_current_is_torque_of_the_motor_by_its_constant(tmp_path: Path, side: str):
    """Positions of joints become those of motors by the gear ratio, 1/50 of the first; currents are the motors'."""
    robot = load_robot(arm(tmp_path))
    log = read_log(written_log(tmp_path), parse_column_map(column_map(side)), robot=robot)
    np.testing.assert_allclose(log.torque_nm, -CURRENT_A * [0.12, 0.05], rtol=1e-12)
    turns = 50.0 if side == "joint" else 1.0
    np.testing.assert_allclose(log.position_rad, CURRENT_A * [turns, 1.0], rtol=1e-12)


def test_a_scale_comes_before_a_constant(tmp_path: Path):
    columns = parse_column_map(column_map(second=", scale = 3.0"))
    log = read_log(written_log(tmp_path), columns, robot=load_robot(arm(tmp_path)))
    np.testing.assert_allclose(log.torque_nm, -CURRENT_A * [0.12, 3.0], rtol=1e-12)


def test_a_current_that_nothing_makes_a_torque_is_refused(tmp_path: Path):
    columns, log = parse_column_map(column_map()), written_log(tmp_path)
    half = load_robot(arm(tmp_path, DRIVES.split("[joint.elbow]", maxsplit=1)[0]))
    with pytest.raises(LogError, match=r"i1: expected scale .* joint\.elbow\.torque_constant"):
        read_log(log, columns, robot=half)
    with pytest.raises(LogError, match=r"axis 1: torque: expected scale .*a robot"):
        read_log(log, columns)
    with pytest.raises(LogError, match=r"expected scale \(Nm or N per V\) beside it"):
        parse_column_map(column_map(unit="V"))
    found = check_log(log, columns)
    assert found.ok
    assert [f.column for f in found.findings if "a current without" in f.message] == ["i0", "i1"]


def test_constants_stay_with_a_robot(tmp_path: Path):
    robot = load_robot(arm(tmp_path))
    assert robot.torque_constants == (0.12, 0.05)
    others = (
        robot.with_effects([]),
        robot.with_parameters({"elbow.mass": 3.0}),
        robot.with_operating_point([0.1, 0.2]),
    )
    assert all(other.torque_constants == (0.12, 0.05) for other in others)
    # A robot file has no place for them, and says so.
    assert "# torque constants shoulder 0.12, elbow 0.05 Nm/A" in robot.toml
    again = load_robot(written(tmp_path, robot.toml, "robot.toml"))
    assert again.torque_constants == (None, None)
    assert again.with_torque_constants([0.12, None]).torque_constants == (0.12, None)
    assert "torque constants" not in import_robot(arm(tmp_path, "")).toml
    with pytest.raises(InputError, match="expected 2 entries, got 1"):
        again.with_torque_constants([0.12])
    with pytest.raises(InputError, match="nm_per_a: expected a positive number"):
        again.with_torque_constants([0.12, 0.0])
    with pytest.raises(RobotError, match=r"joint\.elbow\.torque_constant"):
        load_robot(arm(tmp_path, "[joint.elbow]\ntorque_constant = -0.1\n"))


def test_a_case_and_a_check_read_currents(tmp_path: Path):
    path, log = arm(tmp_path), written_log(tmp_path)
    columns = written(tmp_path, column_map(), "columns.toml")
    (tmp_path / "case.toml").write_text(
        'schema = "axisight.case/1"\nname = "c"\nrobot = "arm.urdf"\n'
        '[[log]]\nfile = "run.csv"\nrole = "estimation"\n'
    )
    case = read_case(tmp_path, columns)
    np.testing.assert_allclose(case.logs[0].torque_nm, -CURRENT_A * [0.12, 0.05], rtol=1e-12)
    arguments = ["check", str(log), "--columns", str(columns), "--robot", str(path)]
    said = " ".join(CliRunner().invoke(app, arguments).output.split())
    assert "a current without a scale" in said
    assert "expected scale" not in said
    (tmp_path / "arm.drives.toml").unlink()
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 1
    assert "joint.shoulder.torque_constant" in " ".join(result.output.split())
