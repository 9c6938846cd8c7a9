"""Show a log report in the terminal."""

from __future__ import annotations

import re

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from axisight.arguments import counted
from axisight.logs.checking import LogReport

_STYLES = {"error": "bold red", "warning": "yellow", "ok": "green"}
_ORDER = {"error": 0, "warning": 1, "ok": 2}


def render(report: LogReport) -> RenderableType:
    """Return a rich renderable of the report, errors first; print it with a rich Console."""
    rate = "unknown rate" if report.sample_rate_hz is None else f"{report.sample_rate_hz:.6g} Hz"
    shape = "" if report.n_samples is None else f", {report.n_samples} samples"
    axes = "" if report.n_axes is None else f", {counted(report.n_axes, 'axis', 'axes')}"
    table = Table(title=escape(f"{report.path.name}: {rate}{shape}{axes}"), title_justify="left")
    for column in ("severity", "column", "finding"):
        table.add_column(column, overflow="fold")
    for finding in sorted(report.findings, key=lambda item: _ORDER[item.severity]):
        table.add_row(
            Text(finding.severity, style=_STYLES[finding.severity]),
            Text(_folded(finding.column)),
            Text(finding.message),
        )
    counts = {
        severity: sum(finding.severity == severity for finding in report.findings)
        for severity in ("error", "warning")
    }
    verdict = "readable" if report.ok else "not readable as it is"
    summary = (
        f"{verdict}: {counted(counts['error'], 'error')}, {counted(counts['warning'], 'warning')}"
    )
    return Group(table, Text(summary, style=_STYLES["ok" if report.ok else "error"]))


# Characters left for a name beside the finding, in a terminal of 80 columns.
_NAME = 24


def _folded(name: str) -> str:
    """Return a name broken into lines after dots or underscores, to fit the column of names."""
    lines = [""]
    for part in re.findall(r"[^._]*[._]|[^._]+", name):
        if lines[-1] and len(lines[-1]) + len(part) > _NAME:
            lines.append("")
        lines[-1] += part
    return "\n".join(lines)
