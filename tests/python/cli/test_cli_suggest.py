"""Errors end with one suggestion where a name is nearly one that is there."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest
import typer
from typer.testing import CliRunner

from axisight.cli import app
from axisight.cli.identify_common import option_names, option_words
from axisight.cli.robot import axis_of
from axisight.cli.suggest import suggestion
from axisight.errors import InputError, LogError
from axisight.fitting import robot_parameter
from axisight.logs.map_files import parse_column_map
from axisight.robot import load_robot
from axisight.robot.axis_names import axis_number

MAP = """
[time]
name = "time_s"
unit = "s"
[[axis]]
position = { name = "positon_1", unit = "rad" }
torque = { name = "torque_cmd_1", unit = "Nm" }
"""


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    rows = "".join(f"{0.01 * i:.2f},{i % 7},0\n" for i in range(200))
    Path("run1.csv").write_text(f"time_s,position_1,torque_cmd_1\n{rows}")
    Path("map.toml").write_text(MAP)
    Path("robot.toml").write_text("")
    Path("arm.urdf").write_text("")
    Path("study.toml").write_text("")
    Path("mycase").mkdir()
    return tmp_path


WRONG = {
    "diagnos": "Did you mean 'diagnose'?",
    "identify rigid": "Did you mean 'rigid-body'?",
    "diagnose --repor x": "--report)",
    "--versio": "--version)",
    "diagnose mycas": "Did you mean mycase?",
    "diagnose run1.csv --model irb6600_lik": "Did you mean 'irb6600_like'?",
    "diagnose run1.csv --model robt.toml": "Did you mean robot.toml?",
    "diagnose run1.csv --effect backlas@1": "Did you mean 'backlash'?",
    "columns show ur-rtd": "Did you mean 'ur-rtde'?",
    "check run2.csv": "Did you mean run1.csv?",
    # The table of findings may break the line before the name.
    "check run1.csv --columns map.toml": "'position_1'?",
    "check run1.csv --columns ur-rted": "Did you mean 'ur-rtde'?",
    "check run1.csv --columns mop.toml": "Did you mean map.toml?",
    "excite --robot irb6600_like --kind multisin": "Did you mean multisine?",
    "robot import arn.urdf": "Did you mean arm.urdf?",
    "montecarlo studdy.toml --out x": "Did you mean study.toml?",
}


@pytest.mark.parametrize("typed", WRONG)
def test_what_was_meant_is_said_once(folder, typed):
    done = CliRunner().invoke(app, typed.split())
    assert done.exit_code in (1, 2)
    said = " ".join(done.output.split())
    assert WRONG[typed] in said, said
    assert said.lower().count("did you mean") <= 1


def test_of_several_commands_or_options_the_nearest_is_said(folder):
    said = CliRunner().invoke(app, ["diagnose", "--fleets"]).output
    assert "--fleet)" in said
    for word in ("schem", "colum", "exite"):
        said = CliRunner().invoke(app, [word]).output
        assert said.split("Did you mean")[1].split("?")[0].count("'") == 2


def test_nothing_is_said_where_nothing_is_near(folder):
    for typed in ("columns show zzz", "check zzz.csv", "diagnose zzz"):
        assert "did you mean" not in CliRunner().invoke(app, typed.split()).output.lower()


@pytest.mark.parametrize(
    ("message", "near"),
    [
        (
            "--tolerance: expected one of mass, damping, or one of a joint (a.mass), got 'mas'",
            "mass",
        ),
        ("line 3: unknown key `frictoin`; expected one of friction, mass", "friction"),
        ("directions: expected one of t1, hadamard or a matrix, got 'hadamart'", "hadamard"),
        (
            "parameter `axis1.stifness`: expected one of axis1.stiffness, axis1.mass",
            "axis1.stiffness",
        ),
        ("kp: expected a positive number, got -1", None),
        ("x: expected one of a, b, got 3", None),
        ("expected one of \x1b[2Jname, b, got '\x1b[2Jnam'", None),
    ],
)
def test_names_are_taken_from_what_errors_list(message, near):
    assert suggestion(message) == near


@pytest.mark.parametrize(
    ("given", "number"), [("2", 2), (3, 3), ("elbow", 3), ("1", 2), ("base", 1)]
)
def test_axes_are_numbers_or_joints(given, number):
    joints = ["base", "1", "elbow"] if given == "1" else ["base", "shoulder_lift_joint", "elbow"]
    robot = SimpleNamespace(axis_names=joints)
    assert axis_of(str(given), robot) == number  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ("axis2", ". Did you mean 2?"),
        ("shoulder_lift", ". Did you mean 'shoulder_lift_joint'?"),
        ("Elbow", ". Did you mean 'elbow'?"),
        ("0", ""),
        (4, ""),
        (1.5, ""),
        (None, ""),
    ],
)
def test_what_is_no_axis_is_refused(given, meant):
    with pytest.raises(InputError) as refused:
        axis_number(given, ["base", "shoulder_lift_joint", "elbow"], "--axis")
    expected = "--axis: expected 1 to 3 or a joint name (base, shoulder_lift_joint, elbow), got "
    assert str(refused.value) == f"{expected}{given!r}{meant}"


def test_errors_of_identification_name_options():
    text = (
        'cutoff_hz: expected 1; or fix some with `known`, or use deficient="group" or method="wls"'
    )
    words = option_words(text, ["cutoff_hz", "method", "known"])
    assert (
        words == "--cutoff-hz: expected 1; or fix some with --known, or use --group or --method wls"
    )
    assert option_words('x: use method="wls"', []) == 'x: use method="wls"'


def test_arguments_of_a_command_have_no_dashes():
    def identify(logs: list[Path], gear_ratio: float = 1.0) -> None: ...

    one = typer.Typer()
    one.command()(identify)
    names = option_names(typer.Context(typer.main.get_command(one)))
    assert "gear_ratio" in names
    assert "logs" not in names
    assert option_words("logs: expected two", names) == "logs: expected two"


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (
            "kNm",
            "expected one of Nm, N, A, V, got 'kNm'. Did you mean unit = 'Nm' and scale = 1000?",
        ),
        ("degrees", "expected one of Nm, N, A, V, got 'degrees'. Did you mean unit = 'deg'?"),
        ("Nmm", "expected one of Nm, N, A, V, got 'Nmm'"),
    ],
)
def test_units_that_people_write_are_understood(given, said):
    with pytest.raises(LogError) as refused:
        parse_column_map(MAP.replace('"Nm"', f'"{given}"'), "map.toml")
    assert str(refused.value) == f"map.toml: axis 1: torque.unit: {said}"


def test_errors_of_parameters_make_the_suggestion_themselves():
    with pytest.raises(InputError) as refused:
        load_robot("irb6600_like").with_parameters({"axis1.stifness": 1.0})
    assert str(refused.value).endswith("Did you mean 'axis1.stiffness'?")
    assert suggestion(str(refused.value)) is None
    with pytest.raises(InputError) as refused:
        robot_parameter(load_robot("irb6600_like"), "axis2.stifness")
    assert str(refused.value).endswith("Did you mean 'axis2.stiffness'?")


def test_names_of_files_that_would_not_show_are_not_said(folder):
    (folder / "run\x1b[2J.csv").write_text("")
    assert suggestion("[Errno 2] No such file or directory: 'run\x1b[2K.csv'") != "run\x1b[2J.csv"
