"""`axisight randomize`, and `diagnose --posterior`: tables, files, misuse."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from axisight.cli import app
from axisight.cli import outputs as module
from axisight.errors import MissingExtraError
from axisight.posterior import (
    load_posterior,
    load_randomization,
    randomization_document,
    save_posterior,
    with_repeats,
)
from axisight.repeats import compare_days
from gap_data import bare_axis, bare_case, log_of, reference, scattered
from posterior_data import two_hypotheses
from repeat_data import runs


def run(*arguments: str | Path, status: int = 0) -> str:
    done = CliRunner().invoke(app, [str(a) for a in arguments])
    assert done.exit_code == status, (done.output, done.exception)
    return " ".join(done.output.split())


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    return save_posterior(two_hypotheses(), tmp_path_factory.mktemp("made") / "v.nc", draws=10)


def test_without_a_project_it_says_what_is_known(made):
    said = run("randomize", made)
    assert "correlated: coulomb_friction@1.coulomb_nm and axis1.viscous_friction (-0.78)" in said
    assert "open: torque_offset@1, weight 0.25" in said
    assert "open, without values here: sensor_delay@1: no log tells it from another" in said


def test_with_a_project_it_writes_code_and_says_what_has_no_home(made, tmp_path):
    out, plot = tmp_path / "dr.py", tmp_path / "corner.svg"
    said = run("randomize", made, "--for", "isaaclab", "-o", out, "--plot", plot)
    assert "no home: axis1.stiffness: the gears of such a model are rigid" in said
    compile(out.read_text("utf-8"), "dr.py", "exec")
    assert plot.read_text("utf-8").startswith("<?xml")
    elastic = run("randomize", made, "--for", "mjlab", "--elastic-gears")
    assert "gear_stiffness" in elastic and "no home: axis1.stiffness" not in elastic


def test_a_document_for_any_simulator(made, tmp_path):
    out = tmp_path / "ranges.yaml"
    assert "written:" in run("randomize", made, "-o", out)
    expected = randomization_document(load_posterior(made))
    assert load_randomization(out) == expected
    run("randomize", made, "--elastic-gears", "-o", out)
    assert load_randomization(out).number("gear_stiffness of axis1").unit == "Nm/rad"


def test_what_varies_between_runs_comes_from_repeats(made, tmp_path):
    comparison = compare_days(*runs(2, 20, scatter=0.05), torque_held=False)
    (tmp_path / "repeat.json").write_text(json.dumps(comparison.to_dict()))
    run("randomize", made, "--repeats", tmp_path / "repeat.json", "-o", tmp_path / "ranges.yaml")
    found = load_randomization(tmp_path / "ranges.yaml")
    assert found == randomization_document(with_repeats(load_posterior(made), comparison))
    (tmp_path / "no.json").write_text("[]")
    said = run("randomize", made, "--repeats", tmp_path / "no.json", status=2)
    assert "--repeats: expected the JSON of 'axisight repeat --json'" in said


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (
            ["-o", "dr.py"],
            "--out: expected a name ending in .yaml, .yml, .json, or --for beside it",
        ),
        (["--for", "mjlab", "-o", "dr.yaml"], "--out: expected a Python file with --for"),
        (
            ["--for", "mjlabs"],
            "--for: expected one of mjlab, playground, isaaclab, got 'mjlabs'. Did you mean",
        ),
        (["--for", "mjlab", "-o", "notes.txt"], "notes.txt exists"),
    ],
)
def test_misuse(made, tmp_path, monkeypatch, arguments, says):
    monkeypatch.chdir(tmp_path)
    Path("notes.txt").write_text("mine")
    assert says in run("randomize", made, *arguments, status=2)
    assert Path("notes.txt").read_text() == "mine"


def test_a_file_that_is_none(tmp_path):
    (tmp_path / "v.nc").write_text("no")
    assert "expected a posterior of axisight" in run("randomize", tmp_path / "v.nc", status=2)
    assert "No such file" in run("randomize", tmp_path / "gone.nc", status=2)


def test_a_missing_library_stops_a_diagnosis_before_the_work(tmp_path, monkeypatch):
    def missing() -> None:
        raise MissingExtraError("NetCDF files need h5netcdf")

    machine = bare_axis()
    logs = [
        log_of(machine, [], reference("multisine", k, 3000, machine.sample_time_s), k, f"log{k}")
        for k in range(2)
    ]
    case = bare_case(tmp_path / "case", logs)
    monkeypatch.setattr(module, "check_library", missing)
    assert "need h5netcdf" in run("diagnose", case, "--posterior", tmp_path / "v.nc", status=2)


def test_a_diagnosis_writes_its_posterior(tmp_path):
    machine = scattered(bare_axis(), 4)
    logs = [
        log_of(machine, [], reference("multisine", k, 6000, machine.sample_time_s), k, f"log{k}")
        for k in range(3)
    ]
    case, out = bare_case(tmp_path / "case", logs), tmp_path / "v.nc"
    said = run("diagnose", case, "--posterior", out)
    assert f"posterior: {out}".replace(" ", "") in said.replace(" ", "")
    assert "% of held-out torque" in said
    found = load_posterior(out)
    assert found.verdict == "none" and 0.93 < found.held_out[0].attrs["inside"] < 0.97
