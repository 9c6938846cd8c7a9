"""Outputs of commands: tried before the work, none at the cost of another, named as they are."""

from __future__ import annotations

import os
import shutil
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from axisight import Diagnosis
from axisight.cli import app
from axisight.cli import diagnose as command
from axisight.cli.demo import write_demo_case
from diagnosis_data import explained
from import_data import URDF, written


@pytest.fixture(scope="module")
def demo_case(tmp_path_factory) -> Path:
    return write_demo_case(tmp_path_factory.mktemp("made") / "case")


@pytest.fixture
def case(demo_case, tmp_path) -> Path:
    return Path(shutil.copytree(demo_case, tmp_path / "case"))


@pytest.fixture
def no_work(monkeypatch) -> None:
    def work(**_more: object) -> None:
        pytest.fail("the work began")

    monkeypatch.setattr(command, "diagnose", work)


@pytest.fixture
def quick(monkeypatch) -> None:
    monkeypatch.setattr(command, "diagnose", lambda **_more: explained())


def run(*arguments: str | Path, status: int = 0) -> str:
    done = CliRunner().invoke(app, [str(a) for a in arguments])
    assert done.exit_code == status, (done.output, done.exception)
    assert done.exception is None or isinstance(done.exception, SystemExit)
    return done.output


def test_simulate_keeps_its_input(case):
    log = case / "logs" / "moves.parquet"
    before = log.read_bytes()
    link = case / "link.parquet"
    link.symlink_to(log)
    for out in (log, case / "logs" / ".." / "logs" / "moves.parquet", link):
        said = run("simulate", "irb6600_like", log, "--out", out, status=2)
        assert "--out" in said
        assert "got an input" in said
    assert log.read_bytes() == before
    assert link.is_symlink()


@pytest.mark.parametrize(
    "option", ["--json", "--report", "--write-model", "--signals", "--next-experiment"]
)
def test_diagnose_tries_its_outputs_before_the_work(case, no_work, option):
    (case / "file").write_text("")
    name = {"--write-model": "m.toml", "--signals": "s.parquet"}.get(option, "x")
    said = run("diagnose", case, option, case / "file" / name, status=2)
    assert option in said
    assert "expected a folder" in said


def test_diagnose_replaces_neither_log_nor_robot_nor_case(case, no_work):
    for name in ("logs/moves.parquet", "robot.toml", "case.toml"):
        assert "got an input" in run("diagnose", case, "--json", case / name, status=2)


def test_two_outputs_are_two_files(case, no_work):
    both = case / "both"
    assert "--report" in run("diagnose", case, "--json", both, "--report", both, status=2)


def test_a_failed_output_costs_no_other(case, quick, monkeypatch, tmp_path):
    def full(*_args: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(command.pages, "save_report", full)
    verdict, signals = tmp_path / "v.json", tmp_path / "r.html"
    said = run("diagnose", case, "--json", verdict, "--report", signals, status=2)
    assert verdict.exists()
    assert "explained" in said
    assert f"verdict: {verdict}" in said
    assert "No space left" in said


@pytest.mark.parametrize("name", ["[/]x", "[bold]y", "[red]", "[link=a]"])
def test_names_of_files_are_no_markup(case, quick, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    log = case / "logs" / "moves.parquet"
    name = name.replace("/", os.sep)
    out = Path(f"{name}.parquet")
    assert f": {out}" in run("simulate", "irb6600_like", log, "--out", out, "--to", "1.5")
    assert out.exists()
    said = run("diagnose", case, "--json", f"{name}.json", "--report", f"{name}.html")
    assert f"verdict: {name}.json" in said
    assert f"report: {name}.html" in said
    assert out.name in run("check", out)
    assert f"{name}.toml: " in run("robot", "import", written(case, URDF), "-o", f"{name}.toml")
    assert f"{name}.absent" in run("simulate", f"{name}.absent", log, "--out", out, status=2)


@pytest.mark.parametrize(
    "arguments",
    [
        ("excite", "--robot", "irb6600_like", "--out", "FILE/a.csv"),
        ("columns", "guess", "LOG", "-o", "FILE/a.toml"),
        ("columns", "guess", "LOG", "--overwrite", "-o", "LOG"),
        ("robot", "import", "LOG", "-o", "FILE/a.toml"),
        ("robot", "import", "LOG", "--overwrite", "-o", "LOG"),
        ("identify", "rigid-body", "irb6600_like", "LOG", "--out", "FILE/a.toml"),
        ("identify", "rigid-body", "irb6600_like", "LOG", "--force", "--out", "LOG"),
        ("identify", "axis", "LOG", "LOG", "--force", "--out", "LOG"),
        ("identify", "elastic", "irb6600_like", "LOG", "--force", "--out", "LOG"),
        ("montecarlo", "STUDY", "--out", "FILE"),
        ("diagnose", "--fleet", "FOLDER", "--out", "FILE"),
        ("blind", "run", "FOLDER", "--out", "FILE"),
        ("blind", "make", "FILE", "--truth", "FILE"),
        ("blind", "score", "FOLDER", "--truth", "T", "--verdicts", "V", "--html", "FILE/page.html"),
        ("demo", "--out", "FILE"),
    ],
)
def test_every_command_tries_its_outputs(case, arguments):
    (case / "file").write_text("file")
    study = (
        'robot = "irb6600_like"\n[excitation.multisine]\nperiod_s = 1.0\nband_hz = [1.0, 30.0]\n'
    )
    (case / "study.toml").write_text(study + "peak_rad_s = 5.0\n")
    log = case / "logs" / "moves.parquet"
    before = log.read_bytes()
    stand = {"LOG": log, "FILE": case / "file", "FOLDER": case, "STUDY": case / "study.toml"}
    names = [str(stand.get(a, a)).replace("FILE/", f"{case / 'file'}{os.sep}") for a in arguments]
    said = run(*names, status=2)
    assert any(s in said for s in ("expected a folder", "cannot be written", "got an input"))
    assert log.read_bytes() == before
    assert (case / "file").read_text() == "file"


def test_what_numpy_warns_of_is_not_shown(case, monkeypatch):
    def work(**_more: object) -> Diagnosis:
        with ThreadPoolExecutor() as pool:
            pool.submit(lambda: np.zeros(1) / np.zeros(1)).result()
        return explained()

    monkeypatch.setattr(command, "diagnose", work)
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        run("diagnose", case)
    assert seen == []
