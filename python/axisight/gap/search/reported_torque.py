"""The controller's law decides where the motion alone cannot.

If a drive reports only a share of its torque, both controller gains seem off by that share, and the torque constant
by its inverse. On an axis that lifts, a heavier link explains the motion as well as such a constant. No link changes
the controller's gains, so these tell which one it is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from axisight.fitting.divergence import Diverged, must_hold
from axisight.gap.controller.torque_sensor import Asked, asked_of_motion
from axisight.gap.facts.algebraic_cause import AlgebraicCause
from axisight.gap.fit.fitted_model import FittedModel
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.fit.settling import settled
from axisight.gap.ranking.likelihood import clearly_worse
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis
from axisight.gap.screening.screening import kept_beside
from axisight.gap.search.state import Round, SearchState

# Greatest difference between a fitted torque constant and the one that the controller's gains ask for, and the odds
# that such an agreement gives. Errors of torque constants range over 10 % either way, so chance alone agrees within
# 1 % in a tenth of all cases.
_OFF = 0.01
_ODDS = 10.0
# Standard deviation of a torque constant that the controller's gains tell.
_KNOWN = 5e-4


def with_constants_told(
    found: SearchState, fitter: ModelFitter, shown: Sequence[AlgebraicCause]
) -> SearchState:
    """Return a search with the torque constant that reported shares ask for in the place of its rivals.

    ``shown``: what logs say of the controller by themselves. Where a cause of the axis, or of the arm,
    leaves such a constant as likely as itself, and a fit leaves no more with it; one that leads is surer.
    """
    told = asked_of_motion(shown)
    for cause, standing in found.accepted if told else ():
        rival = _told(standing, told)
        if rival is None:
            continue
        model = _in_its_place(fitter, found.model, cause, rival)
        if model is None or clearly_worse(model.total, found.model.total):
            continue
        model = _held(fitter, model, rival.trial.label, told)
        left = found.left()
        found.moved("reported_torque", model)
        weighed = standing.adjusted("reported_torque", {rival.trial.label: _ODDS})
        first = next(r for r in weighed.ranked if r.trial is rival.trial)
        led = weighed.led_by(first)
        found.rounds.append(Round((led,), ((first, led),), left))
    return found


def _told(standing: AxisPosterior, told: Mapping[str, Asked]) -> RankedHypothesis | None:
    """Return the cause, or its rival, that is what the controller's share asks for."""
    for one in standing.inseparable():
        asked = told.get(one.trial.label)
        if asked is not None and asked.off(one.trial.fitted.effects[-1]) < _OFF:
            return one
    return None


def _in_its_place(
    fitter: ModelFitter, model: FittedModel, cause: RankedHypothesis, rival: RankedHypothesis
) -> FittedModel | None:
    """Return a model with a rival in the place of one of its causes; None where it cannot be simulated."""
    new = rival.trial.fitted.free[-1]
    others = [f for f in model.free if f.effect.label != cause.trial.label]
    free = [*kept_beside(others, new), new]
    alone = len(free) == len(rival.trial.fitted.free)
    found = fitter.fit(free, rival.trial.fitted if alone else model, refreshes=1)
    if not isinstance(found, Diverged):
        found = settled(fitter, found.free, found)
    return None if isinstance(found, Diverged) else found


def _held(
    fitter: ModelFitter, model: FittedModel, label: str, told: Mapping[str, Asked]
) -> FittedModel:
    """Return a model with its torque constant where the controller's share has it."""
    values = told[label].effect.parameters or {}
    priors = {name: (value, _KNOWN) for name, value in values.items()}
    free = [
        replace(f.at(values), priors=priors) if f.effect.label == label else f for f in model.free
    ]
    return must_hold(fitter.fit(free, model, refreshes=1))
