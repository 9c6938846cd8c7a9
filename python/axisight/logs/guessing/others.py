"""Find velocities, their references, torques and temperatures, by name and by the motion of the positions."""

from __future__ import annotations

from axisight.logs.guessing.draft import Draft
from axisight.logs.guessing.evidence import (
    UNITS_APART,
    agreement,
    follows_acceleration,
    largest,
)
from axisight.logs.guessing.families import Family, of_quantity
from axisight.logs.guessing.series import Series
from axisight.logs.units import PRISMATIC_UNITS, si_factor

_TURNING = ("rad/s", "deg/s", "rpm", "rev/s")
_SLIDING = ("m/s", "mm/s")
# A column without a meaning is mentioned as a torque from this correlation with the acceleration on.
_LIKELY = 0.5


def take_velocity(draft: Draft, field: str) -> None:
    """Take `velocity` or `velocity_ref` if the numbers agree with the name; otherwise note the reason."""
    families = of_quantity(draft.families, "velocity", wanted=field == "velocity_ref")
    good: list[tuple[Family, list[Series], list[str], str]] = []
    for family in draft.on_this_side(families):
        signals = family.of(draft.axes)
        assert signals is not None
        found = _velocity_units(draft, family, signals)
        if isinstance(found, str):
            draft.unused[family.label] = found
            draft.doubts.append(f"{field}: {family.label} is left out: {found}")
        else:
            good.append((family, signals, *found))
    if len(good) > 1:
        listed = " or ".join(one[0].label for one in good)
        draft.doubts.append(f"{field}: left out, for it could be {listed}")
        draft.leave([one[0] for one in good], f"a choice that is open: {listed}")
    elif good:
        family, signals, units, why = good[0]
        draft.take(field, signals, units, f"{family.label}: {why}")


def _velocity_units(
    draft: Draft, family: Family, signals: list[Series]
) -> tuple[list[str], str] | str:
    """Return the unit of every axis and the reason, or why these cannot be velocities of the positions."""
    seen = agreement(draft.signals("position"), signals, draft.sample_time_s)
    named = family.meaning.unit
    units = [unit for _, unit in draft.fields["position"]]
    if seen.axes == 0:
        if named is None:
            return "no unit in its name, and no motion to tell it by"
        return [named] * len(units), f"the name says {named} (no motion to compare)"
    if not seen.clear:
        return f"does not follow the derivative of the position (correlation {seen.alike:.2f})"
    # Revolute and prismatic axes have different factors, so with both kinds only SI units can be recognized.
    both = len({unit in PRISMATIC_UNITS for unit in units}) > 1
    position = units[0]
    possible = _SLIDING if position in PRISMATIC_UNITS else _TURNING
    fits = [u for u in possible if seen.is_factor(si_factor(position) / si_factor(u), UNITS_APART)]
    said = f"{seen.ratio:.4g} times the derivative of the position (correlation {seen.alike:.3f})"
    if not fits:
        return f"{said}, which no unit explains: gear ratio, or another sign?"
    if named is not None and named != fits[0]:
        return f"{said}, which is {fits[0]}, where the name says {named}"
    si = ["m/s" if unit in PRISMATIC_UNITS else "rad/s" for unit in units]
    return si if both else [fits[0]] * len(units), f"{fits[0]}, for it is {said}"


def take_torque(draft: Draft) -> None:
    """Take the torques; leave currents and voltages open, as only the user knows the Nm per A or V."""
    for quantity, wanted in (
        ("torque", False), ("torque", True), ("current", False), ("current", True), ("voltage", False),
    ):  # fmt: skip
        families = draft.on_this_side(of_quantity(draft.families, quantity, wanted=wanted))
        if not families:
            continue
        if len(families) > 1:
            listed = " or ".join(f.label for f in families)
            draft.doubts.append(f"torque: left out, for it could be {listed}")
            draft.leave(families, f"a choice that is open: {listed}")
            draft.why["torque"] = f"open: {listed}"
            for family in families:
                _leave_open(draft, family, quantity)
            return
        family = families[0]
        if quantity == "torque" and family.meaning.unit in (None, "Nm", "N"):
            _take(draft, family, wanted=wanted)
        else:
            _leave_open(draft, family, quantity)
            draft.scaled = True
            usual = {"torque": "Nm", "current": "A", "voltage": "V"}[quantity]
            unit = family.meaning.unit or usual
            draft.why["torque"] = f"{family.label}: {quantity}s, state the Nm (or N) per {unit}"
            draft.doubts.append(f"torque: state the Nm (or N) per {unit} of {family.label}")
        return
    draft.why["torque"] = "no name says torque, effort, force or current" + _likely(draft)
    draft.doubts.append(f"torque: {draft.why['torque']}")


def _take(draft: Draft, family: Family, *, wanted: bool) -> None:
    signals = family.of(draft.axes)
    assert signals is not None
    slides = [unit in PRISMATIC_UNITS for _, unit in draft.fields["position"]]
    units = ["N" if s else "Nm" for s in slides]
    named = family.meaning.unit
    why = (
        f"the name says {named}" if named is not None else f"no unit in the name: {units[0]} taken"
    )
    if named is None:
        draft.doubts.append(f"torque: no name says the unit of {family.label}; {units[0]} is taken")
    if wanted:
        why += "; a command, no measurement"
    found = follows_acceleration(draft.signals("position"), signals, draft.sample_time_s)
    if found:
        span = f"{min(found):.2f} to {max(found):.2f}" if len(found) > 1 else f"{found[0]:.2f}"
        why += f"; correlation with the acceleration {span}"
    draft.take("torque", signals, units, f"{family.label}: {why}")


def _leave_open(draft: Draft, family: Family, quantity: str) -> None:
    signals = family.of(draft.axes)
    assert signals is not None
    unit = {"current": "A", "voltage": "V"}.get(quantity, "Nm")
    draft.torques.append([(series, unit) for series in signals])


def _likely(draft: Draft) -> str:
    """Return text that names the columns without a meaning that follow the acceleration; "" if none do."""
    said = []
    for family in draft.families:
        signals = family.of(draft.axes) if family.meaning.quantity == "" else None
        if signals is not None:
            found = follows_acceleration(draft.signals("position"), signals, draft.sample_time_s)
            if found and min(map(abs, found)) >= _LIKELY:
                said.append(f"{family.label} (correlation {min(found, key=abs):.2f})")
    return f"; with the acceleration go {', '.join(said)}" if said else ""


def take_joint_positions(draft: Draft) -> None:
    """Take joint-side positions beside motor-side ones if there is one family and its names give the unit."""
    if draft.side != "motor":
        return
    found = [f for f in of_quantity(draft.families, "position") if f.meaning.side == "joint"]
    whole = [f for f in found if f.of(draft.axes) is not None]
    if len(whole) != 1 or whole[0].meaning.unit is None:
        draft.leave(found, "positions of joints whose unit, or which of several, is open")
        return
    signals = whole[0].of(draft.axes)
    assert signals is not None
    unit = str(whole[0].meaning.unit)
    why = f"{whole[0].label}: of the joints, the name says {unit}"
    draft.take("joint_position", signals, [unit] * len(signals), why)
    still = [s.label for s in signals if largest([s]) == 0.0]
    if still:
        draft.doubts.append(f"joint_position: always zero, no sensor? {', '.join(still)}")


def take_temperature(draft: Draft) -> None:
    """Take the first family of temperatures that covers all axes; the unit is by name or by size."""
    for family in of_quantity(draft.families, "temperature"):
        signals = family.of(draft.axes)
        if signals is not None and "temperature" not in draft.fields:
            unit = "K" if largest(signals) > 200.0 else "degC"
            named = family.meaning.unit in ("degC", "K")
            unit = str(family.meaning.unit) if named else unit
            why = f"{family.label}: {unit} {'by its name' if named else 'by size'}"
            draft.take("temperature", signals, [unit] * len(signals), why)
