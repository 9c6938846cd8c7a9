"""Parameters of a frequency-domain fit in the form of the compiled core."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from axisight.arguments import did_you_mean
from axisight.errors import InputError
from axisight.fitting import Parameter, robot_parameters
from axisight.robot import Robot

RANGE = 100.0
"""Bounds of a parameter without given bounds: its start divided and multiplied by this factor."""


@dataclass(frozen=True)
class Spec:
    """A parameter in the form of the compiled core."""

    name: str
    initial: float
    lower: float
    upper: float
    logarithmic: bool
    prior: tuple[float, float] | None
    frozen: bool


def specs(robot: Robot, parameters: Sequence[str | Parameter] | Mapping[str, float]) -> list[Spec]:
    """Return the parameters to fit; a bare name starts at the robot's value."""
    known = robot_parameters(robot)
    items: Sequence[str | Parameter | tuple[str, float]]
    if isinstance(parameters, str):
        raise InputError(f"parameters: expected a list or a dict of names, got {parameters!r}")
    items = list(parameters.items()) if isinstance(parameters, Mapping) else list(parameters)
    if not items:
        raise InputError("parameters: expected at least one, got none")
    out = [_spec(item, known) for item in items]
    names = [spec.name for spec in out]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise InputError(f"parameters: expected each name once, got {twice!r} twice")
    if all(spec.frozen for spec in out):
        raise InputError("parameters: expected at least one that is not frozen, got none")
    return out


def _spec(item: str | Parameter | tuple[str, float], known: Mapping[str, float]) -> Spec:
    if isinstance(item, Parameter):
        return _from_parameter(item, known)
    name, start = item if isinstance(item, tuple) else (item, known.get(item, np.nan))
    if name not in known:
        raise InputError(
            f"parameter {name!r}: expected one of {', '.join(known)}{did_you_mean(name, known)}"
        )
    if not isinstance(start, int | float | np.number) or not np.isfinite(start):
        raise InputError(f"{name}: expected a finite start, got {start!r}")
    start = float(start)
    if not is_positive(name):
        return Spec(name, start, start - 10.0, start + 10.0, False, None, False)
    if start <= 0:
        raise InputError(
            f"{name}: expected a start above zero (it is searched over its logarithm), got {start}"
        )
    return Spec(name, start, start / RANGE, start * RANGE, True, None, False)


def _from_parameter(item: Parameter, known: Mapping[str, float]) -> Spec:
    name = item.name
    if item.effect is not None:
        raise InputError(f"parameter {name!r}: expected a robot parameter, got one of an effect")
    if name not in known:
        raise InputError(
            f"parameter {name!r}: expected one of {', '.join(known)}{did_you_mean(name, known)}"
        )
    numbers = (item.initial, item.lower, item.upper, *(item.prior or ()))
    if np.isnan(numbers).any() or not np.isfinite(item.initial):
        raise InputError(f"{name}: expected finite numbers, got {numbers}")
    if not item.lower <= item.initial <= item.upper:
        raise InputError(
            f"{name}: expected a start between the bounds {item.lower} and {item.upper}, "
            f"got {item.initial}"
        )
    lower = item.lower
    if is_positive(name):
        if item.initial <= 0:
            raise InputError(
                f"{name}: expected a start above zero (it is searched over its logarithm), "
                f"got {item.initial}"
            )
        lower = max(lower, item.initial * 1e-6)
    if item.prior is not None and (
        item.prior[1] <= 0 or (is_positive(name) and item.prior[0] <= 0)
    ):
        raise InputError(f"{name}: expected a prior of positive deviation, got {item.prior}")
    prior = None if item.prior is None else (float(item.prior[0]), float(item.prior[1]))
    return Spec(
        name,
        float(item.initial),
        float(lower),
        float(item.upper),
        is_positive(name),
        prior,
        item.frozen,
    )


def is_positive(name: str) -> bool:
    """Return whether a parameter is positive by nature; all are, except centres of mass."""
    return not name.rsplit(".", 1)[-1].startswith("com_")
