"""The content of a verdict for the explorer: causes, re-fitted values, the gap."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from axisight.arguments import shown, usable_path
from axisight.documents import parse_json, read_text
from axisight.effects import Effect
from axisight.errors import InputError
from axisight.explore.choices import Place, at_place
from axisight.gap.facts.schema import READABLE_SCHEMAS
from axisight.logs.columns import describe_validation

# Verdicts are a few kilobytes.
_LARGEST = 16 * 2**20


class _Open(BaseModel):
    """A part of a verdict; other fields are ignored."""

    model_config = ConfigDict(extra="ignore", frozen=True)


class _Interval(_Open):
    value: float = Field(allow_inf_nan=False)
    ci95: tuple[float | None, float | None]


class _Cause(_Open):
    effect: str
    axis: int | None
    axes: tuple[int, int] | None = None
    probability: float | None
    parameters: dict[str, _Interval]


class _PerAxis(_Open):
    before: list[float | None]
    after: list[float | None]
    floor: list[float | None]


class _Gap(_Open):
    before: float | None
    after: float | None
    floor: float | None
    per_axis: _PerAxis


class _Verdict(_Open):
    verdict: str
    headline: str
    gap: _Gap
    causes: list[_Cause] = Field(max_length=1000)
    refit: dict[str, _Interval]
    checks: list[str] = []
    next_experiment: str | None = None


@dataclass(frozen=True)
class SaidCause:
    """A cause of a verdict; ``intervals``: 95 % interval of each parameter."""

    effect: Effect
    probability: float | None
    intervals: dict[str, tuple[float | None, float | None]]


@dataclass(frozen=True)
class Said:
    """A verdict as the explorer uses it.

    - ``refit``: relative changes [1] of the simulator's parameters.
    - ``before``, ``after``, ``floor``: gap per axis over the validation logs [1], None if a simulation broke
      off.
    - ``document``: the whole verdict.

    Texts come from the file and are not escaped.
    """

    verdict: str
    headline: str
    causes: tuple[SaidCause, ...]
    refit: dict[str, float]
    before: list[float | None]
    after: list[float | None]
    floor: list[float | None]
    checks: tuple[str, ...]
    document: dict[str, Any]


def read_said(path: Path | str) -> Said:
    """Return the content of a verdict file; raises InputError for a file that is no verdict."""
    file = usable_path(path, InputError, "--verdict")
    try:
        if file.stat().st_size > _LARGEST:
            raise InputError(f"{file}: expected a verdict of at most {_LARGEST} bytes")
        document = parse_json(read_text(file))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{file}: cannot be read: {error}") from error
    except InputError:
        raise
    except ValueError as error:
        raise InputError(f"{file}: expected JSON, got: {error}") from error
    return said(document, str(file))


def said(document: Any, source: str = "verdict") -> Said:
    """Return the content of a verdict's document; raises InputError naming ``source`` and field."""
    schema = document.get("schema") if isinstance(document, dict) else None
    if schema not in READABLE_SCHEMAS:
        wanted = " or ".join(READABLE_SCHEMAS)
        raise InputError(f"{source}: schema: expected {wanted}, got {shown(schema)}")
    try:
        read = _Verdict.model_validate(document)
    except ValidationError as error:
        raise InputError(f"{source}: {describe_validation(error, _Verdict)}") from error
    axes = read.gap.per_axis
    return Said(
        read.verdict,
        read.headline,
        tuple(_cause(c) for c in read.causes),
        {name: p.value for name, p in read.refit.items()},
        axes.before,
        axes.after,
        axes.floor,
        tuple(read.checks),
        document,
    )


def _cause(cause: _Cause) -> SaidCause:
    place: Place = cause.axis if cause.axes is None else cause.axes
    effect = at_place(cause.effect, place, {n: p.value for n, p in cause.parameters.items()})
    return SaidCause(effect, cause.probability, {n: p.ci95 for n, p in cause.parameters.items()})
