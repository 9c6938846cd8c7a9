"""The page of truths has the figures of the score beside it, `docs/truth.json`."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from axisight.blind.score import Share
from axisight.effects import effect_table

FIRST = "effect first, severity 3 and more"
COLUMNS = (
    FIRST,
    "axis",
    "false alarms on nothing withheld",
    "wrong cause explained",
    "pairs: both",
)
OUTSIDE = " (out of the library)"


@pytest.fixture(scope="module")
def score(repository: Path) -> dict[str, Any]:
    text = (repository / "docs" / "truth.json").read_text(encoding="utf-8")
    found: dict[str, Any] = json.loads(text)
    return found


@pytest.fixture(scope="module")
def rows(repository: Path) -> list[list[str]]:
    """Cells of all rows of the page's tables."""
    page = (repository / "docs" / "truth.md").read_text(encoding="utf-8")
    lines = re.findall(r"^\| (.*) \|$", page, flags=re.MULTILINE)
    return [line.split(" | ") for line in lines]


def of(share: dict[str, Any]) -> str:
    return f"{share['hits']}/{share['of']}" if share["of"] else "-"


def test_shares_by_what_is_drawn(score: dict[str, Any], rows: list[list[str]]) -> None:
    for setting, settings in score["settings"].items():
        for name, told in settings.items():
            head = f"{setting} {name}" if setting == "references" else name
            shares = [of(told["figures"][column]) for column in COLUMNS]
            assert [head, str(told["cases"]), *shares] in rows, head
    for family, told in score["families"].items():
        assert [family, of(told["severe"]), of(told["all"])] in rows, family
    for step in score["detection"]:
        share = Share(step["hits"], step["of"])
        assert any(row[-1] == str(share) for row in rows), step


def test_the_draw_is_among_the_earlier_ones(score: dict[str, Any], rows: list[list[str]]) -> None:
    (row,) = (row for row in rows if row[0] == "185")
    assert row[1] == str(score["cases"])
    assert row[2:4] == [of(score["figures"][name]) for name in (FIRST, "axis")]
    assert row[-1] == f"{score['calibration']['error']:.3f}"


def test_every_confusion_is_told(score: dict[str, Any], rows: list[list[str]]) -> None:
    wanted = []
    for truth, named in score["confusion"].items():
        known = truth in effect_table()
        right = truth if known else "none" if truth == "nothing" else "unknown"
        head = truth if known or truth == "nothing" else truth + OUTSIDE
        total = sum(named.values())
        wanted += [[head, name, f"{n} of {total}"] for name, n in named.items() if name != right]
    assert sorted(row for row in rows if re.fullmatch(r"\d+ of \d+", row[-1])) == sorted(wanted)
