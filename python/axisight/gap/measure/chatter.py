"""Raises the floor of a machine that chatters: two of its runs differ by more than sensor noise.

A joint that knocks through its backlash, for example, takes another course at the smallest disturbance. No simulator
can come closer to a run than another run of the same machine does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.compared_quantity import torque_of
from axisight.gap.facts.simulator_variant import Variant
from axisight.gap.facts.wording import percent
from axisight.gap.measure.gap_figures import Stage, Stages
from axisight.gap.search.state import SearchState
from axisight.gap.views.view import View
from axisight.logs import Log

Array = NDArray[np.float64]

# Smallest ratio of mean squares: of the gap with the causes to the floor before chatter is considered, and of a
# chattering machine's noise to that floor.
_ABOVE = 1.1
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
    - Noise moves the machine with its causes no further, or further than the gap of the re-fitted simulator.
    - The causes do not explain ``logs`` if the simulator is kept on them.

    ``measure``: returns the stage of torque errors (n, n_axes) [Nm] of each log.
    """
    least = _ABOVE * stages.floor.mean()
    if not causes.effects or stages.after.mean() <= least:
        return stages
    runs = measure(view.noises(logs, len(view.logs), causes))
    if not least < runs.mean() < stages.refitted.mean():
        return stages
    return replace(stages, floor=runs) if view.followed(found, logs) >= _FOLLOWED else stages


def chance_check(stages: Stages, judged: Stages) -> tuple[str, ...]:
    """Return a sentence on the difference of two runs if ``judged`` has another floor than ``stages``; else nothing."""
    if judged is stages:
        return ()
    apart = percent(float(np.sqrt(judged.floor.mean())))
    return (
        f"With these causes the motion is chaotic: by noise alone two runs of the validation logs differ by {apart} "
        f"of the {torque_of(stages.compared)}, and no simulator can come closer. Kept on these logs, it explains at "
        f"least {100 * _FOLLOWED:.0f} % of the gap.",
    )
