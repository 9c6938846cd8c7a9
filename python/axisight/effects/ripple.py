"""Ripple with any number of harmonics, from a table of orders, amplitudes and phases."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest
from math import cos, isfinite, sin
from typing import NamedTuple

from axisight.effects.effect import Effect
from axisight.errors import InputError

# Names of the harmonics that one effect has.
CONSTANT = ("1", "2", "3", "4", "5")
PROPORTIONAL = ("u",)


class Harmonic(NamedTuple):
    """One harmonic ``amplitude sin(order phi + phase_rad)`` of the motor angle phi."""

    order: float
    amplitude: float
    phase_rad: float


def torque_ripple(
    axis: int | str,
    *,
    constant_nm: Sequence[tuple[float, float, float]] = (),
    proportional: Sequence[tuple[float, float, float]] = (),
) -> list[Effect]:
    """Return the torque ripple of one axis with any number of harmonics, eq. (8.2a) of Wernholt (2004).

    One effect has five harmonics of constant amplitude and one in proportion to the torque. Effects on one axis
    add up, so a longer table becomes several effects.

    Parameters
    ----------
    axis : the driven axis, from 1, or the name of its joint.
    constant_nm : `Harmonic`, or (order, amplitude [Nm], phase [rad]), for each harmonic of constant amplitude.
    proportional : the same for harmonics in proportion to the torque command; amplitude [1].

    Raises InputError for an order that is not positive, a value that is not finite, and an empty table.

    """
    constant = _tables("constant_nm", constant_nm, CONSTANT, "_nm")
    in_proportion = _tables("proportional", proportional, PROPORTIONAL, "")
    both = zip_longest(constant, in_proportion, fillvalue=dict[str, float]())
    return _effects("torque_ripple", axis, [one | other for one, other in both])


def resolver_ripple(
    axis: int | str, harmonics_rad: Sequence[tuple[float, float, float]]
) -> list[Effect]:
    """Return the resolver ripple of one axis with any number of harmonics, eq. (8.2b) of Wernholt (2004).

    ``harmonics_rad``: `Harmonic`, or (order, amplitude [rad], phase [rad]), for each harmonic. One effect has five;
    a longer table becomes several effects, which add up. Raises InputError as `torque_ripple` does.
    """
    return _effects(
        "resolver_ripple", axis, _tables("harmonics_rad", harmonics_rad, CONSTANT, "_rad")
    )


def _effects(name: str, axis: int | str, tables: list[dict[str, float]]) -> list[Effect]:
    if not tables:
        raise InputError(f"{name}: expected at least one harmonic, got none")
    # The first order is one unless it is stated, and zero switches it off.
    return [Effect(name, axis, {"order_1": 0.0} | table) for table in tables]


def _tables(
    field: str,
    harmonics: Sequence[tuple[float, float, float]],
    labels: Sequence[str],
    unit: str,
) -> list[dict[str, float]]:
    """Return the parameters of as many effects as the harmonics need, ``len(labels)`` harmonics each."""
    tables = []
    for first in range(0, len(harmonics), len(labels)):
        table: dict[str, float] = {}
        for label, values in zip(labels, harmonics[first:], strict=False):
            names = f"order_{label}", f"cosine_{label}{unit}", f"sine_{label}{unit}"
            table |= dict(zip(names, _cosine_and_sine(field, values), strict=True))
        tables.append(table)
    return tables


def _cosine_and_sine(field: str, values: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return order, cosine and sine amplitude of ``amplitude sin(order phi + phase)``."""
    if len(values) != 3 or not (all(map(isfinite, values)) and values[0] > 0):
        raise InputError(
            f"{field}: expected (order > 0, amplitude, phase in rad), all finite, got {tuple(values)}"
        )
    order, amplitude, phase_rad = values
    return float(order), amplitude * sin(phase_rad), amplitude * cos(phase_rad)
