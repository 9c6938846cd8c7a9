"""Summarize a diagnosis in at most 25 lines: verdict, causes, gap by axis, main findings, next step."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

from axisight.gap import Diagnosis, Finding
from axisight.gap.facts.axis_names import axis_label, in_words
from axisight.gap.facts.compared_quantity import FROM_POSITIONS, torque_of
from axisight.gap.facts.faults import by_kind
from axisight.gap.facts.result import Cause
from axisight.gap.facts.wording import LARGEST, percent
from axisight.gap.intake.user_simulator import said
from axisight.gap.verdict.headline import in_order

MOST_LINES = 25
"""Most lines of a summary, including the lines that name the files written after it."""
# Longer lines are hard to read; on narrower screens tables would not fit.
_WIDEST, _NARROWEST = 100, 60
# Findings that rarely change what to do, so they come last.
_MINOR = ("parameter_at_edge", "effect_within_scatter", "position_noise_large")
_GROUPS = 2


@dataclass(frozen=True)
class _Detail:
    """The most rows of each part of a summary; ``blanks``: whether empty lines separate the sections."""

    parameters: int = 99
    places: int = 2
    findings: int = 3
    axes: int = 99
    causes: int = 99
    steps: int = 99
    blanks: bool = True


# Tried in turn until the summary is short enough, so the least important rows go first.
_DETAILS = (
    _Detail(),
    _Detail(blanks=False),
    _Detail(blanks=False, parameters=1),
    _Detail(blanks=False, parameters=1, places=1, findings=1),
    _Detail(blanks=False, parameters=1, places=0, findings=0, steps=1),
    *(
        _Detail(blanks=False, parameters=1, places=0, findings=0, steps=1, axes=6, causes=n)
        for n in range(15, 2, -1)
    ),
)


def summary(
    found: Diagnosis,
    width: int,
    given: Collection[str] = (),
    command: str = "",
    steps: Sequence[str] | None = None,
) -> list[str]:
    """Return the lines of a diagnosis for a screen of ``width`` columns, the verdict first.

    ``given`` lists the output options in use. Each of them prints a line later, so the summary is shorter.
    ``command`` is the command that takes the offered options, empty if it is the running one. ``steps`` replaces
    the next steps of the command line.
    """
    if steps is None:
        steps = next_steps(found, given, command)
    width = min(max(width, _NARROWEST), _WIDEST)
    most = MOST_LINES - len(given)
    lines: list[str] = []
    for detail in _DETAILS:
        sections = [part(found, width, detail) for part in _SECTIONS]
        sections.append(_next(steps, width, detail))
        between = [""] if detail.blanks else []
        lines = []
        for section in filter(None, sections):
            lines += [*(between if lines else []), *section]
        if len(lines) <= most:
            break
    return lines


def next_steps(found: Diagnosis, given: Collection[str] = (), command: str = "") -> list[str]:
    """Return the next steps after a diagnosis as sentences, without the options that were ``given``.

    Each offered option follows the text ``command``, the command that takes it; "" is the running command.
    """
    out = [] if found.next_experiment is None else [found.next_experiment]
    offers = {
        "--next-experiment": f"--next-experiment FOLDER designs {motions(found)}.",
        "--write-model": f"--write-model FILE writes the simulator with {_them(found)}.",
        "--report": "--report report.html draws where the gap lies.",
    }
    if not can_be_designed(found):
        del offers["--next-experiment"]
    if found.verdict == "undecidable" or not found.causes:
        del offers["--write-model"]
    if found.verdict == "none":
        limits = ["--verbose lists the smallest effects that these logs would show."]
        return [*out, "Nothing to correct.", *(limits if found.detection_limits else [])]
    told = [text for option, text in offers.items() if option not in given]
    if found.verdict in ("unknown", "undecidable", "explained_in_part"):
        told.append("--explain says what was tried.")
    out += [f"{command} {text}".strip() for text in told]
    if found.verdict == "explained" and "--write-model" in given:
        out.append("Diagnose again with the model that was written: the verdict should be none.")
    return out


def can_be_designed(found: Diagnosis) -> bool:
    """Whether an experiment after this verdict would tell more."""
    return found.verdict in ("undecidable", "unknown", "explained_in_part")


def motions(found: Diagnosis) -> str:
    """Return which motions an experiment after this verdict has."""
    if found.verdict == "undecidable":
        return "the motions that tell the causes apart"
    return "a record that shows more: repeats, slow motion, a known load"


def _them(found: Diagnosis) -> str:
    return "this cause" if len(found.causes) == 1 else "these causes"


def _verdict(found: Diagnosis, width: int, _detail: _Detail) -> list[str]:
    return _folded(f"{in_words(found.verdict)}: {found.headline}", width, indent="")


def _causes(found: Diagnosis, width: int, detail: _Detail) -> list[str]:
    causes = in_order(found.causes)
    rows: list[tuple[str, ...]] = [("cause", "parameter", "value", "95 % interval", "probability")]
    for cause in causes[: detail.causes]:
        rows += _cause(cause, detail.parameters)
    out = _columns(rows, width) if causes else []
    if len(causes) > detail.causes:
        out.append(f"and {len(causes) - detail.causes} more causes: --verbose lists all")
    for group in found.equivalent[:_GROUPS]:
        out.append(_cut(f"these logs cannot tell apart: {', '.join(group)}", width))
    return out


def _cause(cause: Cause, most: int) -> list[tuple[str, ...]]:
    """Return a row for each of the first ``most`` parameters of a cause; the first row has its name."""
    rows = []
    for name, p in list(cause.parameters.items())[:most]:
        unit = cause.units.get(name, "1")
        value = f"{p.value:.4g}" if unit == "1" else f"{p.value:.4g} {unit}"
        rows.append(["", name, value, f"{p.low:.4g} to {p.high:.4g}", ""])
    rows = rows or [["", "", "", "", ""]]
    rows[0][0], rows[0][-1] = cause.label, f"{cause.probability:.3f}"
    return [tuple(row) for row in rows]


def _gaps(found: Diagnosis, width: int, detail: _Detail) -> list[str]:
    gap, rows = found.gap, found.axis_rows()
    head = f"gap, % of the {torque_of(gap.compared)}"
    table: list[tuple[str, ...]] = [(head, "before", "re-fitted", "after", "floor", "verdict")]
    shown = rows
    if len(rows) > detail.axes:
        largest = sorted(rows, key=lambda row: _excess(*row[1:]), reverse=True)[: detail.axes]
        shown = sorted(largest)
    for i, verdict, stages in shown:
        table.append((f"axis {axis_label(i, found.joints)}", *map(_share, stages), verdict))
    if len(rows) > 1:
        whole = (gap.before, gap.refitted, gap.after, gap.floor)
        table.append(("all axes", *map(_share, whole), in_words(found.verdict)))
    out = _columns(table, width, right=range(1, 5))
    if len(shown) < len(rows):
        out.append(f"and {len(rows) - len(shown)} more axes, with less of a gap: --verbose")
    return out + [line for text in _basis(found) for line in _folded(text, width)]


def _excess(verdict: str, stages: Sequence[float]) -> float:
    """Return the squared gap of an axis above its floor; infinite, so that it comes first, where a run broke off.

    An axis that is not judged comes last.
    """
    if verdict == in_words("not_judged"):
        return -math.inf
    before, _, _, floor = stages
    return before**2 - floor**2 if math.isfinite(before) else math.inf


def _basis(found: Diagnosis) -> list[str]:
    """Return how logs and simulator were compared, if that is not the default."""
    out = []
    cutoff_hz = found.provenance.get("cutoff_hz")
    if cutoff_hz is not None:
        out.append(f"compared by inverse dynamics, below {cutoff_hz:.3g} Hz (--cutoff-hz)")
    if found.gap.compared == "positions":
        out.append(f"compared: {FROM_POSITIONS}")
    if found.simulator is not None:
        out.append(said(found.simulator, found.gap.compared))
    return out


def _places(found: Diagnosis, width: int, detail: _Detail) -> list[str]:
    """Return where the rest of the gap lies, if something stays unknown."""
    left = found.remainder
    if found.verdict not in ("unknown", "explained_in_part") or left is None:
        return []
    out = [
        _cut(f"remains on axis {place.axis}: {place.evidence}", width)
        for place in left.where[: detail.places]
    ]
    if out and left.varies_with is not None:
        out[0] = _cut(f"{out[0]}; it varies with {left.varies_with}", width)
    return out


def _modelled(found: Diagnosis, width: int, detail: _Detail) -> list[str]:
    """Return the terms of the modelled remainder, those with the largest gain first."""
    left = found.remainder
    if left is None or left.modelled is None:
        return []
    terms = sorted(left.modelled.model.terms, key=lambda t: -t.gain)
    shown = terms[: 2 + detail.places]
    lines = [
        _cut(f"remainder on axis {t.axis}: {t.words} ({100 * t.gain:.0f} %)", width) for t in shown
    ]
    more = len(terms) - len(shown)
    return [*lines, *([f"and {more} more terms: --verbose"] if more else [])]


def _findings(found: Diagnosis, width: int, detail: _Detail) -> list[str]:
    findings = sorted(found.findings, key=_is_minor)
    count = "1 finding" if len(findings) == 1 else f"{len(findings)} findings"
    left = [count] if findings and not detail.findings else []
    if any(len(cause.parameters) > detail.parameters for cause in found.causes):
        left.append("further parameters")
    if not findings or not detail.findings:
        return [f"not shown: {' and '.join(left)} (--verbose)"] if left else []
    kinds = by_kind(findings)
    whole = [_of_kind(same) for same in kinds[: detail.findings]]
    out = [_cut(line, width) for line in whole]
    more = sum(map(len, kinds[detail.findings :]))
    if more:
        out.append(f"and {more} more: --verbose shows all findings in full")
    elif out != whole:
        out.append("--verbose shows findings in full")
    return out


def _of_kind(same: Sequence[Finding]) -> str:
    """Return the first finding of a kind, with the number of all where there are more."""
    return f"finding: {same[0]}" if len(same) == 1 else f"{len(same)} findings, first: {same[0]}"


def _is_minor(finding: Finding) -> bool:
    return finding.name in _MINOR or finding.name.startswith("quantized_")


_SECTIONS: tuple[Callable[[Diagnosis, int, _Detail], list[str]], ...] = (
    _verdict,
    _causes,
    _gaps,
    _places,
    _modelled,
    _findings,
)


def _next(steps: Sequence[str], width: int, detail: _Detail) -> list[str]:
    """Return the next steps, one per line if there is room."""
    steps = steps[: detail.steps]
    if not detail.blanks:
        return _folded(f"next: {' '.join(steps)}", width)
    out = []
    for i, step in enumerate(steps):
        out += _folded(f"{'      ' if i else 'next: '}{step}", width, "      ")
    return out


def _share(x: float) -> str:
    """Return a share [1] in percent with three digits, without the percent sign."""
    if not math.isfinite(x):
        return "-"
    return f">{100 * LARGEST:.0f}" if x > LARGEST else percent(x).removesuffix(" %")


def _folded(text: str, width: int, indent: str = "  ") -> list[str]:
    return textwrap.wrap(text, width, subsequent_indent=indent)


def _cut(text: str, width: int) -> str:
    """Return a text on one line, cut between words to ``width`` characters."""
    return textwrap.shorten(text, width, placeholder=" ...")


def _columns(rows: Sequence[Sequence[str]], width: int, right: Collection[int] = ()) -> list[str]:
    """Return rows as aligned columns; if they are too wide, the first cell gets a line of its own."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    alone = sum(widths) + 2 * len(widths) - 2 > width
    out = []
    for row in rows:
        cells = [
            cell.rjust(size) if i in right else cell.ljust(size)
            for i, (cell, size) in enumerate(zip(row, widths, strict=True))
        ]
        if alone:
            out += [row[0]] if row[0] else []
            rest = "  ".join(cells[1:]).rstrip()
            out += [f"  {rest}"] if rest else []
        else:
            out.append("  ".join(cells).rstrip())
    return out
