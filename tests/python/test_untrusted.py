"""Cases of somebody else: nothing outside their folder is opened."""

from __future__ import annotations

import os
from pathlib import Path

import h5py
import numpy as np
import pytest
from typer.testing import CliRunner

from axisight.cli import app
from axisight.errors import CaseError, InputError, LogError
from axisight.logs import read_case
from logs_data import native_columns, write

CASE = """
schema = "axisight.case/1"
name = "theirs"
robot = "{robot}"

[[log]]
file = "{log}"
role = "estimation"

[[log]]
file = "logs/b.parquet"
role = "validation"
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A case, and a log and a robot beside it that are not of it."""
    case = tmp_path / "theirs"
    for place in (tmp_path, case / "logs"):
        place.mkdir(exist_ok=True, parents=True)
        write(place / "a.parquet", native_columns())
        write(place / "b.parquet", native_columns(n=1500))
    (tmp_path / "robot.toml").touch()
    (case / "robot.toml").touch()
    return named(case)


def named(case: Path, robot: str = "robot.toml", log: str = "logs/a.parquet") -> Path:
    (case / "case.toml").write_text(CASE.format(robot=robot, log=log))
    return case


def refused(case: Path, error: type[InputError] = CaseError) -> str:
    """Return why a case is refused, by the command too."""
    with pytest.raises(error) as caught:
        read_case(case, untrusted=True)
    done = CliRunner().invoke(app, ["diagnose", str(case), "--untrusted"])
    assert done.exit_code == 2
    assert " ".join(str(caught.value).split()) in " ".join(done.output.split())
    return str(caught.value)


def test_a_case_in_its_folder_is_read(folder):
    (folder / "logs" / "again.parquet").symlink_to("a.parquet")
    (folder / "logs" / "to_nothing").symlink_to("nothing")
    named(folder, log="logs/again.parquet")
    assert len(read_case(folder, untrusted=True).logs) == 2


@pytest.mark.parametrize("name", ["../{}", "{top}/{}", "logs/../../{}"])
def test_names_that_lead_out(folder, name):
    for part, file in (("log", "a.parquet"), ("robot", "robot.toml")):
        named(folder, **{part: name.format(file, top=folder.parent)})
        # One's own may.
        assert len(read_case(folder).logs) == 2
        assert "inside the case folder" in refused(folder)


@pytest.mark.parametrize("name", ["C:/a.parquet", r"..\\\\a.parquet", r"\\\\\\\\host\\\\a.parquet"])
def test_names_that_lead_out_elsewhere(folder, name):
    assert "inside the case folder" in refused(named(folder, log=name))


@pytest.mark.parametrize("name", ["logs/a.parquet", "robot.toml", "case.toml", "notes"])
def test_links_that_lead_out(folder, name):
    path, outside = folder / name, folder.parent / Path(name).name
    if path.exists():
        path.replace(outside)
    else:
        outside.touch()
    path.symlink_to(outside)
    assert len(read_case(folder).logs) == 2
    assert "got a link to" in refused(folder)


def test_folders_that_lead_out(folder):
    (folder / "logs").rename(folder.parent / "logs")
    (folder / "logs").symlink_to(folder.parent / "logs")
    assert len(read_case(folder).logs) == 2
    assert "got a link to" in refused(folder)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes of POSIX")
def test_pipes(folder):
    os.mkfifo(folder / "logs" / "c.parquet")
    assert "device or a pipe" in refused(folder)


def external_link(path: Path, other: Path) -> None:
    with h5py.File(path, "w") as file:
        file.create_group("inner")["link"] = h5py.ExternalLink(str(other), "/x")


def external_storage(path: Path, other: Path) -> None:
    with h5py.File(path, "w") as file:
        file.create_dataset("inner/x", (8,), "u1", external=[(str(other), 0, 8)])


def virtual(path: Path, other: Path) -> None:
    layout = h5py.VirtualLayout((8,), "f8")
    layout[:] = h5py.VirtualSource(str(other), "x", (8,))
    with h5py.File(path, "w") as file:
        file.create_virtual_dataset("inner/x", layout)


@pytest.mark.parametrize("make", [external_link, external_storage, virtual])
@pytest.mark.parametrize("kind", [".h5", ".mat"])
def test_hdf5_files_that_read_others(folder, make, kind):
    other = folder.parent / "other.h5"
    with h5py.File(other, "w") as file:
        file["x"] = np.arange(8.0)
    log = folder / "logs" / f"a{kind}"
    make(log, other)
    assert "expected data in this file" in refused(named(folder, log=f"logs/a{kind}"), LogError)
    done = CliRunner().invoke(app, ["check", str(log), "--untrusted"])
    assert done.exit_code == 2
    assert "expected data in this file" in " ".join(done.output.split())


def test_hdf5_files_of_their_own_pass(folder):
    log = folder / "logs" / "a.h5"
    with h5py.File(log, "w") as file:
        for name, values in native_columns().items():
            file[name] = values
        file["soft"] = h5py.SoftLink("/time_s")
    named(folder, log="logs/a.h5")
    assert len(read_case(folder, untrusted=True).logs) == 2


def test_a_recording_with_a_link_out_of_it(folder):
    recording = folder / "episodes"
    (recording / "meta").mkdir(parents=True)
    (recording / "data").mkdir()
    (recording / "meta" / "info.json").write_text('{"total_episodes": 1}')
    (recording / "data" / "episode_000000.parquet").symlink_to(folder.parent / "a.parquet")
    done = CliRunner().invoke(app, ["check", str(recording), "--untrusted"])
    assert (done.exit_code, "got a link to" in done.output) == (2, True)
