"""The file beside a written robot, schema ``axisight.identified/1``."""

from __future__ import annotations

import hashlib
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from axisight.errors import InputError
from axisight.robot import Robot
from axisight.robot_file.identified import Identified

SCHEMA: Literal["axisight.identified/1"] = "axisight.identified/1"


class Strict(BaseModel):
    """Unknown keys and wrong types are refused."""

    model_config = ConfigDict(extra="forbid", strict=True)


class ParameterEntry(Strict):
    """One identified value."""

    name: str
    value: float
    standard_error: float | None


class EffectEntry(Strict):
    """One effect found."""

    name: str
    axis: int | None
    parameters: dict[str, float]


class SourceEntry(Strict):
    """Where the values come from."""

    method: str
    data: dict[str, str]
    settings: dict[str, Any]
    created: str
    axisight_version: str
    notes: str


class Sidecar(Strict):
    """The file."""

    # The name `schema` is taken by pydantic itself; the file says "schema".
    model_config = ConfigDict(extra="forbid", strict=True, populate_by_name=True)
    format: Literal["axisight.identified/1"] = Field(alias="schema")
    robot: str
    robot_sha256: str
    source_sha256: str
    parameters: list[ParameterEntry]
    covariance: list[list[float]] | None
    effects: list[EffectEntry]
    provenance: SourceEntry

    @classmethod
    def of(cls, found: Identified, robot: Robot, text: str, name: str) -> Sidecar:
        """Return the sidecar of a robot that was written as ``text`` under ``name``."""
        given = found.provenance
        created = given.created.isoformat() if given.created else ""
        try:
            return cls(
                schema=SCHEMA,
                robot=name,
                robot_sha256=text_hash(text),
                source_sha256=text_hash(robot.toml),
                parameters=[
                    ParameterEntry(name=n, value=float(v), standard_error=known(e))
                    for n, v, e in zip(
                        found.names, found.values, found.standard_errors, strict=True
                    )
                ],
                covariance=None if found.covariance is None else found.covariance.tolist(),
                effects=[
                    EffectEntry(name=e.name, axis=e.axis, parameters=dict(e.parameters or {}))
                    for e in found.effects
                ],
                provenance=SourceEntry(
                    method=given.method,
                    data=dict(given.data),
                    settings=dict(given.settings),
                    created=created,
                    axisight_version=given.axisight_version,
                    notes=given.notes,
                ),
            )
        except ValidationError as error:
            raise InputError(f"provenance: {first_fault(error)}") from None


def known(number: float) -> float | None:
    """Return a number, None for one that is not finite."""
    return float(number) if np.isfinite(number) else None


def first_fault(error: ValidationError) -> str:
    """Return the first fault with its place."""
    item = error.errors()[0]
    where = ".".join(str(part) for part in item["loc"]) or "file"
    return f"{where}: {item['msg']}"


def text_hash(text: str) -> str:
    """Return the SHA-256 of a text in UTF-8."""
    return hashlib.sha256(text.encode("utf-8")).hexdigest()
