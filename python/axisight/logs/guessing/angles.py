"""Find the columns of the positions, their unit and their side (motor or joint)."""

from __future__ import annotations

import math

from axisight.logs.guessing.draft import Draft
from axisight.logs.guessing.evidence import (
    LARGEST_JOINT_DEG,
    LARGEST_JOINT_RAD,
    PAIRS_APART,
    Agreement,
    agreement,
    largest,
)
from axisight.logs.guessing.families import Axis, Family, of_quantity
from axisight.logs.guessing.measured import measured
from axisight.logs.guessing.names import WORDS, called_after
from axisight.logs.guessing.targets import followed
from axisight.logs.units import PRISMATIC_UNITS, si_factor

_POSITION_UNITS = ("rad", "deg", "rev")
_VELOCITY_UNITS = ("rad/s", "deg/s", "rpm", "rev/s")


def find_positions(draft: Draft) -> Family:
    """Return the family of the positions, and put axes and positions into the draft, units still open.

    Raises LogError, listing the columns, without positions or with fewer axes than the robot has.
    """
    found = of_quantity(draft.families, "position")
    if not found:
        wanted = of_quantity(draft.families, "position", wanted=True)
        got = f"only targets: {', '.join(f.label for f in wanted)}" if wanted else "none"
        words = ", ".join(WORDS["position"].split())
        raise draft.refusal(
            f"position: expected columns whose names say so ({words}), got {got}; "
            f"a column map can name any other{_with_robot(draft)}"
        )
    if draft.robot is not None:
        n = draft.robot.n_axes
        enough = [f for f in found if len(f.signals) >= n]
        if not enough:
            most = max(len(f.signals) for f in found)
            raise draft.refusal(
                f"axis: expected positions of {n} axes, got columns for {most}{_without(draft, found)}"
            )
        draft.leave([f for f in found if f not in enough], f"not of {n} axes")
        found = enough
    family = _single(draft, found)
    draft.axes = _axes(draft, family)
    draft.slides = (
        [False] * len(draft.axes) if draft.robot is None else list(draft.robot.axis_is_prismatic)
    )
    signals = [family.signals[a] for a in draft.axes]
    draft.take("position", signals, [""] * len(signals), "")
    return family


def _with_robot(draft: Draft) -> str:
    """Return advice to give a robot if columns are measured but of no known joint; "" otherwise."""
    found = measured(draft.families) if draft.robot is None else []
    return f", and --robot says whether joints are called as in {found[0].label}" if found else ""


def _without(draft: Draft, found: list[Family]) -> str:
    """Return text that names the joints without a position; "" if no position is named after a joint."""
    joints = [] if draft.robot is None else list(draft.robot.axis_names)
    named = called_after(joints, [s.name for f in found for s in f.signals.values()])
    missing = [joint for joint in joints if joint not in named]
    return f": no position is called after {', '.join(missing)}" if named and missing else ""


def _single(draft: Draft, found: list[Family]) -> Family:
    """Return the family of the positions, motor-side before joint-side; raise LogError for an open choice."""
    motors = [f for f in found if f.meaning.side == "motor"]
    kinds = motors if len(motors) == 1 and len(found) > 1 else found
    most = max(len(f.signals) for f in kinds)
    largest_ones = [f for f in kinds if len(f.signals) == most]
    if len(largest_ones) > 1:
        listed = ", ".join(f.label for f in largest_ones)
        raise draft.refusal(f"position: expected one column per axis, got a choice of {listed}")
    fewer = [f for f in kinds if f is not largest_ones[0]]
    draft.leave(fewer, "positions of fewer axes")
    if fewer:
        listed = ", ".join(f.label for f in fewer)
        draft.doubts.append(f"axes: positions of fewer axes are left out: {listed}")
    return largest_ones[0]


def _axes(draft: Draft, family: Family) -> list[Axis]:
    """Return the axes in the order of the robot's joints, of their numbers, or of the file."""
    names = [] if draft.robot is None else list(draft.robot.axis_names)
    if names and set(names) <= set(family.signals):
        draft.why["axes"] = "in the order of the robot's joints, by their names"
        return list(names)
    keys = list(family.signals)
    numbers = sorted(k for k in keys if isinstance(k, int))
    if len(numbers) == len(keys):
        draft.why["axes"] = "by the numbers in the names"
        if numbers and numbers[-1] - numbers[0] + 1 != len(numbers):
            shown = ", ".join(map(str, numbers))
            draft.doubts.append(f"axes: numbers have a gap ({shown}): is an axis missing?")
        keys = list(numbers)
    elif len(keys) > 1:
        draft.why["axes"] = "in the order of the file"
        shown = ", ".join(map(str, keys))
        draft.doubts.append(
            f"axes: in the order of the file ({shown}); put them in that of the arm"
        )
    if names and len(keys) > len(names):
        extra = [family.signals[k].label for k in keys[len(names) :]]
        for label in extra:
            draft.unused[label] = f"beyond the {len(names)} axes of the robot"
        draft.doubts.append(
            f"axes: the first {len(names)}, as the robot has; not {', '.join(extra)}"
        )
    return keys[: len(names)] if names else keys


def settle_positions(draft: Draft, family: Family) -> None:
    """Set unit and side of the positions; the draft must have its time."""
    unit, why = _unit(draft, family)
    size = largest(draft.signals("position"))
    units = [("m" if slides and unit not in PRISMATIC_UNITS else unit) for slides in draft.slides]
    if any(draft.slides):
        why += "; m where an axis of the robot slides"
    draft.take("position", draft.signals("position"), units, f"{family.label}: {why}")
    draft.side, draft.why["side"] = _side(draft, family, size * si_factor(unit))


def _unit(draft: Draft, family: Family) -> tuple[str, str]:
    named = family.meaning.unit
    if named in (*_POSITION_UNITS, "m", "mm"):
        return named, f"the name says {named}"
    if named is not None:
        raise draft.refusal(
            f"position: expected a unit of angles or lengths, got {named} in {family.label}; write a map "
            f"with counts_per_rev, and with offset if the encoder does not read 0 at zero"
        )
    return _by_velocities(draft) or _by_targets(draft) or _by_size(draft, family)


def _by_velocities(draft: Draft) -> tuple[str, str] | None:
    """Return the unit that fits a velocity, measured or a target, and the reason; None without one."""
    measured = of_quantity(draft.families, "velocity")
    for velocity in (*measured, *of_quantity(draft.families, "velocity", wanted=True)):
        signals = velocity.of(draft.axes)
        if signals is None:
            continue
        seen = agreement(draft.signals("position"), signals, draft.sample_time_s)
        unit = _by_velocity(seen, velocity.meaning.unit)
        if unit is not None:
            return unit, (
                f"{unit}, as {velocity.label} is {seen.ratio:.4g} times the derivative "
                f"(correlation {seen.alike:.3f})"
            )
    return None


def _by_targets(draft: Draft) -> tuple[str, str] | None:
    """Return the unit in which the positions follow targets that name theirs, and the reason; None without one."""
    for target in of_quantity(draft.families, "position", wanted=True):
        signals, named = target.of(draft.axes), target.meaning.unit
        if signals is None or named not in _POSITION_UNITS:
            continue
        for unit in _POSITION_UNITS:
            factors = [si_factor(unit) / si_factor(named)] * len(signals)
            if followed(draft.signals("position"), signals, factors):
                return unit, f"{unit}, as the positions follow {target.label}, which is in {named}"
    return None


def _by_velocity(seen: Agreement, velocity_unit: str | None) -> str | None:
    """Return the unit of angles that fits a velocity; None if several or no units fit."""
    named = (velocity_unit,) if velocity_unit in _VELOCITY_UNITS else _VELOCITY_UNITS
    fits = {
        unit
        for unit in _POSITION_UNITS
        for other in named
        if seen.is_factor(si_factor(unit) / si_factor(other or "rad/s"), PAIRS_APART)
    }
    return fits.pop() if len(fits) == 1 else None


def _by_size(draft: Draft, family: Family) -> tuple[str, str]:
    size = largest(draft.signals("position"))
    if size <= LARGEST_JOINT_RAD:
        draft.doubts.append(f"position: rad by size ({size:.3g} at most), no name says so")
        return "rad", f"rad by size: none goes beyond {size:.3g}"
    motor = family.meaning.side == "motor"
    if size <= LARGEST_JOINT_DEG and not motor:
        draft.doubts.append(
            f"position: deg by size ({size:.3g}), doubtful: in rad a joint turns {size / (2 * math.pi):.2g} "
            f"times, or it is a motor"
        )
        return "deg", f"deg by size: up to {size:.4g}, too much for a joint in rad"
    draft.doubts.append(f"position: rad of motors by size ({size:.4g}); counts would be as large")
    return "rad", f"rad by size: up to {size:.4g}, which motors reach"


def _side(draft: Draft, family: Family, size_rad: float) -> tuple[str, str]:
    if family.meaning.side is not None:
        return family.meaning.side, f"the names of the positions say {family.meaning.side}"
    if any(u in PRISMATIC_UNITS for _, u in draft.fields["position"]):
        return "motor", "an axis that slides: forces and positions of the slide itself"
    side = "joint" if size_rad <= LARGEST_JOINT_RAD else "motor"
    reach = "no axis goes" if side == "joint" else "an axis goes"
    why = f"{reach} beyond {LARGEST_JOINT_RAD:g} rad ({size_rad:.3g} rad at most)"
    draft.doubts.append(f"side: {side} by size, no name says so: {why}")
    return side, why
