"""The finding in words."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from axisight.effects import Effect
from axisight.gap.result import Cause, Gap, Where
from axisight.gap.verdict import Conclusion


def headline(
    conclusion: Conclusion,
    gap: Gap,
    causes: Sequence[Cause],
    where: Sequence[Where],
    own: Sequence[Effect] = (),
) -> str:
    """Return the finding in one or two plain sentences; ``own``: effects of the simulator."""
    place = f" The gap lies mainly on axis {where[0].axis}." if where else ""
    if conclusion.withdrawn is not None:
        return f"{conclusion.withdrawn}{place}"
    if conclusion.verdict == "none":
        return (
            f"No unmodelled effect found: the simulator, re-fitted within its tolerances, leaves "
            f"{percent(gap.refitted)} of the torque unexplained; sensor noise alone leaves {percent(gap.floor)}."
        )
    if conclusion.verdict == "unknown":
        return (
            f"The simulator misses something that no known effect explains well: "
            f"{percent(gap.before)} of the torque is unexplained, {percent(gap.floor)} would be noise.{place}"
        )
    shrinks = (
        f"adding {'it' if len(causes) == 1 else 'them'} shrinks the gap on held-out data from "
        f"{percent(gap.before)} to {percent(gap.after)} of the torque (noise alone: {percent(gap.floor)})."
    )
    if conclusion.verdict == "undecidable":
        rivals = " or ".join(conclusion.equivalent[0])
        return f"This data cannot tell {rivals} apart: with the first of them, {shrinks}"
    return f"The simulator lacks {named(causes, own)}: {shrinks}"


def named(causes: Sequence[Cause], own: Sequence[Effect] = ()) -> str:
    """Return causes in words, one phrase an effect: "coulomb friction on axes 1, 2 and 5"."""
    present = {(e.name, e.axis) for e in own if e.acts}
    order = {c.effect: i for i, c in reversed(list(enumerate(causes)))}
    phrases = []
    for effect, group in groupby(
        sorted(causes, key=lambda c: (order[c.effect], c.axis or 0)), key=lambda c: c.effect
    ):
        mine = list(group)
        axes = [str(c.axis) for c in mine if c.axis is not None]
        known = any((c.effect, c.axis) in present for c in mine)
        start = "the machine's values of " if known else ""
        phrases.append(start + _placed(effect, axes))
    return _listed(phrases)


def _placed(effect: str, axes: Sequence[str]) -> str:
    words = effect.replace("_", " ")
    if not axes:
        return f"a {words}"
    return f"{words} on {'axis' if len(axes) == 1 else 'axes'} {_listed(axes)}"


def _listed(items: Sequence[str]) -> str:
    return " and ".join([", ".join(items[:-1]), items[-1]]) if len(items) > 1 else items[0]


def percent(x: float) -> str:
    """Return a share in per cent, three digits."""
    return f"{100 * x:.3g} %"
