"""The claims of a folder: whole, or said to be a part."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from axisight.errors import InputError
from axisight_thesis import Claim, Item, context, read_claims, record_claims, write

KNOWN = ["table-1.1", "figure-1.2", "claims-1"]
MADE = {
    "table-1.1": Item("table-1.1", "", claims=(Claim("b", "1.2", "One.", False, "|dG| 3"),)),
    "figure-1.2": Item("figure-1.2", ""),
    "claims-1": Item(
        "claims-1",
        "",
        claims=(Claim("a", "1.1", "Two.", np.True_, "4"), Claim("c", "1.3", "Three.", None, "5")),
    ),
}


def page(out: Path) -> str:
    return (out / "claims.md").read_text()


def record(out: Path, *names: str, seed: int = 0, quick: bool = False) -> None:
    record_claims([MADE[n] for n in names], context(seed=seed, quick=quick), out, KNOWN)


def test_all_items_make_a_complete_page(tmp_path: Path) -> None:
    record(tmp_path, *KNOWN)
    lines = page(tmp_path).splitlines()
    assert lines[2].startswith("Complete: all 3 items, seed 0, version ")
    assert lines[4] == "1 of 3 claims hold on this robot, 1 undecided."
    assert lines[8:] == [
        "| 1.1 | Two. | yes | 4 |",
        r"| 1.2 | One. | **no** | \|dG\| 3 |",
        "| 1.3 | Three. | **undecided** | 5 |",
    ]
    table = pd.read_csv(tmp_path / "claims.csv")
    assert list(table["holds"]) == ["yes", "no", "undecided"]
    assert list(table["item"]) == ["claims-1", "table-1.1", "claims-1"]


def test_a_part_names_what_it_lacks(tmp_path: Path) -> None:
    record(tmp_path, "table-1.1")
    assert "**Not complete**: 2 of 3 items have not been run" in page(tmp_path)
    assert "missing: figure-1.2, claims-1." in page(tmp_path)
    assert "Complete: all" not in page(tmp_path)


def test_items_one_by_one_give_the_page_of_all(tmp_path: Path) -> None:
    """An item without claims counts too: its run is recorded."""
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    record(whole, *KNOWN)
    for name in reversed(KNOWN):
        record(parts, name)
    for file in ("claims.md", "claims.csv", "claims.json"):
        assert (parts / file).read_bytes() == (whole / file).read_bytes()


def test_one_item_replaces_its_own_claims_only(tmp_path: Path) -> None:
    record(tmp_path, *KNOWN)
    again = Item("table-1.1", "", claims=(Claim("b", "1.2", "One.", True, "new"),))
    record_claims([again], context(), tmp_path, KNOWN)
    assert "| 1.2 | One. | yes | new |" in page(tmp_path)
    assert "2 of 3 claims hold" in page(tmp_path)
    assert "Complete: all 3 items" in page(tmp_path)


def test_other_settings_are_marked(tmp_path: Path) -> None:
    record(tmp_path, *KNOWN)
    record(tmp_path, "figure-1.2", seed=1, quick=True)
    assert "Complete: all" not in page(tmp_path)
    assert "**Mixed settings**: seed 0, version" in page(tmp_path)
    assert "seed 1, quick, version" in page(tmp_path)
    record(tmp_path, *KNOWN)
    assert "Complete: all 3 items" in page(tmp_path)


def test_an_item_that_is_gone_leaves_no_claims(tmp_path: Path) -> None:
    record(tmp_path, *KNOWN)
    record_claims([MADE["table-1.1"]], context(), tmp_path, ["table-1.1"])
    assert list(read_claims(tmp_path)) == ["table-1.1"]
    assert "Complete: all 1 items" in page(tmp_path)


@pytest.mark.parametrize("text", ["{", "[]", '{"schema": "other", "items": {}}'])
def test_a_damaged_record_stops_before_any_computation(tmp_path: Path, text: str) -> None:
    (tmp_path / "claims.json").write_text(text)
    with pytest.raises(InputError, match=r"claims\.json: expected .* delete it"):
        write.run("table-8.1", context(quick=True), tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["claims.json"]


def test_an_interrupted_run_keeps_finished_claims(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A part of the study is a part on the page too."""

    def stop(_: object) -> Item:
        raise KeyboardInterrupt

    made = {name: (lambda _, one=one: one) for name, one in MADE.items()} | {"claims-1": stop}
    monkeypatch.setattr("axisight_thesis.write.registered", lambda: made)
    monkeypatch.setattr("axisight_thesis.write.item_names", lambda _: list(made))
    with pytest.raises(KeyboardInterrupt):
        write.run("all", context(), tmp_path)
    assert sorted(read_claims(tmp_path)) == ["figure-1.2", "table-1.1"]
    assert "missing: claims-1." in page(tmp_path)


def test_the_whole_study_is_complete(tmp_path: Path) -> None:
    """One command computes every item, and the page holds the claims of all."""
    made = write.run("all", context(quick=True), tmp_path)
    assert "Complete: all" in page(tmp_path)
    table = pd.read_csv(tmp_path / "claims.csv")
    assert table["id"].is_unique
    assert sorted(table["id"]) == sorted(c.id for one in made for c in one.claims)
    # Before other chapters: 97 claims of the text and 17 on values of the tables.
    assert len(table) >= 114
