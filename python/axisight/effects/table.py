"""The table of effects: everything known about each, as the compiled core states it."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import Any, Literal

from axisight import _core
from axisight.arguments import did_you_mean, shown
from axisight.display.summary import summarized
from axisight.effects.priors import half_normal, log_normal
from axisight.effects.relations import BegunFrom, Formula, Later, Plainer, Resembles, SpringChange
from axisight.errors import InputError

Mark = Literal["optional", "place", "notation", "fastest_time", "shows_inverse", "held_first"]
"""Marks of a parameter.

- ``optional``: may be idle, as one wave or one coordinate of several.
- ``place``: says where the effect acts; it does not count as a number of the effect.
- ``notation``: belongs to a way of writing the law, not to the machine.
- ``fastest_time``: the shortest time [s] in which the effect changes; fixed steps must not be longer.
- ``shows_inverse``: a small change shows as a change of the inverse, as stiffness does by compliance.
- ``held_first``: held at its neutral value in first fits.
"""


@summarized
@dataclass(frozen=True)
class EffectParameter:
    """One parameter of an effect.

    - ``role``: the effect vanishes if every ``"amplitude"`` is at its neutral value; a ``"shape"`` may then
      have any.
    - ``lower``, ``upper``, ``typical``: bounds and natural scale, in ``unit``.
    - ``prior``: distribution of the values over machines (`log_prior`).
    - ``spread``: standard deviation of the logarithm in a log-normal prior [1].
    - ``sizes``: the source of ``typical`` and ``spread``.
    - ``marks``: see `Mark`.
    """

    name: str
    unit: str
    role: Literal["amplitude", "shape"]
    neutral: float
    lower: float
    upper: float
    typical: float
    prior: Literal["half_normal", "log_normal", "uniform"]
    spread: float
    sizes: str
    marks: tuple[Mark, ...]

    def log_prior(self, value: float) -> float:
        """Return the log-density of a value over machines, per ``unit``.

        ``value`` is in ``unit``. The density is that of machines which have the effect, and integrates to 1
        within the bounds. Returns minus infinity outside them.
        """
        bounds = self.lower, self.upper
        if not self.lower <= value <= self.upper:
            return -math.inf
        if self.prior == "uniform":
            return -math.log(self.upper - self.lower)
        if self.prior == "log_normal":
            return log_normal(value, self.typical, self.spread, bounds)
        return half_normal(value, self.neutral, self.typical, bounds)


@summarized
@dataclass(frozen=True)
class EffectInfo:
    """Description of an effect; equation and symbols are those of its ``source``.

    - ``family``: the kind of cause.
    - ``contains``: effects that this one becomes at some value of its parameters.
    - ``parts``: simpler effects that together do the same.
    - ``usual``: more common effects that look like this one if speed, load or pose hardly change.
    - ``usual_odds``: how many times as common this effect is as one that lists it in ``usual`` [1].
    - ``twins``: effects that give the same logs of commands and motor angles; ``twins_alone``: only on an arm
      of one axis.
    - ``resembles``, ``plainer``, ``begun_from``, ``later``, ``formula``, ``spring``: see
      `axisight.effects.relations`.
    - ``law_of``: the part that this is a law of, if an axis has only one law of that part.
    - ``scales``: torques that the effect scales like a change of torque unit: its own axis, all axes that
      carry it, or every axis.
    - ``stands_for``: quantity of the robot's joint that the effect changes; the first parameter is the
      change, absolute or relative.
    - ``linear``: how a linear model includes the effect.
    - ``inverse_dynamics``: whether torque predicted from measured motion can include the effect.
    - ``beside``: causes of the same axis without which predicted torque does not show the effect reliably.
    - ``unrepeatable``: no two runs repeat the effect; it is noise.
    - ``needs_chain``: a robot with branches cannot have the effect, which acts at the one tip or the one next joint.
    - ``absorbed_by``: identified quantities that absorb the effect.
    - ``shown_by``: experiments that tell it from other effects, the best first.
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
    usual_odds: float
    twins: tuple[str, ...]
    twins_alone: bool
    resembles: Resembles | None
    plainer: Plainer | None
    begun_from: BegunFrom | None
    later: Later | None
    law_of: Literal["gear", "dry_friction"] | None
    formula: Formula
    spring: SpringChange | None
    scales: Literal["own", "carriers", "every"] | None
    stands_for: tuple[str, Literal["absolute", "relative"]] | None
    linear: Literal["parameters", "slope", "path", "waves", "no"]
    inverse_dynamics: bool
    beside: tuple[str, ...]
    unrepeatable: bool
    needs_chain: bool
    absorbed_by: tuple[str, ...]
    shown_by: tuple[str, ...]

    parameters: tuple[EffectParameter, ...]

    @property
    def contained_in(self) -> tuple[str, ...]:
        """Effects that become this one at some value of their parameters."""
        return tuple(e.name for e in effect_table().values() if self.name in e.contains)

    @property
    def late(self) -> bool:
        """Whether the effect makes something late: torque, a reading, references."""
        return self.family == "timing"

    @property
    def drive_lag(self) -> bool:
        """Whether the effect is a delay or lag of the drive, between commanded and applied torque."""
        return self.late and self.acts == "torque_path"

    @property
    def carried(self) -> bool:
        """Whether the effect is mass, inertia or weight: every axis that carries it feels it."""
        return self.family == "load"

    @property
    def of_gear(self) -> bool:
        """Whether the effect is a law of the gear: a second gear law may correct the formula of the first."""
        return self.law_of == "gear"

    @property
    def torque_unit(self) -> bool:
        """Whether the effect changes the unit of torque: a command makes more or less than stated."""
        return "torque" in self.absorbed_by

    def marked(self, mark: Mark) -> tuple[str, ...]:
        """Return the names of the parameters with a mark."""
        return tuple(p.name for p in self.parameters if mark in p.marks)

    def terms(self) -> dict[str, tuple[str, str, str]]:
        """Return order, cosine and sine parameter of each harmonic term, by its number as text."""
        names = [p.name for p in self.parameters]
        numbers = [n.removeprefix("order_") for n in names if re.fullmatch(r"order_\d+", n)]
        waves = {k: [n for n in names if n.split("_")[1:2] == [k]] for k in numbers}
        return {k: (order, cosine, sine) for k, (order, cosine, sine) in waves.items()}


_TUPLES = ("contains", "parts", "usual", "twins", "beside", "absorbed_by", "shown_by")


@cache
def effect_table() -> Mapping[str, EffectInfo]:
    """Return every effect by name, in the order of the documentation."""
    return MappingProxyType({row["name"]: _info(row) for row in _core.effect_table()})


def _info(row: _core.EffectInfo) -> EffectInfo:
    """Return the description in a row of the core's table."""
    # Field names of the core are those of the classes; a test compares them.
    rest: dict[str, Any] = dict(row)
    rest |= {k: tuple(rest[k]) for k in _TUPLES}
    rest["formula"] = Formula(**row["formula"])
    if (like := row["resembles"]) is not None:
        rest["resembles"] = Resembles(
            like["law"], like["size"], like["ratio"], dict(like["shape"]), like["rarer"]
        )
    if (plainer := rest["plainer"]) is not None:
        rest["plainer"] = Plainer(**{**plainer, "adds": tuple(plainer["adds"])})
    if (begun := row["begun_from"]) is not None:
        rest["begun_from"] = BegunFrom(begun["law"], dict(begun["takes"]))
    if (later := row["later"]) is not None:
        rest["later"] = Later(**later)
    if (spring := row["spring"]) is not None:
        sums = tuple(map(tuple, spring["sums"]))
        rest["spring"] = SpringChange(sums, spring["without_middle"])
    rest["parameters"] = tuple(_parameter(p) for p in row["parameters"])
    return EffectInfo(**rest)


def _parameter(row: _core.ParameterInfo) -> EffectParameter:
    rest: dict[str, Any] = dict(row)
    return EffectParameter(**{**rest, "marks": tuple(row["marks"])})


def effect_info(name: str) -> EffectInfo:
    """Return the description of the effect called ``name``.

    Raises InputError for an unknown name. The message has the nearest known name.
    """
    table = effect_table()
    if isinstance(name, str) and name in table:
        return table[name]
    meant = did_you_mean(name, table) or "."
    raise InputError(
        f"unknown effect {shown(name)}{meant} axisight.effect_table() lists all {len(table)} effects"
    )
