"""Entries of a public test: what a method said about each case, as little or as much as it knows."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from axisight.arguments import did_you_mean, shown
from axisight.documents import parse_json, read_text
from axisight.effects import effect_table
from axisight.errors import InputError
from axisight.gap.facts.schema import READABLE_SCHEMAS
from axisight.logs.columns import describe_validation

ENTRY_SCHEMA = "axisight.entry/1"
"""Format and version of an entry; verdicts as `axisight diagnose --json` writes them are entries too."""
NO_ENTRY = {"error": "no entry"}
"""Stands for a missing entry, which counts as wrong."""

COUNTED_ALTERNATIVE = 0.05
"""Alternatives of at least this probability count as allowed."""

# Verdicts that name no cause.
_WITHOUT_CAUSE = ("none", "unknown")


def entries_in(path: Path) -> dict[str, tuple[str, str]]:
    """Return the text of each entry and where it stands, by case, of a folder of JSON files or of a file of lines.

    A folder has one ``CASE.json`` each; a ``.jsonl`` file has one line each, with the key ``case``. Raises InputError
    for a path without entries, a line that is no object or names no case, and a case that stands twice.
    """
    found: dict[str, tuple[str, str]] = {}
    if path.is_dir():
        found = {
            one.stem: (read_stated(one, "a verdict"), str(one))
            for one in sorted(path.glob("*.json"))
        }
    elif path.suffix == ".jsonl" and path.is_file():
        for number, line in enumerate(read_stated(path, "entries").splitlines(), 1):
            where = f"{path}, line {number}"
            case = _case_of(line, where)
            if case in found:
                raise InputError(f"{where}: case: expected {case!r} once, got it twice")
            found[case] = (line, where)
    if not found:
        raise InputError(
            f"{path}: expected verdicts in a folder (*.json) or in one file of lines (*.jsonl), got none"
        )
    return found


def read_stated(path: Path, what: str) -> str:
    """Return the text of a file; raise InputError, which says ``what`` it holds, if it cannot be read."""
    try:
        return read_text(path)
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: expected {what}: {error}") from error


def _case_of(line: str, where: str) -> str:
    try:
        case = parse_json(line)["case"]
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"{where}: expected an entry with the key 'case', got {shown(line[:60])}"
        ) from error
    if not isinstance(case, str):
        raise InputError(f"{where}: case: expected the name of a case, got {shown(case)}")
    return case


def entry_line(case: str, document: dict[str, Any]) -> str:
    """Return an entry or a verdict as one line of JSON with the keys that are scored, for a file of entries."""
    if document.get("schema") in READABLE_SCHEMAS:
        document = {**document, **_in_words_of_an_entry(document)}
    try:
        said = _Entry.model_validate(document)
    except ValidationError as error:
        raise InputError(f"{case}: {describe_validation(error, _Entry)}") from error
    kept = said.model_dump(mode="json", exclude_defaults=True)
    return json.dumps({"schema": ENTRY_SCHEMA, "case": case, **kept}) + "\n"


def _in_words_of_an_entry(verdict: dict[str, Any]) -> dict[str, Any]:
    """Return the keys that a verdict has in another form: regions, of which only the first counts, and the time."""
    return {
        "where": [one["axis"] for one in verdict["where"][:1]],
        "alternatives": [
            one for one in verdict["alternatives"] if one["probability"] >= COUNTED_ALTERNATIVE
        ],
        "seconds": verdict["provenance"].get("seconds"),
    }


class _Value(BaseModel):
    model_config = ConfigDict(extra="ignore", allow_inf_nan=False)
    value: float
    ci95: tuple[float | None, float | None] = (None, None)


class _Named(BaseModel):
    model_config = ConfigDict(extra="ignore", allow_inf_nan=False)
    effect: str
    axis: int | None = Field(default=None, ge=1)
    probability: float | None = Field(default=None, ge=0, le=1)


class _Cause(_Named):
    parameters: dict[str, _Value] = Field(default_factory=dict)


class _Entry(BaseModel):
    model_config = ConfigDict(extra="ignore", allow_inf_nan=False)
    verdict: Literal["none", "explained", "explained_in_part", "undecidable", "unknown"]
    causes: list[_Cause] = Field(default_factory=list)
    alternatives: list[_Named] = Field(default_factory=list)
    equivalent: list[list[str]] = Field(default_factory=list)
    where: list[int] = Field(default_factory=list)
    seconds: float | None = Field(default=None, ge=0)


def as_verdict(document: dict[str, Any], where: str) -> dict[str, Any]:
    """Return the part of a verdict that is scored, of an entry or a verdict.

    Probabilities that an entry does not state become NaN. Raises InputError, naming ``where`` and the field, for
    another schema, an unknown effect, and a verdict that does not agree with its causes.
    """
    schema = document.get("schema")
    if "error" in document or schema in READABLE_SCHEMAS:
        return document
    if schema != ENTRY_SCHEMA:
        wanted = ", ".join((ENTRY_SCHEMA, *READABLE_SCHEMAS))
        raise InputError(f"{where}: expected one of the schemas {wanted}, got {shown(schema)}")
    try:
        entry = _Entry.model_validate(document)
    except ValidationError as error:
        raise InputError(f"{where}: {describe_validation(error, _Entry)}") from error
    _check(entry, where)
    return {
        "schema": ENTRY_SCHEMA,
        "verdict": entry.verdict,
        "causes": [
            {**_named(cause), "parameters": _values(cause), "gap_reduction": {"value": _UNSAID}}
            for cause in entry.causes
        ],
        "alternatives": [_named(one) for one in entry.alternatives],
        "equivalent": entry.equivalent,
        "where": [{"axis": axis} for axis in entry.where],
        "detection_limits": [],
        "provenance": {"seconds": entry.seconds},
    }


_UNSAID = float("nan")


def _check(entry: _Entry, where: str) -> None:
    for one in (*entry.causes, *entry.alternatives):
        if one.effect not in effect_table():
            near = did_you_mean(one.effect, effect_table())
            raise InputError(
                f"{where}: effect: expected an effect of 'axisight effects', got {shown(one.effect)}{near}"
            )
    if entry.verdict in _WITHOUT_CAUSE and entry.causes:
        raise InputError(f"{where}: causes: expected none beside {entry.verdict!r}, got some")
    if entry.verdict not in _WITHOUT_CAUSE and not entry.causes:
        raise InputError(
            f"{where}: causes: expected at least one beside {entry.verdict!r}, got none"
        )


def _named(one: _Named) -> dict[str, Any]:
    said = _UNSAID if one.probability is None else one.probability
    return {"effect": one.effect, "axis": one.axis, "probability": said}


def _values(cause: _Cause) -> dict[str, Any]:
    return {name: {"value": v.value, "ci95": list(v.ci95)} for name, v in cause.parameters.items()}
