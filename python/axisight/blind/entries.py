"""Entries of a public test: what a method said about each case, as little or as much as it knows."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from axisight.arguments import did_you_mean, shown
from axisight.effects import effect_table
from axisight.errors import InputError
from axisight.gap.facts.schema import READABLE_SCHEMAS
from axisight.logs.columns import describe_validation

ENTRY_SCHEMA = "axisight.entry/1"
"""Format and version of an entry; verdicts as `axisight diagnose --json` writes them are entries too."""
NO_ENTRY = {"error": "no entry"}
"""Stands for a missing entry, which counts as wrong."""

# Verdicts that name no cause.
_WITHOUT_CAUSE = ("none", "unknown")


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
        "equivalent": [],
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
