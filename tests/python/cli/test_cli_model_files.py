"""The command ``axisight robot``, and model files where commands take a robot."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from axisight import load_robot
from axisight.cli import app
from axisight.robot_import import import_robot
from axisight.robot_import.drives import DriveData
from import_data import DH, MJCF, URDF, dh_toml, written
from model_logs import branched, with_load, written_log, written_table


def run(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(app, [*map(str, arguments)])
    return result.exit_code, " ".join(result.output.split())


def test_a_model_becomes_a_robot_file(tmp_path: Path):
    path, out = written(tmp_path, URDF), tmp_path / "robot.toml"
    status, said = run("robot", "import", path, "-o", out, "--payload", "3,0.1,0.2,0.3")
    assert status == 0, said
    assert "2 axes, shoulder, elbow" in said
    assert "no rotors: motors have no inertia" in said
    assert "no gear ratios" not in said
    plain, q = load_robot(path), np.array([0.4, -0.7])
    load = DriveData.model_validate({"payload": {"mass": 3.0, "com": (0.1, 0.2, 0.3)}})
    loaded = import_robot(path, drives=load)
    np.testing.assert_array_equal(load_robot(out).gravity(q), loaded.gravity(q))
    assert not np.allclose(loaded.gravity(q), plain.gravity(q))
    # Nothing is written over unasked.
    status, said = run("robot", "import", path, "-o", out)
    assert (status, "--force" in said) == (2, True)
    assert run("robot", "import", path, "-o", out, "--force")[0] == 0
    assert load_robot(out).gravity(q) == pytest.approx(plain.gravity(q))


def test_without_a_file_it_is_printed(tmp_path: Path):
    status, said = run("robot", "import", written(tmp_path, DH, "arm.csv"))
    assert status == 0
    assert 'schema = "axisight.robot/2"' in said


def test_a_table_as_toml_is_told_from_a_robot_file(tmp_path: Path):
    """By what is in it: it may stand first among logs, has notes, and takes a load."""
    table, out = written(tmp_path, dh_toml(), "table.toml"), tmp_path / "robot.toml"
    status, said = run("robot", "import", table, "-o", out)
    assert status == 0, said
    assert "3 axes, one, two, three" in said
    robot = load_robot(out)
    log = written_log(tmp_path, 0, robot, lambda q, _: 0 * q)
    status, said = run("check", log, "--robot", table, "--payload", "0.5")
    assert status == 0, said
    status, said = run("check", log, "--robot", out, "--payload", "0.5")
    assert (status, "--payload: expected a model file" in said) == (2, True)
    status, said = run("diagnose", table, log, log)
    assert "imported from table.toml" in said, said
    # A robot file is no table.
    status, said = run("robot", "import", out)
    assert (status, "expected a table of Denavit and Hartenberg" in said) == (2, True)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--tip", "hand"], "--tip: expected a link"),
        (["--payload", "heavy"], "--payload: expected KG or KG,X,Y,Z"),
        (["--payload", "1,2"], "--payload: expected KG or KG,X,Y,Z"),
        (["--payload", "-1"], "--payload: expected KG or KG,X,Y,Z with a positive mass"),
        (["--drives", "none.toml"], "none.toml: expected a readable file"),
    ],
)
def test_misuse_is_named(tmp_path: Path, arguments: list[str], message: str):
    status, said = run("robot", "import", written(tmp_path, URDF), *arguments)
    assert status == 2
    assert message in said


def test_a_model_needs_logs_beside_it(tmp_path: Path):
    status, said = run("diagnose", written(tmp_path, URDF))
    assert status == 2
    assert "expected logs beside the model, got none" in said


def test_a_model_that_cannot_be_written_is_said_before_anything(tmp_path: Path):
    time = 0.01 * np.arange(300)
    motion = np.column_stack([np.sin(time), np.cos(time)])
    log = written_table(tmp_path / "run.parquet", motion, motion)
    path = written(tmp_path, URDF)
    status, said = run("diagnose", path, log, "--validation", log, "--write-model", path)
    assert status == 2
    assert "got an input" in said


def test_friction_that_a_urdf_lacks_is_found(tmp_path: Path):
    """Joint-side logs at 100 Hz beside a URDF without friction: nothing else is said of the machine."""
    bare = URDF.replace('<dynamics damping="0.7" friction="1.5"/>', "")
    bare = bare[: bare.index("  <transmission")] + "</robot>"
    path = written(tmp_path, bare)
    robot = load_robot(path)
    friction = np.array([1.5, 0.0])
    logs = [
        written_log(tmp_path, k, robot, lambda _, v: friction * np.tanh(v / 0.01)) for k in range(3)
    ]
    new = tmp_path / "new.urdf"
    status, said = run("diagnose", path, *logs[:2], "--validation", logs[2], "--write-model", new)
    assert status == 0, said
    assert f"model: {new}, with coulomb_friction@1" in said
    # The same as a case, whose robot is the URDF.
    case = tmp_path / "case"
    case.mkdir()
    roles = ("estimation", "estimation", "validation")
    entries = [
        f'[[log]]\nfile = "run{k}.parquet"\nrole = "{role}"\nexcitation = "sines"\n'
        for k, role in enumerate(roles)
    ]
    for file in (path, *logs):
        (case / file.name).write_bytes(file.read_bytes())
    (case / "case.toml").write_text(
        'schema = "axisight.case/1"\nname = "arm"\nrobot = "arm.urdf"\n' + "".join(entries)
    )
    status, said = run("diagnose", case)
    assert status == 0, said
    assert "explained" in said
    (found,) = load_robot(new).effects
    assert found.values()[0] == pytest.approx(1.5, rel=0.02)
    assert "no gear ratios: angles and torques of motors are those of the joints" in said
    assert "explained" in said
    assert "coulomb_friction@1" in said or "Coulomb friction" in said


def test_causes_without_a_number_are_told_why(tmp_path: Path):
    """An MJCF has no friction that depends on the angle: the command says what to do about it."""
    bare = MJCF.replace('frictionloss="1.5" armature="0.2" stiffness="3"', "")
    bare = bare.replace('damping="0.7"', "").replace(' gear="50"', "").replace(' ref="0.3"', "")
    bare = bare.replace('<joint name="slide" type="slide" axis="1 0 0" pos="0 0.1 0"/>', "")
    path = written(tmp_path, bare, "arm.xml")
    size = np.array([1.0, 0.0])

    def of_angle(q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return size * (1.5 + 1.2 * np.sin(q)) * np.tanh(v / 0.03)

    logs = [written_log(tmp_path, k, load_robot(path), of_angle) for k in range(3)]
    new = tmp_path / "new.xml"
    status, said = run("diagnose", path, *logs[:2], "--validation", logs[2], "--write-model", new)
    assert status == 0, said
    assert f"model: {new}, with none" in said
    assert (
        "no place in it for position_dependent_friction@1: MJCF has no number for it: axisight.mujoco.apply adds it at "
        "every step"
    ) in said
    assert new.read_text() == bare


def test_a_diagnosis_takes_tip_and_payload(tmp_path: Path):
    path = branched(tmp_path)
    machine = with_load(path, 0.8)
    logs = [written_log(tmp_path, k, machine, lambda q, _: 0 * q) for k in range(3)]
    new, verdict = tmp_path / "new.urdf", tmp_path / "verdict.json"
    status, said = run("diagnose", path, *logs, "--max-causes", 1)
    assert status == 2 and "got 2 moving branches" in said and "--tip" in said
    given = ("--tip", "flange", "--max-causes", 1)
    status, said = run("diagnose", path, *logs, *given, "--payload", 0.8, "--json", verdict)
    assert status == 0, said
    assert json.loads(verdict.read_text())["verdict"] == "none"
    # Without the load it is missing; the file that gets it is read with the tip too.
    status, said = run("diagnose", path, *logs, *given, "--write-model", new)
    assert status == 0, said
    assert f"model: {new}, with payload" in said
    loaded, q = import_robot(new, tip="flange"), np.array([0.4, -0.7])
    assert loaded.gravity(q) == pytest.approx(machine.gravity(q), rel=0.02)


def test_the_chain_may_begin_further_up(tmp_path: Path):
    path = written(tmp_path, URDF)
    machine = import_robot(path, base="upper")
    assert machine.n_axes == 1
    log = written_log(tmp_path, 0, machine, lambda q, _: 0 * q)
    status, said = run("check", log, "--robot", path, "--base", "upper")
    assert status == 0, said
    status, said = run("check", log, "--robot", path)
    assert status == 1 and "refused" in said


def test_a_check_takes_tip_and_payload(tmp_path: Path):
    path = branched(tmp_path)
    log = written_log(tmp_path, 0, with_load(path, 20.0), lambda q, _: 0 * q)
    assert run("check", log, "--robot", path)[0] == 2
    given = ("--robot", path, "--tip", "flange")
    status, said = run("check", log, *given)
    # A load that the model lacks is for the diagnosis; one that no arm carries is a wrong scale.
    assert status == 0, said
    status, said = run("check", log, *given, "--payload", "20,0,0,0")
    assert status == 0, said
    status, said = run("check", log, *given, "--payload", "2000,0,0,0")
    assert status == 1 and "refused: torque_scaled" in said


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--tip", "flange"], "--tip: expected --robot MODEL beside it"),
        (["--robot", "two_mass_axis", "--payload", "3"], "--payload: expected a model file (URDF"),
        (["--robot", "ARM", "--tip", "hand"], "--tip: expected a link"),
        (["--robot", "ARM", "--payload", "1,2"], "--payload: expected KG or KG,X,Y,Z"),
    ],
)
def test_options_of_a_model_are_named(tmp_path: Path, arguments: list[str], message: str):
    path = written(tmp_path, URDF)
    log = written_log(tmp_path, 0, import_robot(path), lambda q, _: 0 * q)
    status, said = run("check", log, *(str(path) if a == "ARM" else a for a in arguments))
    assert status == 2, said
    assert message in said
