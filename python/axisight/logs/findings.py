"""Findings about a log, and the error made of them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from axisight.errors import LogError

Severity = Literal["ok", "warning", "error"]


@dataclass(frozen=True)
class Finding:
    """One observation about a log: severity, column, and a message with what was expected and what came.

    `name` is the stable name of the fault (`rows_missing`, `samples_frozen`, ...), empty if it has none.
    `axis` counts from 1; it is None if the finding does not concern a single axis.
    """

    severity: Severity
    column: str
    message: str
    name: str = ""
    axis: int | None = None


def raise_errors(path: Path, findings: Iterable[Finding]) -> None:
    """Raise LogError with the file, the first error and the number of further ones, if there is any error."""
    errors = [finding for finding in findings if finding.severity == "error"]
    if not errors:
        return
    more = f" (and {len(errors) - 1} more, 'axisight check' lists all)" if len(errors) > 1 else ""
    named = f" [{errors[0].name}]" if errors[0].name else ""
    raise LogError(f"{path}: {errors[0].column}: {errors[0].message}{named}{more}")
