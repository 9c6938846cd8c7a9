"""The table of effects: all that is known of each, as the compiled core states it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import Any, Literal

from axisight import _core
from axisight.errors import InputError


@dataclass(frozen=True)
class EffectParameter:
    """One parameter of an effect.

    ``role``: the effect vanishes when every ``"amplitude"`` is at its neutral
    value; a ``"shape"`` may then be anything. ``lower`` and ``upper`` bound the
    value, ``typical`` is its natural scale; all in ``unit``.
    """

    name: str
    unit: str
    role: Literal["amplitude", "shape"]
    neutral: float
    lower: float
    upper: float
    typical: float


@dataclass(frozen=True)
class EffectInfo:
    """Description of an effect: equation and symbols as in the source it names.

    ``family`` is the kind of cause. ``contains`` names the effects that this one becomes at some
    value of its parameters, ``parts`` simpler ones that together do what it does. ``usual``: effects
    met more often that this one looks like where speed, load or pose hardly change. ``twins``: effects of
    which a machine gives the very same logs of commands and motor angles.
    ``stands_for``: quantity of the robot's joint that the effect changes, and whether its first
    parameter is the change itself or a share. ``linear``: how a linear model holds it.
    ``inverse_dynamics``: whether torque predicted from measured motion can hold it.
    ``absorbed_by``: identified quantities that it is part of. ``shown_by``: experiments that tell it from
    others, the best first.
    """

    name: str
    summary: str
    equation: str
    source: str
    scope: Literal["axis", "axes", "arm"]
    acts: Literal[
        "torque_path", "motor", "transmission", "joint", "arm", "base", "sensor", "controller"
    ]
    family: Literal[
        "friction",
        "transmission",
        "periodic",
        "timing",
        "torque_path",
        "load",
        "arm",
        "sensor",
        "controller",
    ]
    contains: tuple[str, ...]
    parts: tuple[str, ...]
    usual: tuple[str, ...]
    twins: tuple[str, ...]
    stands_for: tuple[str, Literal["absolute", "relative"]] | None
    linear: Literal["parameters", "slope", "path", "waves", "no"]
    inverse_dynamics: bool
    absorbed_by: tuple[str, ...]
    shown_by: tuple[str, ...]
    parameters: tuple[EffectParameter, ...]

    @property
    def contained_in(self) -> tuple[str, ...]:
        """Effects that become this one at some value of their parameters."""
        return tuple(e.name for e in effect_table().values() if self.name in e.contains)

    def terms(self) -> dict[str, tuple[str, str, str]]:
        """Return order, cosine and sine parameter of numbered harmonic terms, by their number."""
        names = [p.name for p in self.parameters]
        numbers = [n.removeprefix("order_") for n in names if re.fullmatch(r"order_\d+", n)]
        waves = {k: [n for n in names if n.split("_")[1:2] == [k]] for k in numbers}
        return {k: (order, cosine, sine) for k, (order, cosine, sine) in waves.items()}


_TUPLES = ("contains", "parts", "usual", "twins", "absorbed_by", "shown_by")


@cache
def effect_table() -> Mapping[str, EffectInfo]:
    """Return every effect by name, in the order of the documentation."""
    table = {}
    for row in _core.effect_table():
        # The core's words are those of the class: a test compares them.
        rest: dict[str, Any] = dict(row)
        rest |= {k: tuple(rest[k]) for k in _TUPLES}
        rest["parameters"] = tuple(EffectParameter(**p) for p in row["parameters"])
        table[row["name"]] = EffectInfo(**rest)
    return MappingProxyType(table)


def effect_info(name: str) -> EffectInfo:
    """Return the description of the effect called ``name``; raises InputError if there is none."""
    try:
        return effect_table()[name]
    except KeyError:
        known = ", ".join(effect_table())
        raise InputError(f"effect {name!r}: expected one of {known}") from None
