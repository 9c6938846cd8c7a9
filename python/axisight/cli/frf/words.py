"""Print a response from logs: choices, findings, quality by band, advice."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rich.table import Table

from axisight.arguments import counted
from axisight.cli.common import say
from axisight.cli.screen import OUT
from axisight.records import FindingKind, RecordFinding
from axisight.responses import OPERATING_POINT, LogResponse

# Findings that the lines about period, lines and periods already state.
_STATED = (FindingKind.PERIOD, FindingKind.LINES)

# What findings advise -> the option that does it.
_OPTIONS = {
    "use the local polynomial method": "take --estimator local-polynomial",
    "give lines": "give --design REFERENCES",
}


def show(found: LogResponse) -> None:
    """Print what was chosen, what was seen, noise and distortion by band, and what to do next."""
    for text in found.choices:
        say(text)
    say(_operating_point(found))
    for text in _findings(found.findings):
        say(text)
    OUT.print(_table(found))
    for text in found.account.sentences:
        say(text)


def _findings(findings: Sequence[RecordFinding]) -> list[str]:
    """Return the worst finding of each kind, serious ones as warnings, with the number of the others."""
    out = []
    groups: dict[tuple[FindingKind, bool], list[RecordFinding]] = {}
    for finding in findings:
        if finding.serious or finding.kind not in _STATED:
            groups.setdefault((finding.kind, finding.serious), []).append(finding)
    for (_, serious), group in groups.items():
        worst = max(group, key=lambda one: -math.inf if math.isnan(one.value) else abs(one.value))
        others = len(group) - 1
        more = f" ({counted(others, 'more finding')} of this kind)" if others else ""
        said = str(worst)
        for words, option in _OPTIONS.items():
            said = said.replace(words, option)
        out.append(f"{'warning: ' if serious else ''}{said}{more}")
    return out


def _operating_point(found: LogResponse) -> str:
    angles = found.response.attrs.get(OPERATING_POINT)
    if angles is None:
        return (
            "operating point: unknown, as the logs have motor positions only; --robot ROBOT (its gear ratios) "
            "or --at ANGLE,... states it for 'identify elastic'"
        )
    return f"operating point: {', '.join(f'{angle:.4f}' for angle in angles)} rad"


def _table(found: LogResponse) -> Table:
    table = Table()
    titles = ("band [Hz]", "lines", "noise", "distortion", "off-diag.", "coherence", "weak")
    for title in titles:
        left = title == titles[0]
        table.add_column(title, justify="left" if left else "right", no_wrap=True)
    for row in found.account.bands.to_dict("records"):
        table.add_row(
            f"{row['low_hz']:.3g} .. {row['high_hz']:.3g}",
            f"{row['lines']:.0f}",
            *(_percent(row[name]) for name in ("noise", "distortion", "off_diagonal")),
            "-" if math.isnan(row["coherence"]) else f"{row['coherence']:.4f}",
            f"{row['weak']:.0f}",
        )
    return table


def _percent(share: float) -> str:
    if math.isnan(share):
        return "-"
    return f"{100 * share:.0f} %" if share >= 0.995 else f"{100 * share:.2g} %"
