"""Verdicts of a fleet as a table: one row per cause, one for a case without causes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from axisight.fleet.cases import FleetCase

COLUMNS = {
    "case": "string",
    "machine": "string",
    "verdict": "string",
    "headline": "string",
    "gap_before": "Float64",
    "gap_after": "Float64",
    "gap_floor": "Float64",
    "p_unknown": "Float64",
    "effect": "string",
    "axis": "Int64",
    "probability": "Float64",
    "gap_reduction": "Float64",
    "parameter": "string",
    "value": "Float64",
    "low": "Float64",
    "high": "Float64",
    "unit": "string",
}
"""Columns and their types. ``parameter`` is the first of the cause, with its 95 % interval."""


def fleet_table(
    cases: Sequence[FleetCase], verdicts: Mapping[str, Mapping[str, Any]]
) -> pd.DataFrame:
    """Return the verdicts by case name as a table with the columns `COLUMNS`, in the order of the cases.

    A failed case has the verdict ``error``, and the reason as its headline.
    """
    rows = [row for case in cases for row in _rows(case, verdicts[case.name])]
    table = pd.DataFrame(rows, columns=list(COLUMNS))
    return table.astype(COLUMNS)


def _rows(case: FleetCase, verdict: Mapping[str, Any]) -> list[dict[str, Any]]:
    first = {"case": case.name, "machine": case.machine}
    if "error" in verdict:
        return [{**first, "verdict": "error", "headline": verdict["error"]}]
    gap = verdict["gap"]
    first |= {
        "verdict": verdict["verdict"],
        "headline": verdict["headline"],
        "gap_before": gap["before"],
        "gap_after": gap["after"],
        "gap_floor": gap["floor"],
        "p_unknown": verdict["p_unknown"],
    }
    return [first | _cause(c) for c in verdict["causes"]] or [first]


def _cause(cause: Mapping[str, Any]) -> dict[str, Any]:
    name, parameter = next(iter(cause["parameters"].items()))
    return {
        "effect": cause["effect"],
        "axis": cause["axis"],
        "probability": cause["probability"],
        "gap_reduction": cause["gap_reduction"]["value"],
        "parameter": name,
        "value": parameter["value"],
        "low": parameter["ci95"][0],
        "high": parameter["ci95"][1],
        "unit": parameter["unit"],
    }
