"""An effect at work: its name, its place, its parameters."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from axisight.effects.table import EffectInfo, effect_info
from axisight.errors import InputError

EffectTuple = tuple[str, int | tuple[int, int] | None, list[float]]


@dataclass(frozen=True, eq=False)
class Effect:
    """An effect at work.

    ``axis`` is the 1-based driven axis, ``axes`` the two of an effect between axes; both are None
    for effects of the whole arm. ``parameters`` maps names to values; those left out take their
    neutral value. Effects are equal if they have the same name, place and values. Raises
    InputError for an unknown effect or parameter, and for a place that the effect cannot have.
    """

    name: str
    axis: int | None = None
    parameters: Mapping[str, float] | None = None
    axes: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        """Refuse unknown names and impossible axes early."""
        info = effect_info(self.name)
        if self.axis is not None and self.axis < 1:
            raise InputError(f"effect {self.name!r}: axis: expected 1 or more, got {self.axis}")
        if info.scope == "axes" and self.axis is not None:
            raise InputError(
                f"effect {self.name!r}: axis: expected axes, it acts between two, got {self.axis}"
            )
        if self.axes is not None:
            object.__setattr__(self, "axes", _two_axes(info, self.axes))
        known = [p.name for p in info.parameters]
        for name in self.parameters or {}:
            if name not in known:
                expected = ", ".join(known)
                raise InputError(f"effect {self.name!r}: parameter {name!r}: expected {expected}")

    @property
    def label(self) -> str:
        """``effect@axis`` or ``effect@5,6``; the effect alone when it belongs to the whole arm."""
        if self.axes is not None:
            return f"{self.name}@{self.axes[0]},{self.axes[1]}"
        return self.name if self.axis is None else f"{self.name}@{self.axis}"

    @property
    def place(self) -> int | tuple[int, int] | None:
        """Axis, axes, or None for the whole arm."""
        return self.axis if self.axes is None else self.axes

    @property
    def first_axis(self) -> int | None:
        """The axis, or the first of two; None for the whole arm."""
        return self.axis if self.axes is None else self.axes[0]

    def acts_on(self, axis: int) -> bool:
        """Whether it belongs to an axis (from 1), alone, with another one or with the whole arm."""
        return self.place is None or axis in (self.axis, *(self.axes or ()))

    def with_values(self, values: Mapping[str, float]) -> Effect:
        """Return the same effect with some parameters replaced."""
        return replace(self, parameters={**(self.parameters or {}), **values})

    def __eq__(self, other: object) -> bool:
        """Compare name, place and values."""
        if not isinstance(other, Effect):
            return NotImplemented
        return (self.label, self.values()) == (other.label, other.values())

    def __hash__(self) -> int:
        """Agree with equality."""
        return hash((self.label, *self.values()))

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


def _two_axes(info: EffectInfo, axes: Sequence[int]) -> tuple[int, int]:
    expected = "two different axes from 1" if info.scope == "axes" else "none"
    if info.scope != "axes" or len(axes) != 2 or axes[0] == axes[1] or min(axes) < 1:
        raise InputError(f"effect {info.name!r}: axes: expected {expected}, got {tuple(axes)}")
    return axes[0], axes[1]


def core_effects(effects: Iterable[Effect]) -> list[EffectTuple]:
    """Return effects as the compiled core takes them."""
    return [(e.name, e.place, e.values()) for e in effects]


def effect_of_core(effect: EffectTuple) -> Effect:
    """Return an effect that the compiled core tells of, with all its parameters."""
    name, place, values = effect
    names = (p.name for p in effect_info(name).parameters)
    parameters = dict(zip(names, values, strict=True))
    if isinstance(place, tuple):
        return Effect(name, None, parameters, place)
    return Effect(name, place, parameters)
