"""Axes as tables and sentences name them: by number, by their joint, and whether there was anything to explain."""

from __future__ import annotations

import re
from collections.abc import Sequence

from axisight.effects import phrase

# Names that say no more than the number of the axis.
_PLAIN = re.compile(r"(?:axis|joint|j|a|q)?[ _-]?0*(\d+)", re.IGNORECASE)
# "axis 2", "axes 2 and 3"; more than so many are not told by name, a table has them.
_MENTION = re.compile(r"\b(axis|axes) (\d+(?:(?:, | and )\d+)*)")
_MOST = 3
# Share by which an error may lie above the floor and be noise all the same: both are measured.
_NOISE = 0.1
# A gap as given is clear where it is this much of the floor, and above it by what is seen by eye [1]; the
# re-fit removes it where this much of what is above the floor goes, in squares.
_CLEAR, _SEEN, _REMOVED = 1.5, 0.02, 0.75


def own_name(axis: int, names: Sequence[str]) -> str:
    """Return the joint of an axis (from 1) where its name says more than the number; empty otherwise."""
    name = names[axis - 1] if axis <= len(names) else ""
    plain = _PLAIN.fullmatch(name)
    return "" if plain and int(plain[1]) == axis else name


def axis_label(axis: int, names: Sequence[str]) -> str:
    """Return ``3 (elbow_joint)``, or ``3`` where the joint has no name of its own."""
    name = own_name(axis, names)
    return f"{axis} ({name})" if name else str(axis)


def placed(label: str) -> str:
    """Return a candidate ``effect@axis`` in words."""
    effect, _, axis = label.partition("@")
    return f"{phrase(effect)} on axis {axis}" if axis else phrase(effect)


def with_joints(text: str, names: Sequence[str]) -> str:
    """Return a text with the joint of each axis behind its first mention: ``axis 3 (elbow_joint)``."""
    seen: set[str] = set()

    def label(number: re.Match[str]) -> str:
        if number[0] in seen:
            return number[0]
        seen.add(number[0])
        return axis_label(int(number[0]), names)

    def mention(found: re.Match[str]) -> str:
        if len(re.findall(r"\d+", found[2])) > _MOST:
            return found[0]
        return f"{found[1]} {re.sub(r'[0-9]+', label, found[2])}"

    return _MENTION.sub(mention, text)


def verdict_word(verdict: str, before: float, refitted: float, floor: float) -> str:
    """Return the verdict of an axis; ``at the floor`` where a cause acts on it and nothing was to be explained."""
    noise = (1 + _NOISE) * floor
    quiet = before <= noise and refitted <= noise
    return "at the floor" if verdict == "explained" and quiet else verdict


def removed_by_refit(
    before: Sequence[float], refitted: Sequence[float], floor: Sequence[float]
) -> list[int]:
    """Return the axes (from 1) whose gap as given is clear and gone once re-fitted, the largest first."""
    above = {}
    for axis, (b, r, f) in enumerate(zip(before, refitted, floor, strict=True), start=1):
        excess = b**2 - f**2
        if b > _CLEAR * f and excess > _SEEN**2 and b**2 - r**2 >= _REMOVED * excess:
            above[axis] = excess
    return sorted(above, key=lambda axis: -above[axis])
