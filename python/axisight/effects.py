"""The effects a machine may have and a simulator may lack."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import Literal

from axisight import _core
from axisight.errors import InputError

EffectTuple = tuple[str, int | None, list[float]]


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
    """Description of an effect: equation and symbols as in the source it names."""

    name: str
    summary: str
    equation: str
    source: str
    scope: Literal["axis", "arm"]
    acts: Literal["torque_path", "motor", "transmission", "joint", "arm", "sensor"]
    parameters: tuple[EffectParameter, ...]


@cache
def effect_table() -> Mapping[str, EffectInfo]:
    """Return every effect by name, in the order of the documentation."""
    table = {}
    for row in _core.effect_table():
        parameters = tuple(EffectParameter(**p) for p in row["parameters"])
        table[row["name"]] = EffectInfo(
            name=row["name"],
            summary=row["summary"],
            equation=row["equation"],
            source=row["source"],
            scope=row["scope"],
            acts=row["acts"],
            parameters=parameters,
        )
    return MappingProxyType(table)


def effect_info(name: str) -> EffectInfo:
    """Return the description of the effect called ``name``; raises InputError if there is none."""
    try:
        return effect_table()[name]
    except KeyError:
        known = ", ".join(effect_table())
        raise InputError(f"effect {name!r}: expected one of {known}") from None


@dataclass(frozen=True)
class Effect:
    """An effect at work.

    ``axis`` is the 1-based driven axis, None for effects of the whole arm.
    ``parameters`` maps names to values; those left out take their neutral
    value. Raises InputError for an unknown effect or parameter.
    """

    name: str
    axis: int | None = None
    parameters: Mapping[str, float] | None = None

    def __post_init__(self) -> None:
        """Refuse unknown names and impossible axes early."""
        if self.axis is not None and self.axis < 1:
            raise InputError(f"effect {self.name!r}: axis: expected 1 or more, got {self.axis}")
        known = [p.name for p in effect_info(self.name).parameters]
        for name in self.parameters or {}:
            if name not in known:
                expected = ", ".join(known)
                raise InputError(f"effect {self.name!r}: parameter {name!r}: expected {expected}")

    @property
    def label(self) -> str:
        """``effect@axis``, or the effect alone when it belongs to the whole arm."""
        return self.name if self.axis is None else f"{self.name}@{self.axis}"

    @property
    def acts(self) -> bool:
        """Whether any amplitude is off its neutral value: otherwise the effect changes nothing."""
        given = self.parameters or {}
        return any(
            given.get(p.name, p.neutral) != p.neutral
            for p in effect_info(self.name).parameters
            if p.role == "amplitude"
        )

    def values(self) -> list[float]:
        """Return the parameter values in the order of the table."""
        given = self.parameters or {}
        return [given.get(p.name, p.neutral) for p in effect_info(self.name).parameters]


def without(effects: Iterable[Effect], replaced_by: Iterable[Effect]) -> list[Effect]:
    """Return those effects that have none of the same name and axis in ``replaced_by``."""
    labels = {effect.label for effect in replaced_by}
    return [effect for effect in effects if effect.label not in labels]


def core_effects(effects: Iterable[Effect]) -> list[EffectTuple]:
    """Return effects as the compiled core takes them."""
    return [(e.name, e.axis, e.values()) for e in effects]
