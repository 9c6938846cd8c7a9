"""Notes on everything that a USD joint states and a robot does not take."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from axisight.robot_import.usd.attributes import (
    DRIVE,
    HOMES,
    QUANTITIES,
    SPRING_REST,
    STATIC_FRICTION,
    Units,
    authored,
    axis_of,
    stated,
)
from axisight.robot_import.usd.drives import is_acceleration

# Namespaces of attributes that change the motion of a joint.
_NAMESPACES = ("drive:", "newton:", "physx", "mjc:", "state:")
# Differences between single-precision numbers that mean the same value.
_ALIKE = 1e-6


def of_joint(prim: Any, name: str, units: Units, *, turns: bool) -> list[str]:
    """Return the notes on one joint: what is left out, and which attributes contradict each other."""
    out = [*_contradictions(prim, name, units, turns=turns)]
    if is_acceleration(prim, turns=turns):
        out.append(
            f"joint {name!r}: gains of its drive left out: they make accelerations (type = 'acceleration')"
        )
    static, moving = _frictions(prim, turns=turns)
    if static is not None and abs(static - (moving or 0.0)) > _ALIKE * abs(static):
        out.append(
            f"joint {name!r}: staticFrictionEffort {static:g} left out: friction of a moving joint is "
            f"dynamicFrictionEffort"
        )
    left = [found for found in _authored(prim) if found not in _taken(turns=turns)]
    if left:
        out.append(f"joint {name!r}: left out: {', '.join(left)}")
    return out


def _frictions(prim: Any, *, turns: bool) -> tuple[float | None, float | None]:
    """Return PhysX's friction efforts of a joint at rest and of a moving joint."""
    moving = HOMES["friction"][0].attribute(turns=turns)
    static = authored(prim, STATIC_FRICTION.format(axis=axis_of(turns=turns)))
    return static, authored(prim, moving)


def _contradictions(prim: Any, name: str, units: Units, *, turns: bool) -> Iterable[str]:
    """Yield a note for every attribute that another one overrules with another value."""
    for quantity in QUANTITIES:
        found = list(stated(prim, quantity, units, turns=turns))
        for home, value in found[1:]:
            first, taken = found[0]
            if abs(value - taken) > _ALIKE * max(abs(value), abs(taken)):
                yield (
                    f"joint {name!r}: {home.attribute(turns=turns)} ({value:g} in SI units) left out: "
                    f"{first.attribute(turns=turns)} states {taken:g}"
                )


def _taken(*, turns: bool) -> set[str]:
    """Return the attributes that the import takes, or speaks of itself."""
    axis = axis_of(turns=turns)
    drive = DRIVE.format(axis=axis)
    homes = {home.attribute(turns=turns) for every in HOMES.values() for home in every}
    gains = {drive + name for name in ("type", "maxForce", "stiffness", "damping")}
    return homes | gains | {SPRING_REST, STATIC_FRICTION.format(axis=axis)}


def _authored(prim: Any) -> list[str]:
    """Return the attributes of engines that a joint states, zero targets and infinite limits aside."""
    found = []
    for attribute in prim.GetAuthoredAttributes():
        name, value = attribute.GetName(), attribute.Get()
        ordinary = (
            value is None or (name.startswith("drive:") and value == 0) or value == float("inf")
        )
        if name.startswith(_NAMESPACES) and attribute.HasAuthoredValue() and not ordinary:
            found.append(name)
    return sorted(found)
