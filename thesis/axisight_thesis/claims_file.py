"""The claims of a folder: what each computed item claims, and whether any item is missing.

``claims.json`` records the claims of every item with the settings it was computed with. A later run
replaces its own items and keeps the others. ``claims.csv`` and ``claims.md`` are made from the record.
The page says first whether it covers all items, so a part never looks like the whole.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from importlib.metadata import version
from pathlib import Path

import pandas as pd

from axisight.documents import parse_json, read_text
from axisight.errors import InputError
from axisight.storage import write_whole
from axisight_thesis.context import Context
from axisight_thesis.item import Claim, Item

RECORD = "claims.json"
_SCHEMA = "axisight.claims/1"


@dataclass(frozen=True)
class Recorded:
    """The claims of one item, and the settings it was computed with."""

    seed: int
    quick: bool
    version: str
    claims: tuple[Claim, ...]

    @property
    def settings(self) -> str:
        """The settings as text, e.g. ``"seed 0, quick, version 1.0"``."""
        quick = ", quick" if self.quick else ""
        return f"seed {self.seed}{quick}, version {self.version}"


def record_claims(items: Iterable[Item], context: Context, out: Path, known: list[str]) -> None:
    """Add the claims of ``items`` to the record in ``out``, and write ``claims.csv`` and ``claims.md``.

    Claims of other items are kept, if their names are among ``known``, the names of all items in order.
    Raises InputError for a damaged record.
    """
    found = {name: one for name, one in read_claims(out).items() if name in known}
    for made in items:
        found[made.name] = Recorded(
            context.seed, context.quick, version("axisight"), tuple(map(_plain, made.claims))
        )
    ordered = {name: found[name] for name in known if name in found}
    entries = {name: asdict(one) for name, one in ordered.items()}
    write_whole(out / RECORD, json.dumps({"schema": _SCHEMA, "items": entries}, indent=1) + "\n")
    write_whole(out / "claims.csv", _csv(ordered))
    write_whole(out / "claims.md", _page(ordered, known))


def read_claims(out: Path) -> dict[str, Recorded]:
    """Return the recorded claims in a folder by item; empty for a folder without a record.

    Raises InputError, with advice, for a damaged record.
    """
    path = out / RECORD
    if not path.exists():
        return {}
    try:
        data = parse_json(read_text(path))
        if data["schema"] != _SCHEMA:
            raise ValueError(f"schema {data['schema']!r}")
        return {
            str(name): Recorded(
                int(one["seed"]),
                bool(one["quick"]),
                str(one["version"]),
                tuple(Claim(**claim) for claim in one["claims"]),
            )
            for name, one in data["items"].items()
        }
    except (AttributeError, LookupError, TypeError, ValueError) as error:
        raise InputError(
            f"{path}: expected the claims of earlier runs ({_SCHEMA}), got a damaged file ({error}): "
            "delete it, then run 'axisight reproduce all' in this folder"
        ) from None


def missing(found: Mapping[str, Recorded], known: list[str]) -> list[str]:
    """Return the items whose claims are not recorded."""
    return [name for name in known if name not in found]


def _plain(claim: Claim) -> Claim:
    """Return the claim with a verdict of Python, because JSON knows no NumPy types."""
    return replace(claim, holds=None if claim.holds is None else bool(claim.holds))


def _sorted(found: Mapping[str, Recorded]) -> list[tuple[str, Recorded, Claim]]:
    rows = [(name, one, claim) for name, one in found.items() for claim in one.claims]
    return sorted(rows, key=lambda row: row[2].section)


def _csv(found: Mapping[str, Recorded]) -> str:
    columns = ["id", "section", "statement", "holds", "evidence", "item", "settings"]
    rows = [
        [c.id, c.section, c.statement, c.verdict, c.evidence, name, one.settings]
        for name, one, c in _sorted(found)
    ]
    return str(pd.DataFrame(rows, columns=columns).to_csv(index=False, lineterminator="\n"))


def _page(found: Mapping[str, Recorded], known: list[str]) -> str:
    lines = ["# Claims", "", *_coverage(found, known), "", _count(found), ""]
    lines += ["| section | statement | holds | evidence |", "|---|---|---|---|"]
    for _, _, c in _sorted(found):
        cells = (c.section, c.statement, "yes" if c.holds else f"**{c.verdict}**", c.evidence)
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def _coverage(found: Mapping[str, Recorded], known: list[str]) -> list[str]:
    """Return whether the page covers all items, with one setting."""
    left = missing(found, known)
    by_settings: dict[str, list[str]] = {}
    for name, one in found.items():
        by_settings.setdefault(one.settings, []).append(name)
    if not left and len(by_settings) == 1:
        return [f"Complete: all {len(known)} items, {next(iter(by_settings))}."]
    lines = []
    if left:
        lines.append(
            f"**Not complete**: {len(left)} of {len(known)} items have not been run, and their claims "
            f"are missing: {', '.join(left)}."
        )
    if len(by_settings) > 1:
        parts = "; ".join(
            f"{settings}: {', '.join(names)}" for settings, names in by_settings.items()
        )
        lines.append(f"**Mixed settings**: {parts}.")
    lines.append("`axisight reproduce all` runs all items with one setting.")
    return "\n\n".join(lines).split("\n")


def _count(found: Mapping[str, Recorded]) -> str:
    verdicts = [claim.verdict for _, _, claim in _sorted(found)]
    undecided = verdicts.count("undecided")
    more = f", {undecided} undecided" if undecided else ""
    return f"{verdicts.count('yes')} of {len(verdicts)} claims hold on this robot{more}."
