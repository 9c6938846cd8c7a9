"""Laws of a gear begun on the curve of torque over deflection that the fit of another one found.

Of laws with several numbers one may lead because the others ended in a wrong valley. Every law is held
against the leader where its curve comes closest to that.
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

# Share of what the leader explains from which a law is where it belongs.
_NEAR = 0.998
_HALF = 0.5
_POINTS = 200
# By how much the stiffness may be another, and what that counts beside a deflection.
_OTHERS = 0.25
_HARDLY = 0.1
# A law bends as the leader does where it leaves no more than this share of the bend; less than a
# hundredth of the largest deflection is none.
_FOLLOWED = 0.5
_STRAIGHT = 0.01
# Deflections looked at, in the largest of the linear spring; and how finely.
_WIDEST = 20.0
_FINE = 8_001


def begun_on_curves(
    standings: Sequence[AxisPosterior], led: set[str], options: Sequence[Hypothesis], robot: Robot
) -> list[tuple[FittedModel, Hypothesis, dict[str, float]]]:
    """Return what begins on the curves of laws that were not among those that ``led``, which they join.

    Each with the model whose last effect it takes the place of, and with where the simulator's own
    parameters begin.
    """
    begun = []
    for standing in standings:
        law = best_law(standing)
        if law is not None and (label := _led_as(law.trial)) not in led:
            led.add(label)
            others = others_of_its_gear(law, standing, options, robot)
            begun += [(law.trial.fitted, *other) for other in others]
    return begun


def best_law(standing: AxisPosterior) -> RankedHypothesis | None:
    """Return the law of a gear that explains most of its axis, where one of its gear leads there."""
    here = standing.axis + 1
    laws = [r for r in standing.ranked if r.trial.hypothesis.effect.axis == here and _is_law(r)]
    if standing.best not in laws:
        return None
    return max(laws, key=lambda r: r.score)


def _led_as(law: FittedHypothesis) -> str:
    """Return what a law that leads is remembered by: play with what is damped in its gap is another."""
    return " ".join((law.label, *law.hypothesis.free))


def _is_law(one: RankedHypothesis) -> bool:
    return one.trial.hypothesis.effect.name in CURVES


def others_of_its_gear(
    best: RankedHypothesis, standing: AxisPosterior, options: Sequence[Hypothesis], robot: Robot
) -> list[tuple[Hypothesis, dict[str, float]]]:
    """Return the other laws of the gear of an axis, begun on the curve of the ``best``.

    Each with the values that the simulator's own parameters begin at.

    Those that explain as much with sensitivities of their own are where they belong; none where the model
    has a law of the gear already: another one mends that. Play is first fitted with what is damped in the
    gap free; the others have no corners, and come as close where they are nearly play themselves, which is
    needed only where it leaves something.
    """
    fitted, axis = best.trial.fitted, standing.axis + 1
    leader = fitted.effects[-1]
    name = robot.axis_parameter(axis, "stiffness")
    laws = [e for e in fitted.effects if e.axis == axis and e.name in CURVES]
    if laws != [leader] or name is None:
        return []
    near = _NEAR * best.score
    done = {r.trial.label for r in standing.ranked if r.score >= near and _in_place(r.trial)}
    stiffness = fitted.robot_values.get(name, robot_parameters(robot)[name])
    if _held_first(leader.name):
        if not _in_place(best.trial):
            options = [o for o in options if o.effect.name == leader.name]
        elif best.score >= _NEAR:
            return []
    begun = (
        on_the_curve(leader, _damped_too(option, leader), stiffness)
        for option in options
        if option.effect.axis == axis and option.effect.label not in done
    )
    return [
        (found[0], {**fitted.robot_values, name: found[1] * stiffness})
        for found in begun
        if found is not None
    ]


def _in_place(one: FittedHypothesis) -> bool:
    """Whether a fit of a law has sensitivities of its own, and all its numbers."""
    return one.fitted.renewed and not _still_held(one.hypothesis)


def _held_first(name: str) -> tuple[str, ...]:
    """Return the parameters of a law that first fits hold: of play what is damped in its gap."""
    return effect_info(name).marked("held_first")


def _still_held(option: Hypothesis) -> list[str]:
    """Return those of them that are not free."""
    return [name for name in _held_first(option.effect.name) if name not in option.free]


def _damped_too(option: Hypothesis, leader: Effect) -> Hypothesis:
    """Return play with what is damped in the gap free too, begun as the leader has it; other laws as they are."""
    held = _still_held(option)
    if not held:
        return option
    # Laws without a gap damp everywhere.
    begin = dict.fromkeys(held, 1.0)
    if leader.name == option.effect.name:
        begin = {name: (leader.parameters or {}).get(name) or _HALF for name in held}
    return replace(option.at(begin), free=(*option.free, *held))


def on_the_curve(
    leader: Effect, option: Hypothesis, stiffness_nm_rad: float
) -> tuple[Hypothesis, float] | None:
    """Return a law of the same gear begun where its curve comes closest to that of ``leader``.

    With the share of the stiffness that its spring begins with: parameters of the simulator are fitted beside it.
    What a gear is turned by the mean torque, such as that of gravity, no motor angle shows: curves count from there.
    None where either is no such law, nothing is known of the deflections, or the law cannot bend as the
    leader does. ``stiffness_nm_rad``: of the spring without laws, as it was re-fitted.
    """
    mine, other = CURVES.get(option.effect.name), CURVES.get(leader.name)
    reach = option.deflections_rad
    if mine is None or other is None or reach is None or reach[0] == reach[1]:
        return None
    top = max(map(abs, reach))
    grid = np.linspace(-_WIDEST * top, _WIDEST * top, _FINE)
    torque = np.linspace(*reach, _POINTS)

    def turned(law: Curve, values: Mapping[str, float], share: float = 1.0) -> Array:
        """Return how far a law turns under the torques, from where it is in the mean."""
        held = np.maximum.accumulate(share * law(grid, values, share * stiffness_nm_rad))
        deflection = np.interp(torque, held, grid)
        return np.asarray((deflection - deflection.mean()) / top)

    wanted = turned(other, _named(leader))
    # What is damped no curve shows.
    free = [name for name in option.free if name not in _held_first(option.effect.name)]
    low, high = np.transpose([(1 - _OTHERS, 1 + _OTHERS), *(option.limits(n) for n in free)])
    scale = np.array([1.0, *_typical(option.effect, free)])
    values = _named(option.effect)

    def misfit(scaled: Array) -> Array:
        share, *found = scaled * scale
        off = turned(mine, {**values, **dict(zip(free, found, strict=True))}, share) - wanted
        # Of two that do alike the one that leaves the stiffness as it is.
        return np.append(off, _HARDLY * (share - 1))

    # Of a knee the width of a soft middle is known; the rest is found from there.
    starts = (in_common(leader, effect_info(option.effect.name)), {}, *option.starts)
    begun = [[1.0, *({**values, **start}[name] for name in free)] for start in starts]
    found = [
        least_squares(misfit, np.clip(b, low, high) / scale, bounds=(low / scale, high / scale))
        for b in begun
    ]
    closest = min(found, key=lambda r: float(r.cost))
    bend, left = (_bend(torque, x) for x in (wanted, closest.fun[:-1]))
    if left > max(_FOLLOWED * bend, _STRAIGHT):
        return None
    share, *best = (closest.x * scale).tolist()
    return option.at(dict(zip(free, best, strict=True))), share


def _bend(torque: Array, deflection: Array) -> float:
    """Return how far a deflection is from a straight line over the torque, root mean square."""
    centred = torque - torque.mean()
    line = centred * float(centred @ deflection) / float(centred @ centred)
    return float(np.std(deflection - line))


def _named(effect: Effect) -> dict[str, float]:
    names = (p.name for p in effect_info(effect.name).parameters)
    return dict(zip(names, effect.values(), strict=True))


def _typical(effect: Effect, names: Sequence[str]) -> Array:
    typical = {p.name: p.typical for p in effect_info(effect.name).parameters}
    return np.array([typical[name] for name in names])
