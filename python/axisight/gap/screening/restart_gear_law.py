"""Starts gear laws from the torque-deflection curve that the fit of another law of the same gear found.

Laws with several parameters may lose only because their fit ended in a local minimum. Each law is therefore fitted
again from the point where its curve is closest to the leader's curve.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from axisight.effects import Effect, effect_info
from axisight.effects.gear_curves import CURVES, Curve
from axisight.fitting import robot_parameters
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis
from axisight.gap.ranking.fitted_hypothesis import FittedHypothesis
from axisight.gap.ranking.posterior import AxisPosterior, RankedHypothesis
from axisight.gap.screening.restart_look_alike import in_common
from axisight.robot import Robot

Array = NDArray[np.float64]

# Share of the leader's score above which a law needs no restart; start value of the damping in the backlash gap [1];
# number of torques at which curves are compared.
_NEAR = 0.998
_HALF = 0.5
_POINTS = 200
# Largest relative change of the stiffness beside a law [1], and the weight of that change beside an error of the
# deflection, both relative.
_OTHERS = 0.25
_HARDLY = 0.1
# A law can follow the leader's curve if at most this share of the curve's bend is left. A bend below 1 % of the largest
# deflection counts as straight.
_FOLLOWED = 0.5
_STRAIGHT = 0.01
# Range of deflections, in multiples of the linear spring's largest deflection, and number of grid points.
_WIDEST = 20.0
_FINE = 8_001


def begun_on_curves(
    standings: Sequence[AxisPosterior], led: set[str], options: Sequence[Hypothesis], robot: Robot
) -> list[tuple[FittedModel, Hypothesis, dict[str, float]]]:
    """Return the restarts on curves of leading laws that are not yet in ``led``; adds these leaders to ``led``.

    Each restart: the model whose last effect is replaced, the new hypothesis, and start values of the own parameters.
    """
    begun = []
    for standing in standings:
        law = best_law(standing)
        if law is not None and (label := _key_of_leader(law.trial)) not in led:
            led.add(label)
            others = others_of_its_gear(law, standing, options, robot)
            begun += [(law.trial.fitted, *other) for other in others]
    return begun


def best_law(standing: AxisPosterior) -> RankedHypothesis | None:
    """Return the gear law that explains most of its axis; None unless a law of that axis's gear leads it."""
    here = standing.axis + 1
    laws = [r for r in standing.ranked if r.trial.hypothesis.effect.axis == here and _is_law(r)]
    if standing.best not in laws:
        return None
    return max(laws, key=lambda r: r.score)


def _key_of_leader(law: FittedHypothesis) -> str:
    """Return the key of a leading law: its label and free parameters.

    Backlash with free gap damping counts as another law than backlash without.
    """
    return " ".join((law.label, *law.hypothesis.free))


def _is_law(one: RankedHypothesis) -> bool:
    return one.trial.hypothesis.effect.name in CURVES


def others_of_its_gear(
    best: RankedHypothesis, standing: AxisPosterior, options: Sequence[Hypothesis], robot: Robot
) -> list[tuple[Hypothesis, dict[str, float]]]:
    """Return the other laws of the same gear, started on the curve of ``best``, with starts of the own parameters.

    Returns nothing if the model already has another law of this gear: a second law only corrects the first. Laws that
    score nearly as much with sensitivities of their own are skipped.

    Backlash is first fitted with its gap damping free. If that fit leaves almost no error, the other laws are skipped:
    they have no corners and could only imitate it.
    """
    fitted, axis = best.trial.fitted, standing.axis + 1
    leader = fitted.effects[-1]
    name = robot.axis_parameter(axis, "stiffness")
    laws = [e for e in fitted.effects if e.axis == axis and e.name in CURVES]
    if laws != [leader] or name is None:
        return []
    near = _NEAR * best.score
    done = {r.trial.label for r in standing.ranked if r.score >= near and _is_final_fit(r.trial)}
    stiffness = fitted.robot_values.get(name, robot_parameters(robot)[name])
    if _held_first(leader.name):
        if not _is_final_fit(best.trial):
            options = [o for o in options if o.effect.name == leader.name]
        elif best.score >= _NEAR:
            return []
    begun = (
        on_the_curve(leader, _with_held_free(option, leader), stiffness)
        for option in options
        if option.effect.axis == axis and option.effect.label not in done
    )
    return [
        (found[0], {**fitted.robot_values, name: found[1] * stiffness})
        for found in begun
        if found is not None
    ]


def _is_final_fit(one: FittedHypothesis) -> bool:
    """Whether a fitted law has sensitivities of its own and all its parameters free."""
    return one.fitted.renewed and not _still_held(one.hypothesis)


def _held_first(name: str) -> tuple[str, ...]:
    """Return the parameters that the first fit of a law holds fixed, such as the damping in a backlash gap."""
    return effect_info(name).marked("held_first")


def _still_held(option: Hypothesis) -> list[str]:
    """Return those parameters of a candidate that are still held fixed."""
    return [name for name in _held_first(option.effect.name) if name not in option.free]


def _with_held_free(option: Hypothesis, leader: Effect) -> Hypothesis:
    """Return a law with its held parameters free, started at the leader's values; other laws unchanged."""
    held = _still_held(option)
    if not held:
        return option
    # A law without a gap has damping everywhere.
    begin = dict.fromkeys(held, 1.0)
    if leader.name == option.effect.name:
        begin = {name: (leader.parameters or {}).get(name) or _HALF for name in held}
    return replace(option.at(begin), free=(*option.free, *held))


def on_the_curve(
    leader: Effect, option: Hypothesis, stiffness_nm_rad: float
) -> tuple[Hypothesis, float] | None:
    """Return another law of the same gear, started where its curve is closest to that of ``leader``.

    The second value is the start of the spring's stiffness, as a factor of ``stiffness_nm_rad``, because the own
    parameters are fitted along. ``stiffness_nm_rad``: the re-fitted stiffness of the plain spring [Nm/rad]. Curves are
    compared without their mean deflection: no motor angle shows how far the mean torque, such as gravity, turns a gear.

    None if either effect is no gear law, if the deflections are unknown, or if the law cannot bend like the leader.
    """
    mine, other = CURVES.get(option.effect.name), CURVES.get(leader.name)
    reach = option.deflections_rad
    if mine is None or other is None or reach is None or reach[0] == reach[1]:
        return None
    top = max(map(abs, reach))
    grid = np.linspace(-_WIDEST * top, _WIDEST * top, _FINE)
    torque = np.linspace(*reach, _POINTS)

    def turned(law: Curve, values: Mapping[str, float], share: float = 1.0) -> Array:
        """Return the deflection (n_torques,) of a law, without its mean, per largest linear deflection."""
        held = np.maximum.accumulate(share * law(grid, values, share * stiffness_nm_rad))
        deflection = np.interp(torque, held, grid)
        return np.asarray((deflection - deflection.mean()) / top)

    wanted = turned(other, _named(leader))
    # A static curve does not depend on damping.
    free = [name for name in option.free if name not in _held_first(option.effect.name)]
    low, high = np.transpose([(1 - _OTHERS, 1 + _OTHERS), *(option.limits(n) for n in free)])
    scale = np.array([1.0, *_typical(option.effect, free)])
    values = _named(option.effect)

    def misfit(scaled: Array) -> Array:
        share, *found = scaled * scale
        off = turned(mine, {**values, **dict(zip(free, found, strict=True))}, share) - wanted
        # Of two equally good solutions, prefer the one that leaves the stiffness unchanged.
        return np.append(off, _HARDLY * (share - 1))

    # Values with the same quantity, such as the width of a knee for a soft middle, are taken over; the rest is
    # searched.
    starts = (in_common(leader, effect_info(option.effect.name)), {}, *option.starts)
    begun = [[1.0, *({**values, **start}[name] for name in free)] for start in starts]
    found = [
        least_squares(misfit, np.clip(b, low, high) / scale, bounds=(low / scale, high / scale))
        for b in begun
    ]
    closest = min(found, key=lambda r: float(r.cost))
    bend, left = (_rms_off_line(torque, x) for x in (wanted, closest.fun[:-1]))
    if left > max(_FOLLOWED * bend, _STRAIGHT):
        return None
    share, *best = (closest.x * scale).tolist()
    return option.at(dict(zip(free, best, strict=True))), share


def _rms_off_line(torque: Array, deflection: Array) -> float:
    """Return the rms distance of a deflection from a straight line over the torque."""
    centred = torque - torque.mean()
    line = centred * float(centred @ deflection) / float(centred @ centred)
    return float(np.std(deflection - line))


def _named(effect: Effect) -> dict[str, float]:
    names = (p.name for p in effect_info(effect.name).parameters)
    return dict(zip(names, effect.values(), strict=True))


def _typical(effect: Effect, names: Sequence[str]) -> Array:
    typical = {p.name: p.typical for p in effect_info(effect.name).parameters}
    return np.array([typical[name] for name in names])
