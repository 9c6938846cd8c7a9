"""The posterior of a finished diagnosis, from the models that its verdict leaves open."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect, effect_info
from axisight.gap.facts.result import Diagnosis
from axisight.gap.facts.simulator_variant import Variant
from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.simulator.own_parameters import nominal_and_size
from axisight.gap.uncertainty.between_runs import between_runs
from axisight.gap.uncertainty.covariance import bootstrap_std, covariance
from axisight.gap.uncertainty.evaluated import evaluated, own_fitter
from axisight.gap.uncertainty.held_out_torque import held_out_torque
from axisight.gap.uncertainty.parameters import (
    cause_parameter,
    formula_std,
    own_parameter,
    parameter_name,
    standard_errors,
)
from axisight.gap.uncertainty.rivals import WeighedModel, weighed_models
from axisight.gap.verdict.validated import Validated
from axisight.gap.views.view import View
from axisight.logs import Log
from axisight.posterior.parameter import DrivenAxis, PosteriorParameter, Simulated
from axisight.posterior.result import Posterior, PosteriorHypothesis
from axisight.posterior.settings import BOOTSTRAP_DRAWS
from axisight.robot import Robot

Array = NDArray[np.float64]


def posterior_of(
    found: Diagnosis, view: View, held_logs: Sequence[Log], seen: Validated
) -> Posterior:
    """Return the joint posterior of own parameters and causes.

    If the verdict has no causes, it is that of the re-fitted simulator.
    """
    state = seen.found
    parts = _Parts.of(found, seen)
    leading = state.model if found.causes else state.baseline
    fitter = own_fitter(view.fitter, leading)
    models, without = [WeighedModel(leading, 1.0)], parts.unfelt
    if found.causes:
        models, more = weighed_models(state, found.causes, fitter)
        without = {**without, **more}
    known: dict[str, PosteriorParameter] = {}
    total = sum(m.weight for m in models)
    at = evaluated(fitter, leading)
    hypotheses = []
    for k, one in enumerate(models):
        here = at if k == 0 else evaluated(fitter, one.model)
        hypotheses.append(parts.hypothesis(view, one.model, here, known, one.weight / total))
    names = [parameter_name(leading, key) for key in leading.parameters]
    deviations = bootstrap_std(at, draws=BOOTSTRAP_DRAWS, seed=view.settings.seed)
    out = Posterior(
        name=found.name,
        verdict=found.verdict,
        simulated=_simulated(view.robot),
        parameters=tuple(sorted(known.values(), key=lambda p: p.kind == "cause")),
        hypotheses=tuple(hypotheses),
        between_runs=tuple(
            x for x in between_runs(at, names, _same(view, leading)) if x.parameter in known
        ),
        bootstrap_std={n: s for n, s in zip(names, deviations.tolist(), strict=True) if n in known},
        without_values=without,
        seed=view.settings.seed,
        version=version("axisight"),
    )
    fitted = Variant(at.robot_values, hypotheses[0].effects)
    return replace(out, held_out=held_out_torque(view, held_logs, out, state.noise, fitted))


@dataclass(frozen=True)
class _Parts:
    """What a verdict makes of the fitted causes.

    - ``shown``: causes that no fit found, since the logs show them by themselves.
    - ``replaced``: labels of fitted causes in whose place the verdict names another.
    - ``unfelt``: causes that do not change the compared torque, with the reason why they have no values here.
    """

    shown: tuple[Effect, ...]
    replaced: frozenset[str]
    unfelt: dict[str, str]

    @classmethod
    def of(cls, found: Diagnosis, seen: Validated) -> _Parts:
        if not found.causes:
            return cls((), frozenset(), {})
        fitted = {f.effect.label for f in seen.found.model.free}
        acting = {e.label: e for e in seen.conclusion.effects}
        unfelt = [c.label for c in found.causes if c.label not in acting]
        return cls(
            tuple(e for label, e in acting.items() if label not in fitted),
            frozenset(fitted - acting.keys()),
            dict.fromkeys(
                unfelt, "the logs show it by itself, and it does not change the compared torque"
            ),
        )

    def hypothesis(
        self,
        view: View,
        model: FittedModel,
        at: FittedModel,
        known: dict[str, PosteriorParameter],
        weight: float,
    ) -> PosteriorHypothesis:
        """Return the Gaussian of one model, and add its parameters to those that are ``known``.

        ``at``: the model at its optimum, with fresh normal equations. Standard errors are those of the model.
        """
        own = {p.name: p for p in view.fitter.own}
        kept = [
            i
            for i, (place, _) in enumerate(model.parameters)
            if place is None or model.effects[place].label not in self.replaced
        ]
        listed = []
        for place, name in model.parameters:
            if place is None:
                listed.append(own_parameter(view.robot, own[name]))
            else:
                listed.append(cause_parameter(view.robot, model.free[place], name))
        std = standard_errors(model, listed)
        mean = np.array([_value(at, key) for key in model.parameters])
        more = formula_std(view.fitter, model, std)
        known |= {p.name: p for p in (listed[i] for i in kept) if p.name not in known}
        return PosteriorHypothesis(
            effects=(*self.shown, *(e for e in at.effects if e.label not in self.replaced)),
            weight=weight,
            names=tuple(listed[i].name for i in kept),
            mean=mean[kept],
            covariance=covariance(at, std)[np.ix_(kept, kept)],
            formula_std=more[kept],
        )


def _same(view: View, model: FittedModel) -> Array:
    """Return the error of formulas in every parameter (p,): estimates that differ by less count as the same.

    An own parameter has the relative error of a perfect simulator, as an identification has it.
    """
    std = np.array([model.std.get(key, 0.0) for key in model.parameters])
    out = formula_std(view.fitter, model, np.where(np.isfinite(std), std, 0.0))
    for i, (place, name) in enumerate(model.parameters):
        if place is None:
            out[i] = view.settings.model_error * nominal_and_size(view.robot, name)[1]
        elif name in effect_info(model.effects[place].name).marked("place"):
            # A place is no size that could vary: the share of friction behind a gear, say.
            out[i] = np.inf
    return out


def _value(model: FittedModel, key: tuple[int | None, str]) -> float:
    place, name = key
    if place is None:
        return model.robot_values[name]
    return float((model.effects[place].parameters or {})[name])


def _simulated(robot: Robot) -> Simulated:
    rows = zip(
        robot.axis_names,
        robot.gear_ratio.tolist(),
        robot.axis_is_prismatic,
        robot.axis_is_rigid,
        strict=True,
    )
    axes = tuple(
        DrivenAxis(name, ratio, sliding, not rigid) for name, ratio, sliding, rigid in rows
    )
    return Simulated(robot.name, robot.controller_kind, axes, dict(robot.parameters()))
