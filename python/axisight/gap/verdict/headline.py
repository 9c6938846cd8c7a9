"""The finding in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from axisight.effects import Effect, article, effect_info, noun
from axisight.gap.facts.axis_names import placed, removed_by_refit, with_joints
from axisight.gap.facts.compared_quantity import gap_of, torque_of
from axisight.gap.facts.result import Cause, Gap, Interval, Where
from axisight.gap.facts.wording import listed, percent
from axisight.gap.verdict.conclusion import Conclusion


def headline(
    conclusion: Conclusion,
    gap: Gap,
    causes: Sequence[Cause],
    where: Sequence[Where],
    own: Sequence[Effect] = (),
    *,
    refit: Mapping[str, Interval] = MappingProxyType({}),
    joints: Sequence[str] = (),
) -> str:
    """Return the finding in one or two plain sentences.

    ``own``: effects of the simulator; ``refit``: what its own parameters changed by; ``joints``: names of
    its axes.
    """
    return with_joints(_said(conclusion, gap, causes, where, own, refit), joints)


def _said(
    conclusion: Conclusion,
    gap: Gap,
    causes: Sequence[Cause],
    where: Sequence[Where],
    own: Sequence[Effect],
    refit: Mapping[str, Interval],
) -> str:
    place = f" The gap lies mainly on axis {where[0].axis}." if where else ""
    if conclusion.withdrawn is not None:
        return f"{conclusion.withdrawn}{place}"
    of = f"of the {torque_of(gap.compared)}"
    moved = within_tolerances(gap)
    if conclusion.verdict == "none" and moved:
        return _refitted(gap, moved, refit)
    if conclusion.verdict == "none":
        return (
            f"No unmodelled effect found: the simulator, re-fitted within its tolerances, leaves "
            f"{percent(gap.refitted)} {of} unexplained; sensor noise alone leaves {percent(gap.floor)}."
        )
    if conclusion.verdict == "unknown" and causes:
        missing = named(causes, own, len(gap.before_per_axis))
        return (
            f"The simulator lacks {missing}, and something else that no known effect explains well: "
            f"the {gap_of(gap.compared)} on held-out data goes from {percent(gap.before)} to "
            f"{percent(gap.after)} {of}, {percent(gap.floor)} would be noise.{place}"
        )
    if conclusion.verdict == "unknown":
        return (
            f"The simulator misses something that no known effect explains well: "
            f"{percent(gap.before)} {of} is unexplained, {percent(gap.floor)} would be noise.{place}"
        )
    return _of_causes(conclusion, gap, causes, own)


def within_tolerances(gap: Gap) -> list[int]:
    """Return the axes (from 1) whose gap as given is clear and gone once re-fitted, the largest first."""
    stages = (gap.before_per_axis, gap.refitted_per_axis, gap.floor_per_axis)
    return removed_by_refit(*(stage.tolist() for stage in stages))


def _refitted(gap: Gap, axes: Sequence[int], refit: Mapping[str, Interval]) -> str:
    """Return the finding where nothing but the simulator's own parameters makes the gap as given."""
    first, *others = axes
    stages = (gap.before_per_axis, gap.refitted_per_axis, gap.floor_per_axis)
    before, left, floor = (percent(float(stage[first - 1])) for stage in stages)
    also = f", and above the floor {_place(others, 0)} too," if others else ""
    changes = clear_changes(refit)
    how = f" ({', '.join(changes)})" if changes else ""
    return (
        f"No unmodelled effect found: the gap as given, {before} of the {torque_of(gap.compared)} on axis "
        f"{first}{also} is within the tolerances of the simulator's own parameters. Re-fitted{how}, they "
        f"leave {left} there; sensor noise alone leaves {floor}."
    )


def _of_causes(
    conclusion: Conclusion, gap: Gap, causes: Sequence[Cause], own: Sequence[Effect]
) -> str:
    missing = named(causes, own, len(gap.before_per_axis))
    # What logs show by themselves, and torques predicted from the motion do not feel.
    felt = [c for c in causes if not c.gap_reduction.low == c.gap_reduction.high == 0.0]
    steps = [c for c in felt if effect_info(c.effect).unrepeatable]
    if causes and not felt:
        return (
            f"The simulator lacks {missing}, which a torque predicted from the measured motion does not feel: "
            f"re-fitted, it leaves {percent(gap.refitted)} of the {torque_of(gap.compared)}, sensor noise "
            f"alone {percent(gap.floor)}."
        )
    if causes and len(steps) == len(causes):
        return (
            f"The simulator lacks {missing}: the steps of the encoders are the noise at which the "
            f"{gap_of(gap.compared)} of {percent(gap.refitted)} of the {torque_of(gap.compared)} stands "
            f"(noise and steps: {percent(gap.floor)})."
        )
    others = [c for c in felt if c not in steps]
    added = "it" if len(others) == 1 else "them"
    if len(others) < len(causes):
        added = named(others, own, len(gap.before_per_axis))
    shrinks = (
        f"adding {added} shrinks the {gap_of(gap.compared)} on held-out data from {percent(gap.before)} to "
        f"{percent(gap.after)} of the {torque_of(gap.compared)} "
        f"(noise{' and steps' if steps else ''} alone: {percent(gap.floor)})."
    )
    if conclusion.verdict == "undecidable":
        rivals = listed([placed(label) for label in conclusion.equivalent[0]])
        return f"This data cannot tell {rivals} apart: with the first of them, {shrinks}"
    return f"The simulator lacks {missing}: {shrinks}"


def in_order(causes: Sequence[Cause]) -> list[Cause]:
    """Return causes by effect, in the order in which effects first come, then by axis."""
    first = {c.effect: i for i, c in reversed(list(enumerate(causes)))}
    return sorted(causes, key=lambda c: (first[c.effect], c.axis or 0))


def named(causes: Sequence[Cause], own: Sequence[Effect] = (), n_axes: int = 0) -> str:
    """Return causes in words, one phrase an effect: "Coulomb friction on axes 1, 2 and 5".

    ``own``: effects that the simulator has already; ``n_axes``: of the robot. Effects that differ
    by an adjective and have the same axes share a phrase: "Coulomb and viscous friction".
    """
    present = {(e.name, e.axis) for e in own if e.acts}
    axes: dict[str, list[int]] = {}
    for c in in_order(causes):
        axes.setdefault(c.effect, []).extend(c.axes or ([] if c.axis is None else [c.axis]))
    phrases: dict[tuple[str, str, tuple[int, ...]], list[str]] = {}
    for effect, mine in axes.items():
        known = any((c.effect, c.axis) in present for c in causes if c.effect == effect)
        start = "the machine's values of" if known else article(effect)
        adjective, _, head = noun(effect).rpartition(" ")
        # Two delays are two things; friction of two kinds is one.
        shared = head if start not in ("a", "an") else noun(effect)
        key = (start, shared, tuple(mine))
        phrases.setdefault(key, []).append(adjective if shared == head else "")
    return listed(
        [
            " ".join(x for x in (start, listed(adjectives), head, _place(where, n_axes)) if x)
            for (start, head, where), adjectives in phrases.items()
        ]
    )


def _place(axes: Sequence[int], n_axes: int) -> str:
    if not axes:
        return ""
    if 1 < len(axes) == n_axes:
        return "on both axes" if n_axes == 2 else f"on all {_COUNTS.get(n_axes, n_axes)} axes"
    return f"on {'axis' if len(axes) == 1 else 'axes'} {listed([str(a) for a in axes])}"


# Numbers of axes in words.
_COUNTS = {3: "three", 4: "four", 5: "five", 6: "six", 7: "seven", 8: "eight"}


# Changes that are told by name, of what may be many.
_TOLD = 4


def clear_changes(refit: Mapping[str, Interval]) -> list[str]:
    """Return re-fitted parameters with what they changed by, the largest first: those whose interval leaves out 0."""
    clear = {k: p for k, p in refit.items() if p.low > 0 or p.high < 0}
    largest = sorted(clear.items(), key=lambda item: -abs(item[1].value))
    told = [f"{k} {100 * p.value:+.2g} %" for k, p in largest[:_TOLD]]
    return told if len(largest) <= _TOLD else [*told, f"and {len(largest) - _TOLD} more"]
