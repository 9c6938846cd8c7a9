"""Find the targets of positions, by name or because the positions follow them."""

from __future__ import annotations

import numpy as np

from axisight.logs.guessing.draft import Draft
from axisight.logs.guessing.families import Family, of_quantity
from axisight.logs.guessing.series import Series
from axisight.logs.units import POSITION_UNITS, si_factor

# Slope and correlation of the measured signal on its target from which on it follows the target.
_FOLLOWED = (0.8, 1.25)
_ALIKE = 0.8
# Other quantities that a target may be for.
_OTHERS = ("velocity", "torque", "current", "voltage")


def take_targets(draft: Draft) -> None:
    """Take `position_ref` if the positions follow a target in their own unit.

    A target whose name gives no quantity counts if the positions follow it and no other measured quantity
    does. Open choices are offered to the user as comments in the map.
    """
    named = draft.on_this_side(of_quantity(draft.families, "position", wanted=True))
    bare = draft.on_this_side(
        family
        for family in of_quantity(draft.families, "", wanted=True)
        if family.meaning.unit in (None, *POSITION_UNITS)
    )
    good = [family for family in named if _leads(draft, family, "position")]
    sure = good or [family for family in bare if _is_only_of_positions(draft, family)]
    if len(sure) > 1:
        listed = " or ".join(family.label for family in sure)
        draft.doubts.append(f"position_ref: left out, for it could be {listed}")
        draft.leave(sure, f"a choice that is open: {listed}")
        _offer(draft, sure)
    elif sure:
        _take(draft, sure[0])
    _leave(draft, named, bare)


def _take(draft: Draft, family: Family) -> None:
    why = f"{family.label}: the positions follow it"
    if not family.meaning.quantity:
        why += ", no name says of what it is a target"
        draft.doubts.append(f"position_ref: {why}")
    draft.take("position_ref", _signals(draft, family), _units(draft, family), why)


def _units(draft: Draft, family: Family) -> list[str]:
    """Return the units of targets, one per axis: that of their name, else those of the positions."""
    named = family.meaning.unit if family.meaning.unit in POSITION_UNITS else None
    return [named or unit for _, unit in draft.fields["position"]]


def _leave(draft: Draft, named: list[Family], bare: list[Family]) -> None:
    """Note why targets are not taken, and offer them if the map has neither torques nor targets."""
    taken = {id(series) for series in draft.signals("position_ref")}
    rest = [f for f in (*named, *bare) if not any(id(s) in taken for s in f.signals.values())]
    new = [family for family in rest if family.label not in draft.unused]
    draft.leave(
        [f for f in new if f in named], "a target that positions do not follow in their unit"
    )
    for family in (f for f in new if f in bare):
        also = " and ".join(other for other in _OTHERS if _leads(draft, family, other))
        if not _leads(draft, family, "position"):
            why = "a target, no name says of what, that positions do not follow in their unit"
        elif also:
            why = f"a target, no name says of what: the positions follow it, but so does {also}"
        else:
            why = "a target, no name says of what, beside one of positions"
        draft.leave([family], why)
    if not (taken or draft.targets or "torque" in draft.fields):
        # If torques only lack a scale, a target is worth a line only if the positions follow it.
        _offer(draft, [f for f in new if not draft.torques or _leads(draft, f, "position")])


def _offer(draft: Draft, families: list[Family]) -> None:
    """Offer targets to the user, in the unit of their name, else in that of the positions."""
    for family in families:
        signals = _signals(draft, family)
        draft.targets.append(list(zip(signals, _units(draft, family), strict=True)))


def _signals(draft: Draft, family: Family) -> list[Series]:
    signals = family.of(draft.axes)
    assert signals is not None
    return signals


def _is_only_of_positions(draft: Draft, family: Family) -> bool:
    return _leads(draft, family, "position") and not any(
        _leads(draft, family, other) for other in _OTHERS
    )


def _leads(draft: Draft, target: Family, quantity: str) -> bool:
    """Whether the measured quantity of all axes follows a target in the unit of that quantity."""
    targets = _signals(draft, target)
    if quantity == "position":
        measured_units = [unit for _, unit in draft.fields["position"]]
        pairs = zip(measured_units, _units(draft, target), strict=True)
        factors = [si_factor(own) / si_factor(other) for own, other in pairs]
        return followed(draft.signals("position"), targets, factors)
    measured = [f.of(draft.axes) for f in of_quantity(draft.families, quantity)]
    same = [1.0] * len(targets)
    return any(signals is not None and followed(signals, targets, same) for signals in measured)


def followed(measured: list[Series], targets: list[Series], factors: list[float]) -> bool:
    """Whether every axis with a moving target follows it by about as much, and at least one target moves.

    ``factors`` turn the measured values of each axis into the unit of its target.
    """
    moved = False
    for done_series, told_series, factor in zip(measured, targets, factors, strict=True):
        told = told_series.values - told_series.values.mean()
        done = factor * (done_series.values - done_series.values.mean())
        size, power = float(np.sqrt((told @ told) * (done @ done))), float(told @ told)
        if power == 0.0:
            continue
        moved = True
        shared = float(told @ done)
        within = _FOLLOWED[0] <= shared / power <= _FOLLOWED[1]
        if not within or shared < _ALIKE * size:
            return False
    return moved
