"""Puts what every machine has before what few have: friction and rotors before another arm or a rarer friction.

A model file often states no friction and no rotors. A fit of the arm alone then takes them up: a third of a metre of
wrist turns the inertia of two rotors into geometry, and drag takes the place of viscous friction. By inverse dynamics
the errors of axes add up, so that what an axis lacks can be added first, and the rest is judged by what is left.
"""

from __future__ import annotations

from collections.abc import Callable

from axisight.effects import Effect, effect_info, effect_table, on_every_machine
from axisight.gap.fit.model_fitter import ModelFitter
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis
from axisight.gap.simulator.own_parameters import has_unknown_constants
from axisight.gap.simulator.stated_amplitude import stated_amplitude


def ordinary_first(
    standing: AxisPosterior, fitter: ModelFitter, is_cause: Callable[[RankedHypothesis], bool]
) -> AxisPosterior:
    """Return the posterior without the leaders that give way to what every machine has and the simulator lacks.

    Effects of the arm give way, and so does another friction of the axis, which may still be added later. A composite
    gives way to its own part: its other part is judged beside what every machine has. Unchanged in closed loop, and
    where nothing that the axis lacks is a cause. Other effects of the axis may lead.
    """
    if not fitter.adds_up:
        return standing
    lacked = (r for r in standing.ranked if _comes_first(r, standing.axis, fitter) and is_cause(r))
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
    return same and not _comes_first(one, axis, fitter)


def _comes_first(one: RankedHypothesis, axis: int, fitter: ModelFitter) -> bool:
    """Whether every machine has an effect itself on an axis (from 0), and the simulator states none of it."""
    effect = one.trial.hypothesis.effect
    return on_every_machine(effect.name) and is_lacked(one, axis, fitter)


def is_lacked(one: RankedHypothesis, axis: int, fitter: ModelFitter) -> bool:
    """Whether every machine has an effect on an axis (from 0), or a part of it, and the simulator states none of that.

    By inverse dynamics only: in closed loop an error of one axis shows on all.
    """
    effect = one.trial.hypothesis.effect
    return effect.axis == axis + 1 and lacks(fitter, effect)


def lacks(fitter: ModelFitter, effect: Effect) -> bool:
    """Whether every machine has an effect, or a part of it, and the simulator states none of that; see `is_lacked`."""
    if not fitter.adds_up:
        return False
    names = {effect.name, *effect_info(effect.name).parts}
    ordinary = (x for x in names if on_every_machine(x))
    return any(_none_stated(Effect(x, effect.axis), fitter) for x in ordinary)


def unsaid(fitter: ModelFitter) -> frozenset[str]:
    """Return the names of effects of every machine of which the simulator says nothing, or the same of every axis.

    A model file leaves them out, or fills in a number. One that tells a law of friction by axis tells friction: another
    law of it would stand for what is missing of the first. Empty for a single axis, in closed loop, and where torque
    constants are unknown: the bodies tell the scale of torques there, and cannot be left free.
    """
    axes = fitter.robot.axis_numbers()
    if not fitter.adds_up or len(axes) < 2 or has_unknown_constants(fitter.robot, fitter.own):
        return frozenset()
    stated = {
        name: {stated_amplitude(Effect(name, axis), fitter.robot) for axis in axes}
        for name in effect_table()
        if on_every_machine(name)
    }
    told = {effect_info(name).family for name, values in stated.items() if len(values) > 1}
    return frozenset(name for name in stated if effect_info(name).family not in told)


def _none_stated(effect: Effect, fitter: ModelFitter) -> bool:
    return stated_amplitude(effect, fitter.robot) == 0
