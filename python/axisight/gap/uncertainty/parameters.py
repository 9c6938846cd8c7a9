"""The parameters of a model with their names, units, bounds and priors, as a posterior states them."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect, effect_info
from axisight.fitting import Parameter
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.ranking.intervals import own_scatter_std, total_std
from axisight.gap.simulator.own_parameters import nominal_and_size, place_of
from axisight.posterior.parameter import PosteriorParameter, Prior, unit_of
from axisight.robot import Robot

Array = NDArray[np.float64]


def parameter_name(model: FittedModel, key: tuple[int | None, str]) -> str:
    """Return the name of a parameter in a posterior, from its key in a model."""
    place, name = key
    return name if place is None else f"{model.effects[place].label}.{name}"


def own_parameter(robot: Robot, p: Parameter) -> PosteriorParameter:
    """Return an own parameter of the simulator."""
    joint, quantity = p.name.rsplit(".", 1)
    axis = robot.axis_names.index(joint) + 1 if joint in robot.axis_names else None
    nominal, size = nominal_and_size(robot, p.name)
    centre, spread = (nominal, abs(size)) if p.prior is None else p.prior
    sliding = any(j.name == joint and j.prismatic for j in robot.joints)
    place = place_of(robot, p.name)
    return PosteriorParameter(
        name=p.name,
        unit=unit_of(quantity, sliding=sliding),
        kind="own",
        axis=axis,
        effect=None if place is None else place[0],
        quantity=quantity if place is None else place[1],
        neutral=nominal,
        lower=p.lower,
        upper=p.upper,
        prior=Prior("normal", centre, spread),
    )


def cause_parameter(robot: Robot, free: Hypothesis, name: str) -> PosteriorParameter:
    """Return a parameter of a cause, with its prior over machines, or that of the fit."""
    effect = free.effect
    info = effect_info(effect.name)
    known = next(p for p in info.parameters if p.name == name)
    spread = known.spread if known.prior == "log_normal" else known.typical
    centre = known.typical if known.prior == "log_normal" else known.neutral
    prior = Prior(known.prior, centre, spread)
    if name in free.priors:
        prior = Prior("normal", *free.priors[name])
    changes: tuple[str, Literal["absolute", "relative"]] | None = None
    if info.stands_for is not None and effect.axis is not None and name == info.parameters[0].name:
        own = robot.axis_parameter(effect.axis, info.stands_for[0])
        changes = None if own is None else (own, info.stands_for[1])
    return PosteriorParameter(
        name=f"{effect.label}.{name}",
        unit=known.unit.partition(" (")[0],
        kind="cause",
        axis=effect.first_axis,
        effect=effect.name,
        quantity=name,
        neutral=known.neutral,
        # Intervals of the verdict have these bounds, too; a fit may have narrower ones.
        lower=known.lower,
        upper=known.upper,
        prior=prior,
        axes=effect.axes,
        changes=changes,
    )


def formula_std(fitter: ModelFitter, model: FittedModel, std: Array) -> Array:
    """Return what the intervals of the verdict have beside the fit (p,): errors of formulas and own scatter.

    ``std`` (p,): standard errors of the fit, in the order of the model's parameters.
    """
    out = np.zeros(len(std))
    for i, (place, name) in enumerate(model.parameters):
        if place is None:
            continue
        effect, free = model.effects[place], model.free[place]
        whole = total_std(effect, free.free, {name: float(std[i])}, free.sure)[name]
        scatter = own_scatter_std(effect, fitter.tolerated) if name == _first(effect) else 0.0
        out[i] = np.sqrt(max(whole**2 - std[i] ** 2, 0.0) + scatter**2)
    return out


def _first(effect: Effect) -> str:
    return effect_info(effect.name).parameters[0].name


def standard_errors(model: FittedModel, parameters: list[PosteriorParameter]) -> Array:
    """Return the standard errors of the fit (p,); of a parameter that nothing determines, those of its prior."""
    out = np.array([model.std.get(key, np.inf) for key in model.parameters])
    for i in np.flatnonzero(~np.isfinite(out)):
        p = parameters[i]
        ends = p.prior.at(np.array([0.025, 0.975]), p.lower, p.upper)
        out[i] = float(np.ptp(ends)) / 4
    return out
