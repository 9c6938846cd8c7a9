"""Every way to hand a robot and its logs to `diagnose`."""

import shutil
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from axisight import Effect, Log, Settings, diagnose, read_case
from axisight.errors import CaseError, InputError, LogError
from axisight.gap.intake.given import Given, given_inputs
from axisight.logs import parse_column_map
from gap_data import bare_axis, bare_case, logs_of, scattered

ROBOT = bare_axis()
FRICTION = Effect("coulomb_friction", "axis1", {"coulomb_nm": 0.5, "smoothing_rad_s": 0.05})
FIRST, MOVES, LAST = (f"logs/{name}.parquet" for name in ("first", "moves", "last"))
QUICK = Settings(bootstrap=50, max_causes=1)


@cache
def logs() -> tuple[Log, ...]:
    plan = {"first": ("multisine", 1), "moves": ("moves", 0), "last": ("multisine", 9)}
    return tuple(logs_of(scattered(ROBOT, 4), [FRICTION], plan, seconds=3.0))


def frame(log: Log) -> pd.DataFrame:
    return pd.DataFrame(
        {
            "time_s": log.time_s,
            "position_deg_1": np.degrees(log.position_rad[:, 0]),
            "torque_nm_axis1": log.torque_nm[:, 0],
            "velocity_ref_1": log.velocity_ref_rad_s[:, 0],
        }
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return bare_case(tmp_path_factory.mktemp("case"), logs())


def given(case=None, logs=None, *, robot=None, estimation=(), validation=(), simulated=()) -> Given:
    return given_inputs(case, logs, robot, estimation, validation, simulated, None)


def test_a_robot_and_tables_are_diagnosed_and_what_is_held_out_is_said():
    found = diagnose(ROBOT, [frame(log) for log in logs()], settings=QUICK)
    assert found.verdict == "explained", found.headline
    assert [c.label for c in found.causes] == ["coulomb_friction@1"]
    assert found.causes[0].parameters["coulomb_nm"].value == pytest.approx(0.5, rel=0.1)
    assert found.checks[0] == "No validation logs were given: the last log, 'log3', is held out."
    assert found.provenance["validation_logs"] == ["log3"]
    assert found.axis("axis1").verdict == "explained"


WAYS = {
    "logs": lambda _: given(ROBOT, list(logs())),
    "validation": lambda _: given(ROBOT, logs()[:2], validation=logs()[2]),
    "robot by name": lambda _: given(robot=ROBOT, logs=logs()),
    "logs first": lambda _: given(list(logs()), robot=ROBOT),
    "roles": lambda _: given(robot=ROBOT, estimation=logs()[:2], validation=logs()[2:]),
    "datasets": lambda _: given(ROBOT, [log.to_xarray() for log in logs()]),
    "frames": lambda _: given(ROBOT, map(frame, logs()[:2]), validation=[frame(logs()[2])]),
    "mixed": lambda at: given(ROBOT, [logs()[0], at / MOVES], validation=frame(logs()[2])),
    "paths": lambda at: given(at / "robot.toml", [str(at / FIRST), at / MOVES, at / LAST]),
    "path and preset": lambda at: given("two_mass_axis", at / FIRST, validation=at / LAST),
    "case": given,
    "case by text": lambda at: given(str(at)),
    "case as read": lambda at: given(read_case(at)),
}


@pytest.mark.parametrize("way", WAYS)
def test_every_way_gives_the_same_logs(folder, way):
    found = WAYS[way](folder)
    wanted = [logs()[0]] if way == "path and preset" else logs()[:2]
    assert len(found.estimation) == len(wanted)
    pairs = [*zip(found.estimation, wanted, strict=True), (found.validation[0], logs()[2])]
    assert len(found.validation) == 1
    for own, log in pairs:
        for field in ("position_rad", "torque_nm", "velocity_ref_rad_s"):
            np.testing.assert_allclose(getattr(own, field), getattr(log, field), atol=1e-9)
    held_unasked = {"logs", "robot by name", "logs first", "datasets", "paths"}
    assert bool(found.says) == (way in held_unasked)


def test_validation_logs_are_added_to_those_of_a_case(folder):
    found = given(folder, validation=folder / MOVES, simulated=[frame(logs()[0])])
    assert [log.name for log in found.validation] == ["last", "moves"]
    assert len(found.simulated) == 1


WRONG = {
    "logs alone": (lambda: given(list(logs())), "robot: expected the robot first, diagnose"),
    "swapped": (lambda: given(list(logs()), ROBOT), "robot: expected the robot first"),
    "robot alone": (lambda: given(ROBOT), "logs: expected logs beside the robot"),
    "preset alone": (lambda: given("two_mass_axis"), "logs: expected logs beside the robot 'two_mass"),
    "nothing": (given, "diagnose: expected a case, or a robot with"),
    "a number": (lambda: given(5), "case: expected a case folder, or a robot with logs .* got 5"),
    "number as logs": (lambda: given(ROBOT, 5), "logs: expected logs .a path.* got 5"),
    "number among logs": (lambda: given(ROBOT, [logs()[0], 5]), r"logs\[1\]: expected a log .* got 5"),
    "number to hold out": (lambda: given(ROBOT, logs(), validation=5), "validation: expected logs"),
    "robot of another type": (lambda: given(robot=5, logs=logs()), "robot: expected a Robot, a preset"),
    "two robots": (lambda: given(ROBOT, logs(), robot=ROBOT), "robot: expected one robot"),
    "logs twice": (
        lambda: given(ROBOT, logs(), estimation=logs()), "estimation: expected logs, or estimation"
    ),
    "one log": (lambda: given(ROBOT, logs()[0]), r"validation: .* got one log; log\.part\(0, 20\)"),
    "settings of another type": (lambda: diagnose(ROBOT, logs(), settings={"seed": 1}), "settings: expected Settings"),
    "effect of no joint": (
        lambda: diagnose(ROBOT, logs(), to_show=Effect("backlash", "axsi1")),
        "effect 'backlash': axis: .*Did you mean 'axis1'",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_another_way_is_refused_by_name(case):
    call, message = WRONG[case]
    with pytest.raises(InputError, match=message):
        call()


def test_files_that_are_not_there_and_logs_beside_a_case(folder):
    with pytest.raises(LogError, match=r"nothing\.parquet: expected a file, got nothing"):
        given(ROBOT, "nothing.parquet")
    with pytest.raises(CaseError, match="nowhere"):
        given("nowhere")
    with pytest.raises(
        CaseError, match="at least one estimation and one validation log, got 3 and 0"
    ):
        given(robot=ROBOT, estimation=logs())
    with pytest.raises(InputError, match="logs: expected none beside a case"):
        given(read_case(folder), logs())
    with pytest.raises(InputError, match="robot: expected a robot beside the log"):
        given(folder / FIRST)


def test_a_case_stands_for_its_folder_and_only_a_suffix_makes_a_log(folder):
    for path in (folder / "case.toml", str(folder / "case.toml")):
        assert [log.name for log in given(path).validation] == ["last"]
        assert given(path, robot=ROBOT).source is ROBOT
    for robot in (None, ROBOT):
        for path in ("nope", folder / "nope" / "case.toml", folder / "notes.txt"):
            with pytest.raises(CaseError, match=r"case\.toml"):
                given(path, robot=robot)
        with pytest.raises(CaseError, match="shorter path"):
            given("a" * 300, robot=robot)
    with pytest.raises(InputError, match=r"robot: expected a robot beside the log nothing\.csv"):
        given("nothing.csv")
    with pytest.raises(LogError, match=r"nothing\.parquet: expected a file, got nothing"):
        given("nothing.parquet", robot=ROBOT)


def test_a_column_map_holds_for_the_logs_of_a_case(tmp_path, folder):
    shutil.copytree(folder, tmp_path / "case")
    names = {"position_1": "q", "torque_cmd_1": "u"}
    for path in (FIRST, MOVES, LAST):
        table = pd.read_parquet(tmp_path / "case" / path)
        table.rename(columns=names).to_parquet(tmp_path / "case" / path)
    columns = parse_column_map(
        "[time]\nname = 'time_s'\n[[axis]]\nposition = { name = 'q', unit = 'rad' }\n"
        "torque = { name = 'u', unit = 'Nm' }\n"
    )
    found = given_inputs(tmp_path / "case", None, None, (), (), (), columns)
    np.testing.assert_allclose(found.validation[0].torque_nm, logs()[2].torque_nm)
    case = read_case(tmp_path / "case", columns)
    with pytest.raises(InputError, match="columns: expected none beside a Case"):
        given_inputs(case, None, None, (), (), (), columns)
    more = given_inputs(case, None, None, (), tmp_path / "case" / MOVES, (), columns)
    assert [log.name for log in more.validation] == ["last", "moves"]
