"""Raises the floor of a machine that chatters: two of its runs differ by more than sensor noise.

A joint that knocks through its backlash, for example, takes another course at the smallest disturbance, or at a
change of a parameter by a thousandth. No simulator can come closer to a run than another run of the same machine does,
or a simulator whose formulas differ from nature by less than any formula does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from axisight.effects import effect_info
from axisight.gap.facts.axis_names import at_floor
from axisight.gap.facts.compared_quantity import torque_of
from axisight.gap.facts.simulator_variant import Variant
from axisight.gap.facts.wording import percent
from axisight.gap.measure.gap_figures import Stage, Stages
from axisight.gap.search.state import SearchState
from axisight.gap.views.view import View
from axisight.logs import Log

Array = NDArray[np.float64]

# Simulators with scattered numbers. A course that one in four takes is then seen by 90 %.
_DRAWS = 8
# Scatter of their numbers, as a share of the error of formulas.
_SCATTER = 0.1
# Share of the explainable error that the causes must remove if the simulator is kept on the validation logs. There it
# cannot drift onto another course, so chatter explains nothing.
_FOLLOWED = 0.95


def with_chance(
    view: View,
    found: SearchState,
    logs: Sequence[Log],
    stages: Stages,
    causes: Variant,
    measure: Callable[[Sequence[Array]], Stage],
) -> Stages:
    """Return the stages with the floor of the machine with its ``causes``, if that machine chatters.

    Unchanged in any of these cases:

    - The gap with the causes is at the floor.
    - Noise and a small scatter of its numbers move the machine with its causes no further, or further than the gap of
      the re-fitted simulator.
    - The causes do not explain ``logs`` if the simulator is kept on them.

    ``measure``: returns the stage of torque errors (n, n_axes) [Nm] of each log.
    """
    floor, after = (float(np.sqrt(s.mean())) for s in (stages.floor, stages.after))
    if not causes.effects or at_floor(after, floor):
        return stages
    runs = _apart(view, logs, causes, measure)
    apart = float(np.sqrt(runs.mean()))
    # A simulator that is closer than two runs are is on no other course.
    if (
        not runs.mean() < stages.refitted.mean()
        or at_floor(apart, floor)
        or not at_floor(apart, after)
    ):
        return stages
    return replace(stages, floor=runs) if view.followed(found, logs) >= _FOLLOWED else stages


def _apart(
    view: View, logs: Sequence[Log], causes: Variant, measure: Callable[[Sequence[Array]], Stage]
) -> Stage:
    """Return by how much runs with the ``causes`` differ: by noise, and by a scatter of their numbers if that is chaos.

    It is chaos where the torque moves by more than the error of formulas, ten times as far as the numbers. The draw
    that moves furthest counts, log by log, because each log has its own instants at which courses part.
    """
    noise = measure(view.noises(logs, len(view.logs), causes))
    here, settings = view.torques(causes, logs), view.settings
    scatter = _SCATTER * settings.model_error
    drawn = [_scattered(causes, scatter, [settings.seed, k]) for k in range(_DRAWS)]
    with ThreadPoolExecutor(settings.threads) as pool:
        others = pool.map(lambda variant: view.torques(variant, logs), drawn)
        moved = [measure([b - a for a, b in zip(here, x, strict=True)]) for x in others]
    furthest = tuple(
        max((m.blocks[k] for m in moved), key=lambda x: float(x.mean()))
        for k in range(len(noise.blocks))
    )
    apart = Stage(furthest, max(m.pooled for m in moved), noise.silent)
    if not apart.mean() > settings.model_error**2:
        return noise
    blocks = tuple(a + b for a, b in zip(noise.blocks, apart.blocks, strict=True))
    return Stage(blocks, float(np.hypot(noise.pooled, apart.pooled)), noise.silent)


def _scattered(variant: Variant, share: float, seed: Sequence[int]) -> Variant:
    """Return the simulator with each size moved by a normal random share of itself, within the effect's limits.

    Shapes stay: a thousandth of the order of a ripple is a turn over many waves.
    """
    rng = np.random.default_rng(seed)

    def moved(value: float) -> float:
        return value * (1.0 + share * float(rng.standard_normal()))

    own = {name: moved(value) for name, value in variant.robot_values.items()}
    effects = []
    for effect in variant.effects:
        sizes = {p.name: p for p in effect_info(effect.name).parameters if p.role == "amplitude"}
        values = {
            name: float(np.clip(moved(value), sizes[name].lower, sizes[name].upper))
            for name, value in (effect.parameters or {}).items()
            if name in sizes
        }
        effects.append(effect.with_values(values))
    return Variant(own, tuple(effects))


def chance_check(stages: Stages, judged: Stages) -> tuple[str, ...]:
    """Return a sentence on the difference of two runs if ``judged`` has another floor than ``stages``; else nothing."""
    if judged is stages:
        return ()
    apart = percent(float(np.sqrt(judged.floor.mean())))
    return (
        "With these causes the motion is chaotic: two runs of the validation logs differ by "
        f"{apart} of the {torque_of(stages.compared)} where noise or a thousandth of a parameter is all that differs. "
        f"No simulator can come closer. Kept on these logs, it explains at least {100 * _FOLLOWED:.0f} % of the gap.",
    )
