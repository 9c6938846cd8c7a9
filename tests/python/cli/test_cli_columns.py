"""The commands ``axisight columns``, and names of maps wherever a command takes a map."""

import re
import shlex
from pathlib import Path

import pandas as pd
import pytest
from typer.testing import CliRunner

from axisight.cli import app
from axisight.cli.identify_common import provenance
from axisight.logs import MAPS, load_column_map, named_map_text
from axisight.logs.sources import files_of
from columns_data import maker_columns, robot_toml, write_csv, write_lerobot
from model_logs import branched, with_load, written_log


def run(*arguments: object, code: int = 0) -> str:
    result = CliRunner().invoke(app, [*map(str, arguments)])
    assert result.exit_code == code, result.output
    return " ".join(result.output.split())


@pytest.fixture
def log(tmp_path: Path) -> Path:
    columns = maker_columns("abb", 6)
    renamed = {k.replace("_J", "_of_joint_"): v for k, v in columns.items()}
    return write_csv(tmp_path / "run.csv", renamed)


def test_list_and_show():
    listed = run("columns", "list")
    for name in MAPS:
        assert f"{name}: " in listed
        assert re.search(rf"{name}: [^:]+(: [^:]+)?\. ?", listed + " "), "a whole sentence"
        shown = CliRunner().invoke(app, ["columns", "show", name])
        assert shown.output == named_map_text(name)
    text = run("columns", "show", "fanuc", code=2)
    assert f"expected one of {', '.join(MAPS)}, got 'fanuc'" in text


def test_guess_writes_a_map_that_check_takes(log, tmp_path):
    out = tmp_path / "columns.toml"
    text = run("columns", "guess", log, "-o", out)
    assert "doubtful: torque: no name says the unit" in text
    assert "not used: some_flag: no word of its name is known" in text
    assert load_column_map(out).axis[5].position.name == "position_of_joint_6"
    assert "uniform at 250 Hz" in run("check", log, "--columns", out)


def test_what_to_do_then_can_be_pasted(log, tmp_path):
    spaced, arm = log.rename(tmp_path / "run 1.csv"), tmp_path / "my robot.toml"
    arm.write_text(robot_toml(6))
    text = run("columns", "guess", spaced, "--robot", arm, "-o", tmp_path / "c.toml")
    command = re.search("then: (axisight .*)", text)
    assert command is not None
    said = shlex.split(command[1])
    assert said[1:3] == ["check", str(spaced)]
    assert "uniform at 250 Hz" in run(*said[1:])


def test_guess_never_overwrites_unasked(log, tmp_path):
    out = tmp_path / "columns.toml"
    out.write_text("mine")
    text = run("columns", "guess", log, "-o", out, code=2)
    assert "exists: choose another name, or --force replaces it" in text
    assert out.read_text() == "mine"
    run("columns", "guess", log, "-o", out, "--force")
    assert out.read_text() != "mine"


def test_guess_on_the_screen_by_a_robot(log, tmp_path):
    (tmp_path / "robot.toml").write_text(robot_toml(5))
    shown = CliRunner().invoke(
        app, ["columns", "guess", str(log), "--robot", str(tmp_path / "robot.toml")]
    )
    assert shown.output.count("[[axis]]") == 5
    text = run("columns", "guess", tmp_path / "none.csv", code=2)
    assert "expected a file, got nothing" in text


def test_a_maker_is_recognized(tmp_path):
    path = write_csv(tmp_path / "a.csv", maker_columns("kuka-rsi", 6))
    out = tmp_path / "columns.toml"
    text = run("columns", "guess", path, "-o", out)
    assert "the names are those of kuka-rsi; --columns kuka-rsi does the same" in text
    assert "uniform at 250 Hz" in run("check", path, "--columns", "kuka-rsi")
    (tmp_path / "robot.toml").write_text(robot_toml(6))
    given = (tmp_path / "robot.toml", path, "--out", tmp_path / "x.parquet", "--columns", "kuka")
    text = run("simulate", *given, code=2)
    assert "expected a file or one of abb, franka" in text


def test_names_of_maps_and_episodes_have_hashes_where_values_come_from(tmp_path):
    path = write_csv(tmp_path / "a.csv", maker_columns("abb", 6))
    found = provenance("axis", [path], {}, Path("abb"))
    assert set(found.data) == {"a.csv", "abb.toml"}
    folder = write_lerobot(tmp_path / "set", 2)
    episode = folder.with_name("set#1")
    found = provenance("axis", [episode], {}, Path("lerobot"))
    assert set(found.data) == {"info.json", "episode_000001.parquet", "lerobot.toml"}
    assert files_of(path) == [path]


def test_a_guess_takes_the_tip_of_a_model(tmp_path: Path):
    model = branched(tmp_path)
    robot = with_load(model, 0.5)
    frame = pd.read_parquet(written_log(tmp_path, 0, robot, lambda q, _: 0 * q))
    names = {c: c.replace("position", "q").replace("torque_cmd", "tau") for c in frame.columns}
    path = tmp_path / "run.csv"
    frame.rename(columns={**names, "time_s": "t"}).to_csv(path, index=False)
    said = run("columns", "guess", path, "--robot", model, code=2)
    assert "2 moving branches" in said
    said = run(
        "columns", "guess", path, "--robot", model, "--tip", "flange", "-o", tmp_path / "map.toml"
    )
    assert said.endswith(f"--robot {model} --tip flange")
    said = run("columns", "guess", path, "--tip", "flange", code=2)
    assert "--tip: expected --robot MODEL beside it" in said
