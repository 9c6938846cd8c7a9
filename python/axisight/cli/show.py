"""Show a diagnosis on the screen."""

from __future__ import annotations

from collections.abc import Collection

from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table

from axisight.cli.common import say
from axisight.cli.screen import OUT
from axisight.cli.summary import next_steps, summary
from axisight.gap import Diagnosis, Gap, Interval, Where
from axisight.gap.facts.axis_names import in_words, own_name
from axisight.gap.facts.compared_quantity import (
    FROM_POSITIONS,
    MOTION_HEAD,
    motion_words,
    torque_of,
)
from axisight.gap.facts.result import MotionErrors
from axisight.gap.facts.wording import percent, removed_in_words
from axisight.gap.intake.user_simulator import said
from axisight.gap.verdict.headline import in_order
from axisight.report.account import account
from axisight.report.limits import limit_table

_RANKED = 8
_REFITTED = 10
# A smaller change of a parameter reads as +0 %.
_SEEN = 5e-4
# Most axes in one table of detection limits.
_PLACES = 7


def show_account(found: Diagnosis) -> None:
    """Print how the verdict came about: what was compared, why rivals lost, what each move did."""
    OUT.print("[bold]how the verdict came about[/]")
    for line in account(found.trace).lines():
        say(line)


def show_diagnosis(
    found: Diagnosis, *, verbose: bool = False, given: Collection[str] = (), command: str = ""
) -> None:
    """Print a diagnosis in at most 25 lines, or with ``verbose`` in all tables.

    ``given`` lists the output options in use, which the next steps then do not offer. ``command`` is the
    command that takes the offered options, empty if it is the running one.
    """
    if verbose:
        _show_all(found)
        say(f"next: {' '.join(next_steps(found, given, command))}")
        return
    first, *rest = summary(found, OUT.width, given, command)
    OUT.print(f"[bold]{escape(in_words(found.verdict))}[/]", end="")
    say(first.removeprefix(in_words(found.verdict)))
    for line in rest:
        say(line)


def _show_all(found: Diagnosis) -> None:
    """Print verdict, causes, the gap by axis and pooled, what remains, the re-fit and the ranking."""
    OUT.print(f"[bold]{escape(in_words(found.verdict))}[/]: ", end="")
    say(found.headline)
    if found.causes:
        OUT.print(_causes(found))
    OUT.print(_gaps(found))
    _show_joints(found)
    if found.gap.motion is not None:
        OUT.print(_motion(found.gap.motion))
    _show_comparison(found)
    _show_places(found)
    for finding in found.findings:
        say(f"finding: {finding}")
    changed = {k: p for k, p in found.refit.items() if abs(p.value) >= _SEEN}
    if changed:
        OUT.print(_refitted(changed))
    if found.ranking:
        OUT.print(_ranking(found))
    # If nothing was found, the user needs the smallest effects that would have been found.
    if found.verdict == "none" and found.detection_limits:
        for table in _limits(found):
            OUT.print(table)


def _show_joints(found: Diagnosis) -> None:
    """Print the joint of each axis, if joints have names of their own."""
    numbers = range(1, len(found.joints) + 1)
    named = [f"{i} {name}" for i in numbers if (name := own_name(i, found.joints))]
    if named:
        say(f"axes: {', '.join(named)}")


def _show_comparison(found: Diagnosis) -> None:
    """Print how logs and simulator were compared, if that is not the default."""
    cutoff_hz = found.provenance.get("cutoff_hz")
    if cutoff_hz is not None:
        say(f"compared: by inverse dynamics, below {cutoff_hz:.3g} Hz (--cutoff-hz)")
    if found.gap.compared == "positions":
        say(f"compared: {FROM_POSITIONS}")
    if found.simulator is not None:
        say(said(found.simulator, found.gap.compared))


def _show_places(found: Diagnosis) -> None:
    for place in found.where:
        say(f"where: {_place(place)}")
    left = found.remainder
    if left is None or not left.where:
        return
    varies = "" if left.varies_with is None else f"; it varies with {left.varies_with}"
    say(f"remains above noise: {_percent(left.gap)} of the {torque_of(found.gap.compared)}{varies}")
    for place in left.where:
        say(f"remains: {_place(place)}")
    if left.modelled is not None:
        for line in left.modelled.lines():
            say(f"remainder: {line}")


def _place(where: Where) -> str:
    return f"axis {where.axis}, {where.evidence}"


def _percent(x: float) -> str:
    # Short, because a table of 80 characters has five such columns.
    return percent(x).replace("more than", ">").replace("no share", "-")


def _causes(found: Diagnosis) -> Table:
    # Narrow enough for a terminal of 80 columns; long names fold, because cut names are useless.
    table = Table(box=SIMPLE_HEAD)
    for name in ("cause and its values", "value", "95 % interval", "probability"):
        table.add_column(name, overflow="fold")
    for cause in in_order(found.causes):
        table.add_row(escape(cause.label), "", "", f"{cause.probability:.3f}")
        for name, p in cause.parameters.items():
            unit = cause.units.get(name, "1")
            value = f"{p.value:.4g}" if unit == "1" else f"{p.value:.4g} {unit}"
            table.add_row(f"  {escape(name)}", escape(value), f"{p.low:.4g} to {p.high:.4g}", "")
    return table


def _gaps(found: Diagnosis) -> Table:
    table = Table("axis", "verdict", "gap before", "re-fitted", "after", "floor")
    gap = found.gap
    for i, verdict, row in found.axis_rows():
        table.add_row(str(i), verdict, *(_percent(x) for x in row))
    table.add_row("all", in_words(found.verdict), *_stages(gap))
    # rich wraps the caption to the width of the table, so each sentence gets its own line.
    table.caption = f"axis: rms error / standard deviation of the {torque_of(gap.compared)}; all: rms of the axes"
    if gap.pooled is not None:
        p = gap.pooled
        pooled = (p.before, p.refitted, p.after, p.floor)
        table.add_row("pooled", "", *(_percent(x) for x in pooled))
        squared = f"{torque_of(gap.compared)}s"
        table.caption += f"\npooled: sqrt(sum of squared errors / sum of squared {squared})"
    return table


def _motion(errors: MotionErrors) -> Table:
    table = Table(box=SIMPLE_HEAD)
    for name in ("axis", *MOTION_HEAD):
        table.add_column(name, overflow="fold")
    for i, row in enumerate(errors.rows(), start=1):
        table.add_row(str(i), *(f"{x:.3g}" for x in row))
    table.caption = motion_words(errors.velocity_from)
    return table


def _stages(gap: Gap) -> list[str]:
    return [_percent(x) for x in (gap.before, gap.refitted, gap.after, gap.floor)]


def _refitted(refit: dict[str, Interval]) -> Table:
    table = Table("parameter", "change", "95 % interval", title="re-fitted within tolerances")
    largest = sorted(refit.items(), key=lambda item: -abs(item[1].value))
    for name, p in largest[:_REFITTED]:
        interval = f"{100 * p.low:+.2g} to {100 * p.high:+.2g} %"
        table.add_row(escape(name), f"{100 * p.value:+.2g} %", interval)
    if len(largest) > _REFITTED:
        table.caption = f"and {len(largest) - _REFITTED} more that changed less"
    return table


def _limits(found: Diagnosis) -> list[Table]:
    """Return the detection limits in tables of at most seven axes, so that 80 columns hold whole numbers."""
    limits = limit_table(found.detection_limits, len(found.gap.before_per_axis))
    out = []
    for first in range(0, len(limits.columns), _PLACES):
        shown = slice(first, first + _PLACES)
        table = Table(
            title=None
            if first
            else "detection limits: smallest effect that shows (95 % probability)",
            box=SIMPLE_HEAD,
            padding=0,
        )
        table.add_column("effect")
        for name in limits.columns[shown]:
            table.add_column(name, no_wrap=True)
        for effect, unit, *values in limits.rows:
            title = f"{effect} [{unit}]" if unit else effect
            table.add_row(escape(title), *(escape(cell) for cell in values[shown]))
        out.append(table)
    out[-1].caption = limits.note or None
    return out


def _ranking(found: Diagnosis) -> Table:
    table = Table(title="candidates where there was most to explain")
    for name in ("effect", "axis", "probability", "held-out score", "significance"):
        table.add_column(name, overflow="fold")
    for c in found.ranking[:_RANKED]:
        axis = "arm" if c.axis is None else str(c.axis)
        table.add_row(
            escape(c.effect),
            axis,
            f"{c.probability:.3f}",
            removed_in_words(c.score),
            f"{c.significance:.1f}",
        )
    return table
