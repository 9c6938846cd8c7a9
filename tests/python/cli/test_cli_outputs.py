"""Outputs of commands: tried before the work, none at the cost of another, named as they are."""

from __future__ import annotations

import os
import shutil
import warnings
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from axisight import Diagnosis
from axisight.cli import app, outcomes
from axisight.cli import diagnose as command
from axisight.cli.demo import write_demo_case
from axisight.gap import Interval
from columns_data import maker_columns, write_csv
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
    "option",
    ["--json", "--report", "--write-model", "--signals", "--next-experiment", "--posterior"],
)
def test_diagnose_tries_its_outputs_before_the_work(case, no_work, option):
    (case / "file").write_text("")
    name = {"--write-model": "m.toml", "--signals": "s.parquet", "--posterior": "v.nc"}.get(
        option, "x"
    )
    said = run("diagnose", case, option, case / "file" / name, status=2)
    assert option in said
    assert "expected a folder" in said


def test_play_joints_need_a_model_to_write(case, no_work):
    assert "expected --write-model beside it" in run("diagnose", case, "--play-joints", status=2)


def test_diagnose_replaces_neither_log_nor_robot_nor_case(case, no_work):
    for name in ("logs/moves.parquet", "robot.toml", "case.toml"):
        assert "got an input" in run("diagnose", case, "--json", case / name, status=2)


def test_two_outputs_are_two_files(case, no_work):
    both = case / "both"
    assert "--report" in run("diagnose", case, "--json", both, "--report", both, status=2)


def test_a_failed_output_costs_no_other(case, quick, monkeypatch, tmp_path):
    def full(*_args: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(outcomes.pages, "save_report", full)
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
        ("columns", "guess", "LOG", "--force", "-o", "LOG"),
        ("robot", "import", "LOG", "-o", "FILE/a.toml"),
        ("robot", "import", "LOG", "--force", "-o", "LOG"),
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


def test_results_are_replaced_and_what_people_work_on_is_not(case, quick):
    """What the command makes anew ends as it does; anything else, a model above all, only by force."""
    for option, name in (("--json", "v.json"), ("--report", "r.html")):
        (case / name).write_text("an earlier result")
        run("diagnose", case, option, case / name)
        assert (case / name).read_text() != "an earlier result"
    kept = ("new.toml", "arm.urdf", "arm.xml", "run.csv", "run.parquet", "notes.txt", "none")
    for name in kept:
        (case / name).write_text("mine")
        link = case / f"{name}.json"
        link.symlink_to(case / name)
        for target in (case / name, link):
            said = run("diagnose", case, "--json", target, status=2)
            assert "--json: " in said
            assert "exists and is no .json: choose another name, or --force replaces it" in said
        assert (case / name).read_text() == "mine"
    run("diagnose", case, "--json", case / "notes.txt", "--force")
    assert (case / "notes.txt").read_text() != "mine"
    assert "is no .html or .htm" in run("diagnose", case, "--report", case / "v.json", status=2)


def test_a_model_is_replaced_by_force_only_and_signals_are(case, monkeypatch):
    found = explained()
    size = {"coulomb_nm": Interval(0.4, 0.3, 0.5)}
    causes = [replace(found.causes[0], effect="coulomb_friction", axis=1, parameters=size)]
    monkeypatch.setattr(command, "diagnose", lambda **_more: replace(found, causes=causes))
    model = case / "new.toml"
    model.write_text("mine")
    said = run("diagnose", case, "--write-model", model, status=2)
    assert "--write-model: " in said
    assert "exists: choose another name, or --force replaces it" in said
    assert model.read_text() == "mine"
    assert "model: " in run("diagnose", case, "--write-model", model, "--force")
    assert "coulomb_friction" in model.read_text()
    signals = case / "s.parquet"
    signals.write_text("earlier")
    # There are none in the diagnosis that stands in for the work: they come to be written.
    assert "exists" not in run("diagnose", case, "--signals", signals, status=2)


def test_what_is_read_is_replaced_by_no_force(case, no_work):
    for name in ("logs/moves.parquet", "robot.toml", "case.toml"):
        assert "got an input" in run("diagnose", case, "--json", case / name, "--force", status=2)


def test_one_word_replaces_files(case):
    log = case / "logs" / "moves.parquet"
    (case / "x.csv").write_text("mine")
    said = run("simulate", "irb6600_like", log, "--out", case / "x.csv", status=2)
    assert "--out: " in said
    assert "is no .parquet" in said
    own = write_csv(case / "own.csv", maker_columns("abb", 6))
    for make in (("columns", "guess", own), ("robot", "import", written(case, URDF))):
        out = case / f"made_{make[0]}.toml"
        run(*make, "-o", out)
        assert "exists: choose another name, or --force" in run(*make, "-o", out, status=2)
        run(*make, "-o", out, "--force")
