"""Studies that nobody means: numbers out of all bounds, far too many runs, a store that is damaged."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from axisight import montecarlo as mc
from axisight.cli import app
from axisight.errors import StoreError, StudyError
from montecarlo_data import small_study

STUDY = """
robot = "irb6600_like"
runs = 3
[excitation.multisine]
period_s = 0.5
band_hz = [4.0, 40.0]
peak_rad_s = 8.0
"""


def run(folder: Path, runs: str, *more: str) -> tuple[int, str]:
    study = folder / "study.toml"
    study.write_text(STUDY.replace("runs = 3", f"runs = {runs}"))
    done = CliRunner().invoke(app, ["montecarlo", str(study), "--out", str(folder / "out"), *more])
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    return done.exit_code, " ".join(done.output.split())


@pytest.mark.parametrize("huge", [10**30, 1e30, 10**10])
@pytest.mark.parametrize("field", ["runs", "block_runs"])
def test_integers_out_of_bounds_are_named(huge, field):
    with pytest.raises(StudyError, match=f"^{field}: "):
        small_study(**{field: huge})


@pytest.mark.parametrize("huge", [10**30, 1e30])
@pytest.mark.parametrize("field", ["periods", "waiting_periods"])
def test_so_are_those_inside(huge, field):
    with pytest.raises(StudyError, match=f"^{field}: "):
        mc.Measurement(**{field: huge})


@pytest.mark.parametrize("runs", ["1e8", "200_000"])
def test_very_many_runs_are_estimated_and_not_begun(tmp_path, runs):
    status, said = run(tmp_path, runs)
    assert status == 2
    assert f"runs: {int(float(runs))} runs take about" in said
    assert "GB: pass --yes" in said
    assert not (tmp_path / "out").exists()


def test_runs_of_the_option_count_too(tmp_path):
    status, said = run(tmp_path, "3", "--runs", "200000")
    assert (status, "pass --yes" in said) == (2, True)
    assert run(tmp_path, "200000", "--runs", "2")[0] == 0


@pytest.mark.parametrize("runs", ["1e9", "1" + 30 * "0"])
def test_no_word_makes_more_than_the_most(tmp_path, runs):
    status, said = run(tmp_path, runs, "--yes")
    assert (status, "runs: " in said) == (2, True)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda _: "{",
        lambda _: "[]",
        lambda root: json.dumps(root)[:-40],
        lambda root: json.dumps(without(root, "design")),
        lambda root: json.dumps(without(root, "seed")),
        lambda root: json.dumps(root | {"attributes": root["attributes"] | {"design": "{"}}),
        lambda root: json.dumps(root | {"attributes": root["attributes"] | {"design": 3}}),
    ],
)
def test_damaged_metadata_are_said_with_what_to_do(tmp_path, spoil):
    mc.run(small_study(runs=1), out=tmp_path)
    path = tmp_path / "study.zarr" / "zarr.json"
    path.write_text(spoil(json.loads(path.read_text())))
    with pytest.raises(StoreError, match=r"zarr\.json: .*put back a copy"):
        mc.run(small_study(runs=1), out=tmp_path, resume=True)


def without(root: dict, name: str) -> dict:
    kept = {key: value for key, value in root["attributes"].items() if key != name}
    return root | {"attributes": kept}
