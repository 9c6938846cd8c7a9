"""What is left to chance where the machine with its causes chatters.

A joint that knocks through its play, say, takes another course at the least disturbance. Two runs of
one motion on one machine then differ by far more than the noise of their sensors, and no simulator
can come closer to a run than another run does. Nor can it where the course hangs on the last percent of
the cause, which no formula has.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect, effect_info
from axisight.gap.compared import torque_of
from axisight.gap.headline import percent
from axisight.gap.howfar import Stage, Stages
from axisight.gap.search import Search
from axisight.gap.torques import Variant
from axisight.gap.view import View
from axisight.logs import Log

Array = NDArray[np.float64]

# Squares by which the gap with the causes may exceed the floor before anyone asks why, and by which
# noise on a machine that chatters has to exceed that on one which does not.
_ABOVE = 1.1
# Share of the explainable error that causes have to remove where a simulator is kept on the validation
# logs: there it does not stray, and chance explains nothing.
_FOLLOWED = 0.95
# The size of one cause differs by a percent from formula to formula: dead zones with round and sharp corners.
_SIZES = (0.99, 1.0, 1.01)


def with_chance(
    view: View,
    found: Search,
    logs: Sequence[Log],
    stages: Stages,
    causes: Variant,
    measure: Callable[[Sequence[Array]], Stage],
) -> Stages:
    """Return the stages with the floor of the machine with its ``causes``, where that chatters.

    Unchanged where the gap with them stands at the floor as it is, where neither noise nor another size of
    the causes by a percent makes more of itself on that machine, or one makes more than there was to explain,
    and where the causes do not hold on ``logs`` that the simulator is kept on.
    """
    least = _ABOVE * stages.floor.mean()
    if not causes.effects or stages.after.mean() <= least:
        return stages
    noises = view.noises(logs, len(view.logs), causes)
    runs = measure(noises)
    if runs.mean() <= least:
        courses = [view.torques(_with_sizes(causes, s), logs) for s in _SIZES]
        apart = (_apart(a, b, noises) for a, b in combinations(courses, 2))
        runs = max(map(measure, apart), key=lambda stage: float(stage.mean()))
    if not least < runs.mean() < stages.refitted.mean():
        return stages
    return replace(stages, floor=runs) if view.followed(found, logs) >= _FOLLOWED else stages


def _apart(one: Sequence[Array], other: Sequence[Array], noises: Sequence[Array]) -> list[Array]:
    return [noise + b - a for noise, a, b in zip(noises, one, other, strict=True)]


def _with_sizes(causes: Variant, size: float) -> Variant:
    """Return the machine with causes of another relative size, within the bounds of their numbers."""
    return replace(causes, effects=tuple(_resized(effect, size) for effect in causes.effects))


def _resized(effect: Effect, size: float) -> Effect:
    values = effect.parameters or {}
    sizes = [
        p for p in effect_info(effect.name).parameters if p.role == "amplitude" and p.name in values
    ]
    return effect.with_values(
        {p.name: min(max(size * values[p.name], p.lower), p.upper) for p in sizes}
    )


def chance_check(stages: Stages, judged: Stages) -> tuple[str, ...]:
    """Say how far two runs differ, where ``judged`` has another floor than ``stages``."""
    if judged is stages:
        return ()
    apart = percent(float(np.sqrt(judged.floor.mean())))
    return (
        f"With its causes the machine takes another course at the least disturbance: by noise, or by a "
        f"hundredth of the causes, two runs of the validation logs would differ by {apart} of the "
        f"{torque_of(stages.compared)}, and no simulator can come closer. Kept on these logs, it explains at "
        f"least {100 * _FOLLOWED:.0f} % of what there is to explain.",
    )
