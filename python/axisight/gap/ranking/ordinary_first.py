"""Puts what every machine has before what few have: friction and rotors before another arm or a rarer friction.

A model file often states no friction and no rotors. A fit of the arm alone then takes them up: a third of a metre of
wrist turns the inertia of two rotors into geometry, and drag takes the place of viscous friction. By inverse dynamics
the errors of axes add up, so that what an axis lacks can be added first, and the rest is judged by what is left.
"""

from __future__ import annotations

from collections.abc import Callable

from axisight.effects import Effect, effect_info, on_every_machine
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis


def ordinary_first(
    standing: AxisPosterior, fitter: ModelFitter, is_cause: Callable[[RankedHypothesis], bool]
) -> AxisPosterior:
    """Return the posterior without the leaders that give way to what every machine has and the simulator lacks.

    Effects of the arm give way, and so does another friction of the axis, which may still be added later. Unchanged in
    closed loop, and where nothing that the axis lacks is a cause. Other effects of the axis may lead.
    """
    if not fitter.adds_up:
        return standing
    lacked = (r for r in standing.ranked if is_lacked(r, standing.axis, fitter) and is_cause(r))
    first = next(lacked, None)
    if first is None or not _gives_way(standing.best, first, standing.axis, fitter):
        return standing
    ahead = standing.ranked[: standing.ranked.index(first)]
    gone = (r for r in ahead if _gives_way(r, first, standing.axis, fitter))
    return standing.without(*(r.trial.label for r in gone))


def _gives_way(
    one: RankedHypothesis, ordinary: RankedHypothesis, axis: int, fitter: ModelFitter
) -> bool:
    info = effect_info(one.trial.hypothesis.effect.name)
    if info.acts in ("arm", "base"):
        return True
    same = info.family == effect_info(ordinary.trial.hypothesis.effect.name).family
    return same and not is_lacked(one, axis, fitter)


def is_lacked(one: RankedHypothesis, axis: int, fitter: ModelFitter) -> bool:
    """Whether every machine has an effect on an axis (from 0), or a part of it, and the simulator states none of that.

    By inverse dynamics only: in closed loop an error of one axis shows on all.
    """
    effect = one.trial.hypothesis.effect
    if not fitter.adds_up or effect.axis != axis + 1:
        return False
    names = {effect.name, *effect_info(effect.name).parts}
    ordinary = (x for x in names if on_every_machine(x))
    return any(_none_stated(Effect(x, effect.axis), fitter) for x in ordinary)


def _none_stated(effect: Effect, fitter: ModelFitter) -> bool:
    robot, stands_for = fitter.robot, effect_info(effect.name).stands_for
    own = (
        None
        if stands_for is None or effect.axis is None
        else robot.axis_parameter(effect.axis, stands_for[0])
    )
    stated = own is not None and robot.parameters()[own] != 0
    return not stated and not any(e.label == effect.label for e in robot.effects if e.acts)
