"""Axes as tables and sentences name them: by number, by their joint, and whether there was anything to explain."""

from __future__ import annotations

import re
from collections.abc import Sequence

from axisight.effects import article, effect_info, noun, phrase

# Names that say no more than the number of the axis.
_PLAIN = re.compile(r"(?:axis|joint|j|a|q)?[ _-]?0*(\d+)", re.IGNORECASE)
# "axis 2", "axes 2 and 3", but not the 4 of "axes 2 and 3 and 4 more effects". More than so many are not told by
# name, a table has them.
_MENTION = re.compile(
    r"\b(?:([Aa]xis) (\d+)|([Aa]xes) (\d+(?:(?:, | and )\d+\b(?! (?:more|others?)\b))*))"
)
_MOST = 3
# Share by which a gap may lie above its floor and be noise all the same: both are measured.
_NOISE = 0.1
# A gap is clear from this many times the floor, and from this far above it [1]. It is removed where this share of
# what is above the floor goes, in squares.
_CLEAR, _SEEN, _REMOVED = 1.5, 0.02, 0.75
# Article of what is the machine's own.
_OWN = "the machine's"


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
    """Return the label of a candidate in words, such as "backlash on axis 2" or "another link mass on axis 1"."""
    effect, _, axes = label.partition("@")
    what = f"another {noun(effect)}" if always_there(effect) else phrase(effect)
    what = what.removeprefix(f"{_OWN} ")
    first, _, second = axes.partition(",")
    where = f" on axes {first} and {second}" if second else f" on axis {first}" if first else ""
    return f"{what}{where}"


def always_there(effect: str) -> bool:
    """Whether every simulator has what an effect changes: a share of its own values, or a link of its arm."""
    info = effect_info(effect)
    own = article(effect) == _OWN and info.scope == "axis"
    return own and (info.acts == "arm" or info.parameters[0].name.startswith("relative_"))


def with_joints(text: str, names: Sequence[str]) -> str:
    """Return a text with the joint of each axis behind its first mention: ``axis 3 (elbow_joint)``."""
    seen: set[str] = set()

    def label(number: re.Match[str]) -> str:
        if number[0] in seen:
            return number[0]
        seen.add(number[0])
        return axis_label(int(number[0]), names)

    def mention(found: re.Match[str]) -> str:
        word, numbers = found[1] or found[3], found[2] or found[4]
        if len(re.findall(r"\d+", numbers)) > _MOST:
            return found[0]
        return f"{word} {re.sub(r'[0-9]+', label, numbers)}"

    return _MENTION.sub(mention, text)


def at_floor(gap: float, floor: float) -> bool:
    """Whether a gap [1] is no larger than its floor, up to the scatter of both; not where either is not finite."""
    return gap <= (1 + _NOISE) * floor


def hides_all(floor: float) -> bool:
    """Whether noise is so large a share of the torque [1] that not even a gap of all of it would be clear."""
    return _CLEAR * floor >= 1.0


def in_words(verdict: str) -> str:
    """Return a verdict as it is told: *explained_in_part* without its underscores."""
    return verdict.replace("_", " ")


def verdict_word(verdict: str, row: Sequence[float]) -> str:
    """Return the verdict of an axis in words, beside its ``row`` of the gap: before, re-fitted, after, floor [1].

    An axis that is *explained* because causes act on it, and has no gap that they could explain, is ``at the floor``.
    """
    return (
        "at the floor" if verdict == "explained" and at_floor(row[1], row[3]) else in_words(verdict)
    )


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
