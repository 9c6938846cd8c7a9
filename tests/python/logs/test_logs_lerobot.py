"""Folders of LeRobot, versions 2 and 3: one episode is one log."""

import shutil

import numpy as np
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from axisight.cli import app
from axisight.errors import LogError
from axisight.logs import check_log, parse_column_map, read_case, read_log
from axisight.logs.sources import files_of, load_arrays
from columns_data import GEAR, motion, robot, robot_toml, write_lerobot


@pytest.mark.parametrize("n_axes", [6, 7])
@pytest.mark.parametrize("version", [2, 3])
def test_an_episode_is_chosen_after_the_folder(tmp_path, version, n_axes):
    folder = write_lerobot(tmp_path / "pick.v1", 3, n_axes, version=version)
    for episode in range(3):
        path = folder.with_name(f"pick.v1#{episode}")
        log = read_log(path, robot=robot(n_axes))
        expected = (motion(n_axes, 600)["position"] + episode) / GEAR
        np.testing.assert_allclose(log.position_rad, expected, atol=1e-4)
        assert log.sample_rate_hz == pytest.approx(250)
        assert log.name == f"pick.v1#{episode}"
        assert any(note.startswith("positions: observation.state") for note in log.notes)
        assert all(file.is_file() for file in files_of(path))
    assert len(files_of(folder.with_name("pick.v1#1"))) == (2 if version == 2 else 3)


@pytest.mark.parametrize("version", [2, 3])
def test_a_single_episode_needs_no_choice(tmp_path, version):
    folder = write_lerobot(tmp_path / "one", version=version)
    assert read_log(folder, "lerobot", robot=robot(6)).n_samples == 600
    assert "action[5]" in load_arrays(folder)


def test_several_episodes_without_a_choice(tmp_path):
    folder = write_lerobot(tmp_path / "many", 4)
    with pytest.raises(LogError, match="many: expected the choice of an episode, many#0 to many#3"):
        read_log(folder, robot=robot(6))
    with pytest.raises(LogError, match="expected an episode from 0 to 3 after #, got 4"):
        read_log(tmp_path / "many#4", robot=robot(6))
    assert not check_log(folder).ok


def test_actions_are_targets_of_positions_and_stand_in_for_efforts(tmp_path):
    folder = write_lerobot(tmp_path / "a", effort=False)
    log = read_log(folder, robot=robot(6))
    assert not log.has_torque
    action = load_arrays(folder)["action[5]"]
    assert np.allclose(log.position_ref_rad[:, 5] * robot(6).gear_ratio[5], action)
    report = check_log(folder)
    assert report.sample_rate_hz == pytest.approx(250)
    assert report.n_axes == 6
    assert report.ok


def test_a_gripper_is_one_axis_too_many_until_the_map_says_so(tmp_path):
    folder = write_lerobot(tmp_path / "a", n_axes=7)
    with pytest.raises(LogError, match="expected 6 axes, got columns for 7"):
        read_log(folder, robot=robot(6))
    own = parse_column_map(
        'side = "joint"\naxes = 6\ntime = { name = "timestamp" }\n[every_axis]\n'
        'position = { name = "observation.state[{0}]", unit = "rad" }\n'
        'torque = { name = "observation.effort[{0}]", unit = "Nm" }\n'
    )
    assert read_log(folder, own, robot=robot(6)).n_axes == 6


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda f: (f / "meta/info.json").write_text("{"), "info.json"),
        (
            lambda f: (f / "meta/info.json").write_text("{}"),
            "total_episodes: expected this key, got none",
        ),
        (lambda f: (f / "meta/info.json").write_text('{"total_episodes": 0}'), "at least one"),
        (lambda f: shutil.rmtree(f / "data"), "expected rows with episode_index 0"),
        (lambda f: _cut(next(f.rglob("*.parquet"))), "truncated"),
        (lambda f: _ragged(next(f.rglob("*.parquet"))), "observation.state"),
    ],
)
def test_broken_folders(tmp_path, spoil, words):
    folder = write_lerobot(tmp_path / "a")
    spoil(folder)
    with pytest.raises(LogError, match=words):
        read_log(folder, robot=robot(6))


def _cut(path):
    path.write_bytes(path.read_bytes()[:-100])


def _ragged(path):
    frame = pq.read_table(path).to_pandas()
    frame.at[3, "observation.state"] = frame["observation.state"][3][:4]
    frame.to_parquet(path)


def test_a_hash_in_a_name_is_only_that(tmp_path):
    folder = write_lerobot(tmp_path / "a#2")
    assert read_log(folder, robot=robot(6)).name == "a#2"


def test_episodes_in_a_case_and_on_the_command_line(tmp_path):
    write_lerobot(tmp_path / "set", 2)
    (tmp_path / "robot.toml").write_text(robot_toml(6))
    logs = [
        f'[[log]]\nfile = "set#{k}"\nrole = "{role}"\n'
        for k, role in enumerate(("estimation", "validation"))
    ]
    head = 'schema = "axisight.case/1"\nname = "c"\nrobot = "robot.toml"\n'
    (tmp_path / "case.toml").write_text(head + "".join(logs))
    case = read_case(tmp_path)
    assert [log.name for log in case.logs] == ["set#0", "set#1"]
    shown = CliRunner().invoke(app, ["check", str(tmp_path / "set#1")])
    assert "uniform at 250 Hz" in " ".join(shown.output.split())
    unused = [f.column for f in check_log(tmp_path / "set#1").findings if "not used" in f.message]
    assert unused == ["episode_index", "frame_index"]
