"""Read the rows of tables of Denavit and Hartenberg from CSV or TOML, as text by column."""

from __future__ import annotations

import csv
from collections.abc import Collection, Iterable
from pathlib import Path
from typing import Any

from axisight.arguments import short, shown
from axisight.documents import parse_toml, read_text
from axisight.errors import RobotError
from axisight.robot.sources import refuse_neither

CONVENTIONS = ("standard", "modified")
GEOMETRY = ("theta_rad", "d_m", "a_m", "alpha_rad")
COM = ("com_x_m", "com_y_m", "com_z_m")
INERTIA = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
COLUMNS = ("joint", "convention", "motion", *GEOMETRY, "mass_kg", *COM, *INERTIA)
"""Columns of a table, in any order; those in `OPTIONAL` may be left out."""
OPTIONAL = {"motion": "revolute", "ixy": "0", "ixz": "0", "iyz": "0"}

Row = tuple[str, dict[str, str]]
"""The place of a row, for messages, and its text by column."""
_WORDS = ("joint", "motion")
# A TOML file states the convention once, at its head.
_KEYS = tuple(name for name in COLUMNS if name != "convention")


def rows_of(path: Path) -> list[Row]:
    """Return the rows of a table; raise RobotError naming file, line (of a CSV), joint and column."""
    return _toml_rows(path) if path.suffix.lower() == ".toml" else _csv_rows(path)


def _csv_rows(path: Path) -> list[Row]:
    try:
        with path.open(encoding="utf-8", newline="") as file:
            lines = [(n, x) for n, x in enumerate(file, start=1) if not x.startswith("#")]
        reader = csv.DictReader(text for _, text in lines)
        # The reader does not see comment lines, so its line numbers must be converted.
        found = [(lines[reader.line_num - 1][0], row) for row in reader]
        names = reader.fieldnames or []
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise RobotError(f"{path}: expected a readable table: {error}") from error
    _check_names(names, COLUMNS, f"{path}, line {lines[0][0] if lines else 1}", "columns")
    return _named(
        (f"{path}, line {n}", {k: v.strip() for k, v in row.items() if k and v}) for n, row in found
    )


def _toml_rows(path: Path) -> list[Row]:
    try:
        text = read_text(path)
        content = parse_toml(text)
    except (OSError, UnicodeDecodeError) as error:
        raise RobotError(f"{path}: expected a readable table: {error}") from error
    except ValueError as error:
        raise RobotError(f"{path}: expected TOML, got {error}") from None
    refuse_neither(text, str(path))
    if "schema" in content:
        raise RobotError(
            f"{path}: expected a table of Denavit and Hartenberg, which has no schema, got a file of schema "
            f"{shown(content['schema'])}"
        )
    unknown = [name for name in content if name not in ("convention", "joint")]
    if unknown:
        raise RobotError(
            f"{path}: expected the keys convention, joint, got unknown {', '.join(map(shown, unknown))}"
        )
    convention = content.get("convention", "")
    if convention not in CONVENTIONS:
        expected = " or ".join(CONVENTIONS)
        raise RobotError(f"{path}: convention: expected {expected}, got {shown(convention)}")
    tables = content.get("joint", [])
    if not isinstance(tables, list) or not tables or not all(isinstance(t, dict) for t in tables):
        raise RobotError(
            f"{path}: joint: expected tables [[joint]], one for each, got {shown(tables)}"
        )
    return _named(
        (where, {"convention": convention, **texts})
        for where, texts in (_texts(path, n, table) for n, table in enumerate(tables, start=1))
    )


def _texts(path: Path, number: int, table: dict[str, Any]) -> Row:
    """Return a joint of a TOML file as text, as in a CSV; `repr` keeps every bit of a number."""
    where = f"{path}, [[joint]] {number}"
    _check_names(list(table), _KEYS, f"{where}, joint {shown(table.get('joint', ''))}", "keys")
    texts = {}
    for name, value in table.items():
        word = name in _WORDS
        fits = isinstance(value, str) if word else type(value) in (int, float)
        if not fits:
            expected = "a word" if word else "a number"
            said = "" if name == "joint" else f", joint {shown(table['joint'])}"
            raise RobotError(f"{where}{said}: {name}: expected {expected}, got {shown(value)}")
        texts[name] = value.strip() if word else repr(value)
    return where, texts


def _check_names(names: Collection[str], known: tuple[str, ...], where: str, what: str) -> None:
    unknown = [name for name in names if name not in known]
    missing = [name for name in known if name not in names and name not in OPTIONAL]
    if unknown or missing:
        said = (
            f"unknown {', '.join(short(str(x)) for x in unknown)}"
            if unknown
            else f"no {', '.join(missing)}"
        )
        raise RobotError(f"{where}: expected the {what} {', '.join(known)}, got {said}")


def _named(rows: Iterable[Row]) -> list[Row]:
    """Return rows with optional columns filled in; raise RobotError for missing or repeated joint names."""
    found: list[Row] = []
    seen: set[str] = set()
    for where, texts in rows:
        name = texts.get("joint", "")
        if not name or name in seen:
            raise RobotError(f"{where}: joint: expected a name no other row has, got {shown(name)}")
        seen.add(name)
        found.append((f"{where}, joint {name!r}", {**OPTIONAL, **texts}))
    return found
