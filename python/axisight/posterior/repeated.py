"""Variation between runs and days, from repeats of one motion, in place of what the estimation logs say."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
import scipy

from axisight.arguments import instance
from axisight.effects.stated import CONSTANT_TORQUE, DRY_FRICTION, VISCOUS_FRICTION
from axisight.errors import InputError
from axisight.posterior.between_runs import BetweenRuns
from axisight.posterior.parameter import PosteriorParameter, Simulated
from axisight.posterior.result import Posterior
from axisight.posterior.settings import FALSE_ALARMS
from axisight.statistics.holm import holm

_SCHEMA = "axisight.repeat/1"
# Quantities of a comparison that a posterior has too; both are on the motor side.
_SHARED = (DRY_FRICTION[0], CONSTANT_TORQUE, VISCOUS_FRICTION)


class Comparison(Protocol):
    """A comparison of days that gives its document: `axisight.repeats.DayComparison`.

    The room of repeats builds on the diagnosis, which builds on this one, so it cannot be named here.
    """

    def to_dict(self) -> dict[str, Any]:
        """Return the document for JSON."""
        ...


def with_repeats(posterior: Posterior, comparison: Comparison | Mapping[str, Any]) -> Posterior:
    """Return the posterior with the variation between runs and days that repeats of one motion show.

    Dry friction, viscous friction and constant torque take their `BetweenRuns` from the comparison; both are on the
    motor side. The variance is that between days plus that between runs of one day, each beyond the noise within a
    run. A parameter varies if one of two tests says so: the F test of the days, or a chi-squared test of the scatter of
    runs against the noise within runs. All tests together have 5 % false alarms (Holm 1979). Other parameters keep what
    the estimation logs say, among them the inertia, which a load changes too.

    posterior
        Posterior of a diagnosis.
    comparison
        Result of `axisight.repeats.compare_days`, or the document that ``axisight repeat --json`` writes.

    Raises InputError for another document, for axes that the robot does not have, and for a comparison of which no
    parameter is one of the posterior.
    """
    known = instance("posterior", posterior, Posterior)
    try:
        document = comparison if isinstance(comparison, Mapping) else comparison.to_dict()
        found = _found(known, document)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"comparison: expected a document of {_SCHEMA}: {error!r}") from error
    if not found:
        raise InputError(
            "comparison: expected friction or a constant torque that the posterior has, got none in common; "
            f"the posterior has {', '.join(known.names)}"
        )
    kept = [x for x in known.between_runs if x.parameter not in found]
    return replace(known, between_runs=(*found.values(), *kept))


def _found(posterior: Posterior, document: Mapping[str, Any]) -> dict[str, BetweenRuns]:
    """Return the variation of every parameter that the comparison and the posterior share."""
    if document["schema"] != _SCHEMA:
        raise InputError(f"comparison: expected {_SCHEMA}, got {document['schema']!r}")
    axes = len(posterior.simulated.axes)
    freedom = len(document["runs"]) - len({one["day"] for one in document["runs"]})
    tested = [(one, _p_value(one, freedom)) for one in document["parameters"]]
    adjusted = holm(np.array([p for _, p in tested]))
    found = {}
    for (one, p), q in zip(tested, adjusted.tolist(), strict=True):
        if not 1 <= one["axis"] <= axes:
            raise InputError(
                f"comparison: expected axes from 1 to {axes}, as the robot of the posterior has, got {one['axis']}"
            )
        for target in posterior.parameters:
            factor = _factor(posterior.simulated, target, one)
            if factor is not None:
                found[target.name] = _entry(target, one, p, factor, varies=q <= FALSE_ALARMS)
    return found


def _entry(
    target: PosteriorParameter, one: Mapping[str, Any], p: float, factor: float, *, varies: bool
) -> BetweenRuns:
    runs = np.array([np.nan if x is None else x for x in one["runs"]], np.float64)
    parts = [_number(one[name]) for name in ("std_between_runs", "std_between_days")]
    std = factor * float(np.hypot(*np.nan_to_num(parts)))
    return BetweenRuns(
        parameter=target.name,
        std=std if varies else 0.0,
        p_value=p if np.isfinite(p) else None,
        varies=varies,
        by_log=tuple((factor * (runs - np.nanmean(runs))).tolist()),
    )


def _p_value(one: Mapping[str, Any], freedom: int) -> float:
    """Return the smaller p-value of two tests, times their number; NaN without repeats."""
    noise, scatter = _number(one["std_within_run"]), _number(one["std_of_run"])
    of_runs = np.nan
    if freedom > 0 and noise > 0 and np.isfinite(scatter):
        of_runs = float(scipy.special.chdtrc(freedom, freedom * (scatter / noise) ** 2))
    known = [p for p in (_number(one["p_value"]), of_runs) if np.isfinite(p)]
    return min(1.0, len(known) * min(known)) if known else np.nan


def _factor(
    simulated: Simulated, target: PosteriorParameter, one: Mapping[str, Any]
) -> float | None:
    """Return what a value of a comparison is multiplied by; None if the parameter is another."""
    quantity = str(one["name"]).rpartition(".")[2]
    if target.axis != one["axis"] or quantity not in _SHARED:
        return None
    if quantity == VISCOUS_FRICTION:
        return _viscous(simulated, target)
    same = (
        (target.effect, target.quantity) == DRY_FRICTION[:2]
        if quantity == DRY_FRICTION[0]
        else target.effect == CONSTANT_TORQUE
    )
    return 1.0 if same else None


def _viscous(simulated: Simulated, target: PosteriorParameter) -> float | None:
    """Return the factor of viscous friction: for the robot's parameter, or for a cause that changes it."""
    if target.changes is None and target.effect is not None:
        return None
    name, how = target.changes or (target.name, "absolute")
    if name.rpartition(".")[2] != "viscous_friction":
        return None
    if how == "absolute":
        return 1.0
    nominal = simulated.nominal.get(name, 0.0)
    return 1 / abs(nominal) if nominal else None


def _number(value: float | None) -> float:
    return np.nan if value is None else float(value)
