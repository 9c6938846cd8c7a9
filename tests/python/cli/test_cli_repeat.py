"""``axisight repeat``: what it prints, writes and refuses, and its exit status."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from axisight.cli import app
from repeat_data import log, runs, write

# Torques of the closed form belong to the samples.
MEASURED = "--torque-measured"


def run(*arguments: object, code: int = 0) -> str:
    result = CliRunner(env={"COLUMNS": "100"}).invoke(app, ["repeat", *map(str, arguments)])
    assert result.exit_code == code, result.output
    assert result.exception is None or isinstance(result.exception, SystemExit)
    return " ".join(result.output.split())


def written(folder: Path, **options: float) -> list[Path]:
    """Write three runs a day and return their files."""
    logs, days = runs(2, 4, **options)
    paths = [folder / day / f"{one.name}.parquet" for one, day in zip(logs, days, strict=True)]
    for one, path in zip(logs, paths, strict=True):
        write(one, path)
    return paths


def test_nothing_moved(tmp_path):
    said = run(*written(tmp_path, seed=1), MEASURED)
    assert "8 runs of one motion on 2 days: day0 (4), day1 (4)" in said
    assert "nothing moved" in said


def test_what_moved_is_named_drawn_and_written(tmp_path):
    paths = written(tmp_path, change=0.2)
    out, picture = tmp_path / "days.json", tmp_path / "days.svg"
    said = run(*paths, MEASURED, "--json", out, "--plot", picture, "--places", code=1)
    assert "moved: axis2.viscous_friction, +0.00" in said and "from day0 to day1" in said
    assert "first quarter" in said and "note: no temperature was logged" in said
    document = json.loads(out.read_text("utf-8"))
    assert document["moved"][0] == "axis2.viscous_friction"
    assert [r["day"] for r in document["runs"]] == ["day0"] * 4 + ["day1"] * 4
    assert "<svg" in picture.read_text("utf-8")


def test_days_by_file_name_and_json_alone(tmp_path):
    paths = written(tmp_path, change=0.2)
    flat = [tmp_path / f"{p.parent.name}_{p.name}" for p in paths]
    for old, new in zip(paths, flat, strict=True):
        old.rename(new)
    options = ["-q", "--by", "{day}_d*", "--json", "-", "--reference", "day1"]
    result = CliRunner().invoke(app, ["repeat", *map(str, flat), MEASURED, *options])
    document = json.loads(result.stdout)
    assert result.exit_code == 1 and document["reference"] == "day1"


def test_one_axis_has_shares(tmp_path):
    """An axis alone: its values are believed, and changes are shares of them."""
    paths = written(tmp_path, change=0.2)
    columns = tmp_path / "map.toml"
    columns.write_text(
        'time.name = "time_s"\n[[axis]]\nposition = {name = "position_2", unit = "rad"}\n'
        'torque = {name = "torque_cmd_2", unit = "Nm"}\n'
    )
    said = run(*paths, MEASURED, "--columns", columns, code=1)
    # 20 %, within its interval of 1 to 2 %.
    assert re.search(r"moved: axis1.viscous_friction, \+(19|20|21) ± 1(\.\d)? % from", said)
    assert "a change of 2 % would be found with probability: axis1.coulomb_friction" in said


def test_misuse(tmp_path):
    paths = written(tmp_path)
    assert "two runs or more of one day" in run(paths[0], paths[4], code=2)
    assert "--by: expected" in run(*paths, "--by", "date", code=2)
    assert "--plot: expected a name ending in" in run(*paths, "--plot", "days.txt", code=2)
    assert "--reference: expected one of day0, day1" in run(*paths, "--reference", "x", code=2)
    other = log("else", seed=9)
    write(replace(other, position_rad=1.1 * other.position_rad), tmp_path / "day1" / "else.parquet")
    said = run(*paths, tmp_path / "day1" / "else.parquet", MEASURED, code=2)
    assert "day1/else.parquet: expected the motion of day0/d0r0.parquet" in said


def test_a_longer_run_is_compared_where_runs_overlap(tmp_path):
    paths = written(tmp_path)
    write(log("longer", seed=9, start_s=-1.0, seconds=10.0), tmp_path / "day1" / "longer.parquet")
    said = run(*paths, tmp_path / "day1" / "longer.parquet", MEASURED)
    assert "starts differ by up to 1 s" in said and "over the 8 s that they share" in said


@pytest.mark.parametrize("option", ["--json", "--plot"])
def test_logs_are_never_replaced(tmp_path, option):
    paths = written(tmp_path)
    ending = {"--json": ".json", "--plot": ".png"}[option]
    other = tmp_path / f"notes{ending}"
    other.write_text("mine")
    before = other.read_text()
    run(*paths, option, paths[0], "--force", code=2)
    assert other.read_text() == before
