"""Identified values with their uncertainty and provenance."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight.arguments import one_of
from axisight.display.summary import summarized
from axisight.effects import Effect
from axisight.errors import InputError
from axisight.fitting import Fitted
from axisight.robot import Robot
from axisight.robot_file.checks import check_agreement, checked_covariance

Array = NDArray[np.float64]


@summarized
@dataclass(frozen=True)
class Provenance:
    """The origin of identified values.

    ``method`` is a description in words. ``data`` maps the names of logs to SHA-256 hashes of their files
    (see `hash_file`). ``settings`` are the settings of the method, in JSON types. ``created`` is the time in
    UTC. `write_identified` fills in ``created`` and ``axisight_version`` if they are not set.
    """

    method: str
    data: Mapping[str, str] = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)
    created: datetime | None = None
    axisight_version: str = ""
    notes: str = ""


@summarized
@dataclass(frozen=True)
class Identified:
    """Identified values with their uncertainty and provenance.

    ``names`` (n of them) are:

    - those of `axisight.robot_parameters` (``axis1.stiffness``);
    - ``<joint>.inertia_xx`` to ``_yz``, the link inertia about the centre of mass, in link axes;
    - ``<joint>.origin_x`` to ``_z`` and ``<joint>.axis_x`` to ``_z``, the geometry of joints;
    - ``<joint>.kp`` and ``.kd``, gains of a position controller; ``.kv``, ``.kp`` and ``.ki`` of a cascade;
    - ``<effect label>.<parameter>``, for effects found and effects of the robot.

    ``values`` (n,) are in SI units, ``standard_errors`` (n,) are NaN if unknown, ``covariance`` is (n, n) or
    None. ``effects`` are those found; they replace the robot's effects of the same name and axis. ``removed``
    are effects of the robot that the values contain already, so that they must leave its file.
    """

    names: tuple[str, ...]
    values: Array
    standard_errors: Array
    provenance: Provenance
    covariance: Array | None = None
    effects: tuple[Effect, ...] = ()
    robot: Robot | None = None
    removed: tuple[Effect, ...] = ()

    def value(self, name: str) -> float:
        """Return the value of a ``name`` (SI units); raise InputError for a name that was not identified."""
        one_of("name", name, self.names)
        return float(self.values[self.names.index(name)])


def identified(
    values: Mapping[str, float],
    provenance: Provenance,
    *,
    standard_errors: Mapping[str, float] | None = None,
    covariance: ArrayLike | None = None,
    effects: Sequence[Effect] = (),
    removed: Sequence[Effect] = (),
) -> Identified:
    """Return identified values after checking them.

    values
        Values by name (see `Identified`), in SI units.
    provenance
        Origin of the values.
    standard_errors
        Standard errors by name, in SI units; by default from ``covariance``, or NaN without one.
    covariance
        Covariance (n, n) in the order of ``values``.
    effects
        Effects found, with their parameters.
    removed
        Effects of the robot that the values contain already, so that they must leave its file.

    Raises InputError for values that are not finite and for negative standard errors. Raises InputError for a
    covariance that is not symmetric and positive semidefinite, has another size, or contradicts the standard
    errors. Raises InputError if values of effect parameters differ from those in ``effects``.
    """
    names = tuple(values)
    numbers = np.array([_number(f"values[{n!r}]", values[n]) for n in names])
    matrix = None if covariance is None else checked_covariance(covariance, len(names))
    errors = np.full(len(names), np.nan)
    if matrix is not None:
        errors = np.sqrt(np.diag(matrix))
    for name, error in (standard_errors or {}).items():
        if name not in names:
            raise InputError(f"standard_errors: expected names among values, got {name!r}")
        number = _number(f"standard_errors[{name!r}]", error)
        if number < 0:
            raise InputError(f"standard_errors[{name!r}]: expected no negative number, got {error}")
        place = names.index(name)
        if matrix is not None and not math.isclose(number, errors[place], rel_tol=1e-6):
            raise InputError(
                f"standard_errors[{name!r}]: expected {errors[place]} as the covariance has it, "
                f"got {number}"
            )
        errors[place] = number
    check_agreement(names, numbers, effects)
    return Identified(
        names, numbers, errors, provenance, matrix, tuple(effects), removed=tuple(removed)
    )


def identified_by_fit(
    fitted: Fitted, provenance: Provenance, *, effects: Sequence[Effect] = ()
) -> Identified:
    """Return the result of `axisight.fit` as identified values for `write_identified`.

    ``fitted`` gives the values, the standard errors and, if it is finite, the covariance. ``effects`` are the
    effects that were fitted as well; they get the fitted parameters. ``provenance`` is as in `identified`.
    Raises InputError for an effect parameter without its effect, and as `identified`.
    """
    values = dict(zip(fitted.names, fitted.values.tolist(), strict=True))
    updated = []
    for effect in effects:
        own = f"{effect.label}."
        new = {n.removeprefix(own): v for n, v in values.items() if n.startswith(own)}
        updated.append(effect.with_values(new))
    labels = [effect.label for effect in updated]
    for name in values:
        if "@" in name and name.rpartition(".")[0] not in labels:
            raise InputError(f"effects: expected the effect of {name!r}, got {labels}")
    known = bool(np.isfinite(fitted.covariance).all())
    errors = {
        n: s for n, s in zip(fitted.names, fitted.std.tolist(), strict=True) if np.isfinite(s)
    }
    return identified(
        values,
        provenance,
        standard_errors=None if known else errors,
        covariance=fitted.covariance if known else None,
        effects=updated,
    )


def _number(name: str, value: float) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise InputError(f"{name}: expected a number, got {value!r}") from None
    if isinstance(value, bool) or not math.isfinite(number):
        raise InputError(f"{name}: expected a finite number, got {value!r}")
    return number
