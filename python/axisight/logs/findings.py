"""What a look at a log found."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from axisight.errors import LogError

Severity = Literal["ok", "warning", "error"]


@dataclass(frozen=True)
class Finding:
    """One observation: how bad, about which column, and what was expected and seen.

    `name` is the stable name of a fault that has one (`rows_missing`, `samples_frozen`, ...), empty
    otherwise; `axis` counts from 1, None for what concerns all axes or none.
    """

    severity: Severity
    column: str
    message: str
    name: str = ""
    axis: int | None = None


def raise_errors(path: Path, findings: Iterable[Finding]) -> None:
    """Raise one LogError naming the file and its first error; say how many more there are."""
    errors = [finding for finding in findings if finding.severity == "error"]
    if not errors:
        return
    more = f" (and {len(errors) - 1} more, 'axisight check' lists all)" if len(errors) > 1 else ""
    named = f" [{errors[0].name}]" if errors[0].name else ""
    raise LogError(f"{path}: {errors[0].column}: {errors[0].message}{named}{more}")
