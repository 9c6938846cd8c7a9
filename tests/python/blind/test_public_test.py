"""Entries of the public test: what is read of them, how they are scored, and methods beside one another."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from axisight.blind import calibration_error, comparison, comparison_table, judged_cases, summary
from axisight.blind.entries import ENTRY_SCHEMA, as_verdict, entries_in, entry_line
from axisight.blind.sealed import SEAL, TRUTH_SCHEMA, seal_of
from axisight.cli import app
from axisight.errors import InputError

FRICTION = {"effect": "coulomb_friction", "axis": 1}
RIPPLE = {"effect": "torque_ripple", "axis": 2}


def entry(verdict: str, *causes: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"schema": ENTRY_SCHEMA, "verdict": verdict, "causes": list(causes), **more}


def truth(*effects: dict[str, Any], severity: float = 10.0) -> dict[str, Any]:
    named = [{"parameters": {"coulomb_nm": 0.5}, **one} for one in effects]
    setting = {"engine": "mujoco", "arm": "scara_like", "motions": "moves", "references": "logged"}
    return {
        "schema": TRUTH_SCHEMA,
        **setting,
        "effects": named,
        "severity": [severity if effects else 0.0] * 2,
    }


class Drawn:
    """Folders of sealed cases with truths, and of entries by method."""

    def __init__(self, at: Path) -> None:
        self.at, self.cases, self.truths = at, at / "cases", at / "truths"

    def case(self, name: str, held: dict[str, Any]) -> None:
        text = json.dumps(held)
        (self.cases / name).mkdir(parents=True)
        self.truths.mkdir(exist_ok=True)
        (self.truths / f"{name}.json").write_text(text)
        (self.cases / name / SEAL).write_text(seal_of(text))

    def entry(self, method: str, name: str, said: dict[str, Any]) -> Path:
        (self.at / method).mkdir(exist_ok=True)
        (self.at / method / f"{name}.json").write_text(json.dumps(said))
        return self.at / method

    def judged(self, method: str, **how: Any) -> Any:
        return judged_cases(self.cases, self.truths, self.at / method, **how)


@pytest.fixture
def drawn(tmp_path: Path) -> Drawn:
    made = Drawn(tmp_path)
    made.case("a", truth(FRICTION))
    made.case("b", truth())
    made.case("c", truth(FRICTION, RIPPLE))
    made.case("d", truth({"effect": "not_in_the_library", "axis": 1}))
    return made


def test_the_smallest_entry_is_a_verdict_with_its_causes(drawn: Drawn) -> None:
    drawn.entry("m", "a", entry("explained", FRICTION))
    drawn.entry("m", "b", {"schema": ENTRY_SCHEMA, "verdict": "none"})
    drawn.entry("m", "c", entry("explained", RIPPLE, FRICTION))
    drawn.entry("m", "d", entry("unknown", where=[1]))
    judged = drawn.judged("m")
    assert [j.right for j in judged] == [True] * 4
    assert [j.named for j in judged][2] == ("torque_ripple@2", "coulomb_friction@1")
    assert all(math.isnan(p) for j in judged for p in j.probabilities)
    # Causes of unstated probability are no part of the calibration, and nothing else needs them.
    assert math.isnan(calibration_error(judged))
    assert summary(judged)["figures"]["axis"]["hits"] == 2


def test_an_entry_is_scored_as_the_verdict_that_it_is_part_of(drawn: Drawn) -> None:
    values = {"coulomb_nm": {"value": 0.52, "ci95": [0.45, 0.6]}}
    cause = {**FRICTION, "probability": 0.9, "parameters": values}
    close = [
        {**RIPPLE, "probability": 0.08},
        {"effect": "backlash", "axis": 1, "probability": 0.01},
    ]
    whole = {
        "schema": "axisight.verdict/2",
        "verdict": "explained",
        "causes": [{**cause, "gap_reduction": {"value": 0.97}}],
        "alternatives": close,
        "equivalent": [],
        "where": [{"axis": 1}],
        "detection_limits": [],
        "provenance": {"seconds": 4.0},
    }
    drawn.entry("verdicts", "a", whole)
    drawn.entry(
        "entries", "a", entry("explained", cause, alternatives=close, where=[1], seconds=4.0)
    )
    (one,), (other,) = drawn.judged("verdicts"), drawn.judged("entries")
    fields = set(vars(one)) - {"reduction"}
    assert {f: vars(one)[f] for f in fields} == {f: vars(other)[f] for f in fields}
    assert one.allowed == {"coulomb_friction@1", "torque_ripple@2"}
    assert one.seconds == 4.0 and one.covered == (True,)


def test_a_file_of_lines_is_scored_as_the_folder_of_verdicts(drawn: Drawn) -> None:
    verdict = {
        "schema": "axisight.verdict/2",
        "verdict": "undecidable",
        "causes": [
            {**FRICTION, "probability": 0.6, "parameters": {}, "gap_reduction": {"value": 0.9}}
        ],
        "alternatives": [
            {**RIPPLE, "probability": 0.4},
            {"effect": "backlash", "axis": 1, "probability": 0.01},
        ],
        "equivalent": [["torque_offset@1", "torque_sensor_offset@1"]],
        "where": [{"axis": 1, "share": 0.7}, {"axis": 2, "share": 0.3}],
        "detection_limits": [],
        "provenance": {"seconds": 4.0},
    }
    drawn.entry("verdicts", "a", verdict)
    drawn.entry("verdicts", "b", entry("none", seconds=2.0))
    lines = drawn.at / "lines.jsonl"
    lines.write_text(entry_line("a", verdict) + entry_line("b", entry("none", seconds=2.0)))
    for whole, packed in zip(drawn.judged("verdicts"), drawn.judged("lines.jsonl"), strict=True):
        fields = set(vars(whole)) - {"reduction"}
        assert {f: vars(whole)[f] for f in fields} == {f: vars(packed)[f] for f in fields}
    # The second line is still there when the first is gone, and its absence counts as wrong.
    lines.write_text(entry_line("b", entry("none")))
    assert [one.verdict for one in drawn.judged("lines.jsonl", every=True)][:2] == [
        "failed",
        "none",
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"case": "a"}\n{"case": "a"}\n', "line 2: case: expected 'a' once"),
        ('{"verdict": "none"}\n', "line 1: expected an entry with the key 'case'"),
        ('{"case": 3}\n', "line 1: case: expected the name of a case"),
        ("[1]\n", "line 1: expected an entry with the key 'case'"),
        ("", "expected verdicts in a folder"),
    ],
)
def test_a_damaged_file_of_lines_is_refused_by_its_line(
    tmp_path: Path, text: str, message: str
) -> None:
    path = tmp_path / "mine.jsonl"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        entries_in(path)


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ({"schema": "axisight.entry/9", "verdict": "none"}, "expected one of the schemas"),
        ({"verdict": "none"}, "expected one of the schemas"),
        (entry("maybe"), "verdict"),
        (entry("explained"), "expected at least one beside 'explained'"),
        (entry("none", FRICTION), "expected none beside 'none'"),
        (entry("unknown", FRICTION), "expected none beside 'unknown'"),
        (entry("explained", {"effect": "coulomb_frction", "axis": 1}), "coulomb_friction"),
        (entry("explained", {**FRICTION, "axis": 0}), "axis"),
        (entry("explained", {**FRICTION, "probability": 1.5}), "probability"),
        (entry("explained", {**FRICTION, "parameters": {"x": {"value": "NaN"}}}), "value"),
        (entry("none", seconds=-1), "seconds"),
    ],
)
def test_what_is_no_entry_is_refused(said: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        as_verdict(said, "x.json")
    assert str(caught.value).startswith("x.json: ")


def wilson(hits: int, of: int) -> tuple[float, float]:
    """Wilson's interval in closed form (Wilson 1927, with z of 95 %)."""
    z, p = 1.959963984540054, hits / of
    middle = (p + z**2 / (2 * of)) / (1 + z**2 / of)
    half = z * math.sqrt(p * (1 - p) / of + z**2 / (4 * of**2)) / (1 + z**2 / of)
    return middle - half, middle + half


def test_methods_stand_beside_one_another_on_all_cases(drawn: Drawn) -> None:
    drawn.entry("good", "a", entry("explained", FRICTION, seconds=1.0))
    drawn.entry("good", "b", entry("none", seconds=3.0))
    drawn.entry("good", "c", entry("explained", FRICTION, RIPPLE, seconds=8.0))
    drawn.entry("good", "d", entry("unknown", seconds=2.0))
    drawn.entry("bold", "a", entry("explained", {**FRICTION, "axis": 2}))
    drawn.entry("bold", "b", entry("explained", FRICTION))
    found = comparison(
        drawn.cases, drawn.truths, {"good": drawn.at / "good", "bold": drawn.at / "bold"}
    )
    good, bold = (found["methods"][name] for name in ("good", "bold"))
    assert found["cases"] == 4 and (good["missing"], bold["missing"]) == (0, 2)
    assert good["seconds"] == 2.5 and bold["seconds"] is None
    right = good["figures"]["right: the truth and nothing else"]
    assert (right["hits"], right["of"]) == (4, 4)
    assert (right["low"], right["high"]) == pytest.approx(wilson(4, 4), abs=1e-12)
    # What a method left out counts as wrong: the pair and the effect out of the library.
    figures = {name: (f["hits"], f["of"]) for name, f in bold["figures"].items()}
    assert figures["right: the truth and nothing else"] == (0, 4)
    assert figures["effect first, severity 3 and more"] == (0, 1)
    assert figures["false alarms on nothing withheld"] == (1, 1)
    assert figures["wrong cause explained"] == (2, 4)
    assert figures["pairs: both"] == (0, 1)
    assert figures["out of the library: unknown"] == (0, 1)
    table = comparison_table(found)
    assert table.startswith("| 4 cases | good | bold |\n")
    assert "| median time per case | 2.5 s | - |" in table and "| no entry | 0 | 2 |" in table


def test_the_command_compares(drawn: Drawn, tmp_path: Path) -> None:
    at = drawn.entry("m", "a", entry("explained", FRICTION))
    given = ["blind", "compare", str(drawn.cases), "--truth", str(drawn.truths)]
    out, data = tmp_path / "table.md", tmp_path / "table.json"
    written = ["--out", str(out), "--json", str(data)]
    done = CliRunner().invoke(app, [*given, "--entries", f"m={at}", *written])
    assert done.exit_code == 0, done.output
    assert "| 4 cases | m |" in done.output and "| no entry | 3 |" in out.read_text()
    assert json.loads(data.read_text())["schema"] == "axisight.comparison/1"
    for wrong, message in [("m", "NAME=ENTRIES"), ("=x", "NAME=ENTRIES"), ("m=", "NAME=ENTRIES")]:
        done = CliRunner().invoke(app, [*given, "--entries", wrong])
        assert done.exit_code == 2 and message in done.output
    twice = CliRunner().invoke(app, [*given, "--entries", f"m={at}", "--entries", f"m={at}"])
    assert twice.exit_code == 2 and "once" in twice.output
    none = CliRunner().invoke(app, [*given, "--entries", f"m={tmp_path / 'nothing'}"])
    assert none.exit_code == 2 and "got none" in none.output


def test_a_damaged_entry_stops_the_comparison_by_its_name(drawn: Drawn) -> None:
    at = drawn.entry("m", "b", entry("none", FRICTION))
    with pytest.raises(InputError, match=r"b\.json: causes"):
        comparison(drawn.cases, drawn.truths, {"m": at})
    (drawn.truths / "b.json").write_text(json.dumps(truth(RIPPLE)))
    with pytest.raises(InputError, match="sealed"):
        comparison(drawn.cases, drawn.truths, {"m": at})
    with pytest.raises(InputError, match="at least one method"):
        comparison(drawn.cases, drawn.truths, {})


def test_pages_of_a_score_take_entries(drawn: Drawn) -> None:
    drawn.entry("m", "a", entry("undecidable", RIPPLE, alternatives=[FRICTION]))
    (judged,) = drawn.judged("m")
    assert judged.allowed == {"torque_ripple@2"}, "an alternative counts from a probability of 0.05"
    assert json.dumps(summary([judged]), allow_nan=False)
    assert np.isnan(judged.reduction)


def test_the_page_shows_an_entry_and_the_table_of_its_data(repository: Path) -> None:
    page = (repository / "docs" / "public_test.md").read_text("utf-8")
    (example,) = re.findall(r"^```json\n(.*?)^```$", page, re.DOTALL | re.MULTILINE)
    read = as_verdict(json.loads(example), "example")
    assert [(c["effect"], c["axis"]) for c in read["causes"]] == [("coulomb_friction", 2)]
    measured = json.loads((repository / "docs" / "data" / "public_test.json").read_text("utf-8"))
    assert comparison_table(measured).strip() in page


def test_published_entries_can_be_scored(repository: Path) -> None:
    for path in (repository / "benches" / "public_entries").glob("*.jsonl"):
        for text, where in entries_in(path).values():
            assert as_verdict(json.loads(text), where)["provenance"]["seconds"] > 0
