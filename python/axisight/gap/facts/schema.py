"""The JSON Schema of a verdict."""

from __future__ import annotations

import json
from importlib import resources
from typing import Any


def verdict_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) that every ``axisight.verdict/1`` written here obeys.

    It is strict: keys that it does not describe are refused. Readers of other versions' verdicts
    should ignore what they do not know instead.
    """
    text = (resources.files("axisight.gap.facts") / "verdict.schema.json").read_text("utf-8")
    schema: dict[str, Any] = json.loads(text)
    return schema
