"""Many cases at once: one table, causes that grow, the same bits wherever they are diagnosed."""

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from axisight import InputError, Settings
from axisight.cli.application import app
from axisight.effects import Effect
from axisight.fleet import diagnose_fleet, fleet_cases, fleet_table, render_fleet, trends
from fleet_data import write_case
from montecarlo_data import dask_cluster, kill
from pages import assert_strict

QUICK = Settings(bootstrap=50)
# Dry friction of the first machine, day by day [Nm].
DAYS = (0.0, 0.3, 0.45, 0.6, 0.75, 0.9)


@pytest.fixture(scope="module")
def fleet(tmp_path_factory) -> Path:
    """Six days of a machine that wears, one of a machine that does not, and a case without a log."""
    folder = tmp_path_factory.mktemp("fleet")
    for day, size in enumerate(DAYS):
        friction = Effect("coulomb_friction", 1, {"coulomb_nm": size, "smoothing_rad_s": 0.05})
        write_case(folder / "welder" / f"day_{day}", [friction] if size else [], 1)
    write_case(folder / "packer" / "day_0", [], 2)
    broken = folder / "packer" / "day_1"
    write_case(broken, [], 3)
    (broken / "logs" / "moves.parquet").unlink()
    return folder


@pytest.fixture(scope="module")
def verdicts(fleet, tmp_path_factory):
    out = tmp_path_factory.mktemp("verdicts")
    return out, diagnose_fleet(fleet, out, QUICK, workers=2)


def test_every_case_has_its_rows(fleet, verdicts):
    _, found = verdicts
    cases = fleet_cases(fleet)
    assert [c.name for c in cases] == sorted(found)
    table = fleet_table(cases, found)
    by_case = table.groupby("case")["verdict"].first()
    assert by_case["packer/day_0"] == "none"
    assert by_case["packer/day_1"] == "error"
    (reason,) = table.loc[table["case"] == "packer/day_1", "headline"]
    # What is wrong, by its name in the case, not by where it was unpacked.
    assert "moves.parquet" in reason and "/tmp" not in reason
    worn = table[table["machine"] == "welder"]
    assert (worn["effect"].dropna() == "coulomb_friction").all()
    sizes = worn.set_index("case")["value"]
    for day, size in enumerate(DAYS[1:], 1):
        assert sizes[f"welder/day_{day}"] == pytest.approx(size, rel=0.1)
    assert pd.isna(sizes["welder/day_0"])


def test_a_cause_that_grows_is_said_to(fleet, verdicts):
    table = fleet_table(fleet_cases(fleet), verdicts[1])
    (only,) = trends(table)
    assert (only.machine, only.effect, only.axis) == ("welder", "coulomb_friction", 1)
    assert only.changes and only.low <= only.per_case <= only.high
    assert only.per_case == pytest.approx(0.15, rel=0.1)
    # In another order of days nothing grows.
    names = table["case"].unique()
    order = dict(zip(sorted(names), ["a", "b", "e", "c", "g", "d", "h", "f"], strict=True))
    shuffled = table.assign(case=table["case"].map(order))
    assert not any(t.changes for t in trends(shuffled))


def test_trends_of_chance_are_rare():
    rng = np.random.default_rng(0)
    rows = [
        {"case": f"{m}/{day}", "machine": str(m), "verdict": "explained", "effect": "backlash",
         "axis": 1, "parameter": "half_width_rad", "value": float(rng.normal()), "unit": "rad"}
        for m in range(200) for day in range(8)
    ]  # fmt: skip
    found = trends(pd.DataFrame(rows))
    assert len(found) == 200
    # Two hundred series of noise, one false alarm in twenty such fleets; p-values are even.
    assert not any(t.changes for t in found)
    assert np.mean([t.p_value < 0.1 for t in found]) == pytest.approx(0.1, abs=0.07)


def test_finished_verdicts_stay_and_changed_cases_do_not(fleet, verdicts, tmp_path):
    out, found = verdicts
    stamps = {p: p.stat().st_mtime_ns for p in out.rglob("*.json")}
    assert diagnose_fleet(fleet, out, QUICK) == found
    assert {p: p.stat().st_mtime_ns for p in out.rglob("*.json")} == stamps
    # A verdict of other files, or one cut off, is made again.
    known = out / "packer" / "day_1.json"
    text = known.read_text("utf-8")
    known.write_text(text[:40], "utf-8")
    assert diagnose_fleet(fleet, out, QUICK) == found
    assert known.read_text("utf-8") == text


def test_a_page_shows_all_and_escapes(fleet, verdicts):
    table = fleet_table(fleet_cases(fleet), verdicts[1])
    table.loc[table["case"] == "packer/day_1", "headline"] = "<b>bad</b>"
    page = render_fleet("hall <3>", table, trends(table))
    assert_strict(page)
    assert page == render_fleet("hall <3>", table, trends(table))
    assert "8 cases of 2 machines: 1 error" in page
    assert "hall &lt;3&gt;" in page and "&lt;b&gt;bad" in page and "<b>bad" not in page
    assert "Coulomb friction, axis 1" in page and "changing over time" in page
    assert "://" not in page


def test_a_folder_without_cases_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"case\.toml"):
        fleet_cases(tmp_path)


def test_the_command_writes_table_and_page(fleet, tmp_path, verdicts):
    out = tmp_path / "out"
    small = tmp_path / "small"
    shutil.copytree(fleet / "packer" / "day_0", small / "packer" / "day_0")
    run = CliRunner().invoke(app, ["diagnose", "--fleet", str(small), "--out", str(out)])
    assert run.exit_code == 0, run.output
    table = pd.read_parquet(out / "fleet.parquet")
    assert list(table["verdict"]) == ["none"]
    assert (out / "fleet.html").is_file()
    verdict = json.loads((out / "verdicts" / "packer" / "day_0.json").read_text("utf-8"))
    assert verdict["verdict"] == "none"
    for wrong, says in (
        (["--fleet", str(small)], "--out"),
        (["--fleet", str(small), "--out", str(out), "--json", "x"], "--json"),
        ([str(small), "--scheduler", "tcp://x"], "expected --fleet FOLDER"),
        ([], "--fleet FOLDER"),
    ):
        refused = CliRunner().invoke(app, ["diagnose", *wrong])
        assert refused.exit_code == 2
        assert says in refused.output


def test_a_cluster_gives_the_same_bits_though_a_worker_dies(fleet, verdicts, tmp_path):
    pytest.importorskip("distributed", reason="Dask comes with the extra `dask`")
    with dask_cluster(tmp_path) as (address, _, workers):

        def sabotage(_label, done, _total):
            if done == 2:
                kill(workers[0])

        far = diagnose_fleet(fleet, tmp_path / "far", QUICK, scheduler=address, progress=sabotage)
    assert workers[0].returncode == -9
    assert far == verdicts[1]
    for path in sorted(verdicts[0].rglob("*.json")):
        there = tmp_path / "far" / path.relative_to(verdicts[0])
        assert there.read_bytes() == path.read_bytes()


def test_linked_folders_are_folders_and_no_way_round(tmp_path: Path):
    kept, day = tmp_path / "kept", tmp_path / "fleet" / "robot1"
    (kept / "logs").mkdir(parents=True)
    (kept / "case.toml").write_text("x")
    (kept / "logs" / "a.csv").write_text("y")
    day.mkdir(parents=True)
    (day / "monday").symlink_to(kept, target_is_directory=True)
    (kept / "logs" / "back").symlink_to(kept, target_is_directory=True)
    (case,) = fleet_cases(tmp_path / "fleet")
    assert (case.name, case.machine) == ("robot1/monday", "robot1")
    assert case.files() == {"case.toml": b"x", "logs/a.csv": b"y"}
