"""An `Effect`: its name, its place, its parameters."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight.arguments import did_you_mean, short, shown
from axisight.effects.table import EffectInfo, effect_info
from axisight.errors import InputError

EffectTuple = tuple[str, int | tuple[int, int] | None, list[float]]


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Effect:
    """One effect: its name, its place and the values of its parameters.

    Parameters
    ----------
    name : a name of `effect_table`.
    axis : the driven axis, from 1, or the name of its joint; None for effects of the whole arm.
    parameters : values by name, in the units of `effect_table`; those left out take their neutral value.
    axes : the two axes of an effect between axes, as numbers or joint names.
    joints : the joint names that `axis` or `axes` gave. `Robot.placed`, and every call that has a robot,
        replaces them by numbers. Do not pass it yourself.

    Effects are equal if they have the same name, place and values. Raises InputError for an unknown effect or
    parameter, for a value that is not a number, and for a place that the effect cannot have.

    """

    name: str
    axis: int | None
    parameters: Mapping[str, float] | None
    axes: tuple[int, int] | None
    joints: tuple[int | str, ...]

    def __init__(
        self,
        name: str,
        axis: int | str | None = None,
        parameters: Mapping[str, float] | None = None,
        axes: Sequence[int | str] | NDArray[np.integer[Any]] | None = None,
        joints: Sequence[int | str] = (),
    ) -> None:
        """Raise InputError for an unknown name, an impossible place or a wrong parameter."""
        info = effect_info(name)
        if axis is not None and info.scope == "axes":
            raise InputError(
                f"effect {name!r}: axis: expected axes, it acts between two, got {shown(axis)}"
            )
        number, both = None, None
        if isinstance(axis, str):
            joints = (axis,)
        elif axis is not None:
            number, joints = _axis(name, axis), ()
        if axes is not None:
            both = _two_axes(info, axes)
            named = any(isinstance(place, str) for place in both)
            both, joints = (None, both) if named else (both, ())
        _check_parameters(info, parameters)
        values = (name, number, parameters, both, tuple(joints))
        for field, value in zip(_FIELDS, values, strict=True):
            object.__setattr__(self, field, value)

    def __repr__(self) -> str:
        """Return the call that makes this effect."""
        place = self.joints[0] if len(self.joints) == 1 else self.axis
        values = {name: float(f"{value:.6g}") for name, value in (self.parameters or {}).items()}
        parts = [repr(self.name), *([] if place is None else [repr(place)])]
        if values:
            parts.append(repr(values) if place is not None else f"parameters={values}")
        if self.axes is not None or len(self.joints) == 2:
            parts.append(f"axes={self.axes or self.joints}")
        return f"Effect({', '.join(parts)})"

    @property
    def label(self) -> str:
        """Label ``effect@axis`` or ``effect@5,6``; the name alone for an effect of the whole arm."""
        if self.joints:
            return f"{self.name}@{','.join(map(str, self.joints))}"
        if self.axes is not None:
            return f"{self.name}@{self.axes[0]},{self.axes[1]}"
        return self.name if self.axis is None else f"{self.name}@{self.axis}"

    @property
    def place(self) -> int | tuple[int, int] | None:
        """Axis (from 1), two axes, or None for the whole arm; raises InputError for joint names."""
        if self.joints:
            named = ", ".join(str(joint) for joint in self.joints)
            raise InputError(
                f"effect {self.name!r}: axis: expected a number from 1 here, got {short(named)!r}; "
                "robot.placed([effect]) turns joint names into numbers"
            )
        return self.axis if self.axes is None else self.axes

    @property
    def first_axis(self) -> int | None:
        """The axis, or the first of two; None for the whole arm."""
        return self.axis if self.axes is None else self.axes[0]

    def acts_on(self, axis: int) -> bool:
        """Return whether the effect acts on an axis (from 1), alone or with other axes."""
        return self.place is None or axis in (self.axis, *(self.axes or ()))

    def with_values(self, values: Mapping[str, float]) -> Effect:
        """Return the same effect with some parameters replaced."""
        return replace(self, parameters={**(self.parameters or {}), **values})

    def __eq__(self, other: object) -> bool:
        """Return whether name, place and values are the same."""
        if not isinstance(other, Effect):
            return NotImplemented
        return (self.label, self.values()) == (other.label, other.values())

    def __hash__(self) -> int:
        """Return a hash of name, place and values: equal effects have equal hashes."""
        return hash((self.label, *self.values()))

    @property
    def acts(self) -> bool:
        """Whether any amplitude differs from its neutral value; without one the effect changes nothing."""
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


_FIELDS = ("name", "axis", "parameters", "axes", "joints")


def _axis(effect: str, axis: object, field: str = "axis") -> int:
    """Return the number of an axis; raises InputError for another type and for less than 1."""
    if isinstance(axis, bool) or not isinstance(axis, int | np.integer):
        got = shown(axis)
        raise InputError(
            f"effect {effect!r}: {field}: expected a number or a joint name, got {got}"
        )
    if axis < 1:
        raise InputError(f"effect {effect!r}: {field}: expected 1 or more, got {axis}")
    return int(axis)


def _two_axes(
    info: EffectInfo, axes: Sequence[int | str] | NDArray[np.integer[Any]]
) -> tuple[int | str, int | str]:
    """Return two different axes, as numbers or joint names."""
    expected = "two different axes from 1" if info.scope == "axes" else "none"
    if isinstance(axes, np.ndarray):
        axes = axes.tolist()
    two = isinstance(axes, Sequence) and not isinstance(axes, str) and len(axes) == 2
    if info.scope != "axes" or not two or axes[0] == axes[1]:
        raise InputError(f"effect {info.name!r}: axes: expected {expected}, got {shown(axes)}")
    if any(not isinstance(axis, str | int | np.integer) or axis == 0 for axis in axes):
        raise InputError(f"effect {info.name!r}: axes: expected {expected}, got {shown(axes)}")
    first, second = (a if isinstance(a, str) else _axis(info.name, a, "axes") for a in axes)
    return first, second


def _check_parameters(info: EffectInfo, parameters: object) -> None:
    """Raise InputError unless the parameters are a mapping of known names to numbers."""
    if parameters is None:
        return
    known = [p.name for p in info.parameters]
    if not isinstance(parameters, Mapping):
        example = f"{{{known[0]!r}: ...}}" if known else "none"
        got = shown(parameters)
        raise InputError(f"effect {info.name!r}: parameters: expected {example}, got {got}")
    for name, value in parameters.items():
        if name not in known:
            meant = did_you_mean(name, known)
            raise InputError(
                f"effect {info.name!r}: parameter {name!r}: expected {', '.join(known)}{meant}"
            )
        if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
            raise InputError(
                f"effect {info.name!r}: parameter {name!r}: expected a number, got {shown(value)}"
            )


def core_effects(effects: Iterable[Effect]) -> list[EffectTuple]:
    """Return effects as the tuples that the compiled core takes."""
    return [(e.name, e.place, e.values()) for e in effects]


def effect_of_core(effect: EffectTuple) -> Effect:
    """Return the effect that a tuple of the compiled core describes, with all its parameters."""
    name, place, values = effect
    names = (p.name for p in effect_info(name).parameters)
    parameters = dict(zip(names, values, strict=True))
    if isinstance(place, tuple):
        return Effect(name, None, parameters, place)
    return Effect(name, place, parameters)
