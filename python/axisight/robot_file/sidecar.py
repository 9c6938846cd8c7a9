"""The sidecar, the JSON file beside a written robot: schema ``axisight.identified/2``, or 1 for reading."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from axisight.documents import parse_json, read_text
from axisight.errors import InputError
from axisight.robot import Robot
from axisight.robot_file.identified import Identified

SCHEMA: Literal["axisight.identified/2"] = "axisight.identified/2"


class Strict(BaseModel):
    """A model that refuses unknown keys and wrong types."""

    model_config = ConfigDict(extra="forbid", strict=True)


class ParameterEntry(Strict):
    """One identified value."""

    name: str
    value: float
    standard_error: float | None


class EffectEntry(Strict):
    """One effect of a sidecar of version 1."""

    name: str
    axis: int | None
    parameters: dict[str, float]


class SourceEntry(Strict):
    """The origin of the values, as `Provenance`."""

    method: str
    data: dict[str, str]
    settings: dict[str, Any]
    created: str
    axisight_version: str
    notes: str


class Content(Strict):
    """The content that both versions share."""

    # pydantic itself uses the name `schema`; the key in the file is "schema".
    model_config = ConfigDict(extra="forbid", strict=True, populate_by_name=True)
    format: str = Field(alias="schema")
    robot: str
    robot_sha256: str
    source_sha256: str
    parameters: list[ParameterEntry]
    covariance: list[list[float]] | None
    provenance: SourceEntry


class Earlier(Content):
    """The sidecar of version 1, which holds effects because robot files could not state them."""

    format: Literal["axisight.identified/1"] = Field(alias="schema")
    effects: list[EffectEntry]


class Sidecar(Content):
    """The sidecar of version 2."""

    format: Literal["axisight.identified/2"] = Field(alias="schema")

    @classmethod
    def of(cls, found: Identified, robot: Robot, text: str, name: str) -> Sidecar:
        """Return the sidecar of a robot written as ``text`` to a file ``name``.

        Raises InputError for a provenance that the schema does not allow.
        """
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


def sidecar_path(robot_file: Path | str) -> Path:
    """Return the path of the sidecar of ``robot_file``: ``<stem>.identified.json`` in its folder."""
    path = Path(robot_file)
    return path.with_name(f"{path.stem}.identified.json")


def read_sidecar(path: Path) -> Sidecar | Earlier:
    """Return the content of a sidecar of either version; raise InputError naming file and field."""
    try:
        text = read_text(path)
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"path: expected the sidecar {path}: {error}") from error
    kind = Earlier if _is_earlier(text) else Sidecar
    try:
        return kind.model_validate_json(text)
    except ValidationError as error:
        raise InputError(f"{path}: {first_fault(error)}") from None


def _is_earlier(text: str) -> bool:
    try:
        content = parse_json(text)
    except ValueError:
        return False
    return isinstance(content, dict) and content.get("schema") == "axisight.identified/1"


def known(number: float) -> float | None:
    """Return a number, or None if it is not finite."""
    return float(number) if np.isfinite(number) else None


def first_fault(error: ValidationError) -> str:
    """Return the text of the first fault, with its place."""
    item = error.errors()[0]
    where = ".".join(str(part) for part in item["loc"]) or "file"
    return f"{where}: {item['msg']}"


def text_hash(text: str) -> str:
    """Return the SHA-256 of a text in UTF-8."""
    return hashlib.sha256(text.encode("utf-8")).hexdigest()
