"""The JSON Schema of a verdict."""

from __future__ import annotations

import json
from importlib import resources
from typing import Any

VERDICT_SCHEMA = "axisight.verdict/2"
"""Format and version of the verdicts that are written."""
READABLE_SCHEMAS = ("axisight.verdict/1", VERDICT_SCHEMA)
"""Formats that are read: version 2 added the verdict *explained in part*, and changed nothing else."""


def verdict_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) that every ``axisight.verdict/2`` written here obeys.

    It is strict: keys that it does not describe are refused. Readers of other versions' verdicts
    should ignore what they do not know instead.
    """
    text = (resources.files("axisight.gap.facts") / "verdict.schema.json").read_text("utf-8")
    schema: dict[str, Any] = json.loads(text)
    return schema
