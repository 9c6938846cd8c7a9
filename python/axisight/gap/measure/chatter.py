"""What is left to chance where the machine with its causes chatters.

A joint that knocks through its play, say, takes another course at the least disturbance. Two runs of
one motion on one machine then differ by far more than the noise of their sensors, and no simulator
can come closer to a run than another run does.
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

# Squares by which the gap with the causes may exceed the floor before anyone asks why, and by which
# noise on a machine that chatters has to exceed that on one which does not.
_ABOVE = 1.1
# Share of the explainable error that causes have to remove where a simulator is kept on the validation
# logs: there it does not stray, and chance explains nothing.
_FOLLOWED = 0.95


def with_chance(
    view: View,
    found: SearchState,
    logs: Sequence[Log],
    stages: Stages,
    causes: Variant,
    measure: Callable[[Sequence[Array]], Stage],
) -> Stages:
    """Return the stages with the floor of the machine with its ``causes``, where that chatters.

    Unchanged where the gap with them stands at the floor as it is, where noise makes no more of
    itself on that machine, or more than there was to explain, and where the causes do not hold on ``logs``
    that the simulator is kept on.
    """
    least = _ABOVE * stages.floor.mean()
    if not causes.effects or stages.after.mean() <= least:
        return stages
    runs = measure(view.noises(logs, len(view.logs), causes))
    if not least < runs.mean() < stages.refitted.mean():
        return stages
    return replace(stages, floor=runs) if view.followed(found, logs) >= _FOLLOWED else stages


def chance_check(stages: Stages, judged: Stages) -> tuple[str, ...]:
    """Say how far two runs differ, where ``judged`` has another floor than ``stages``."""
    if judged is stages:
        return ()
    apart = percent(float(np.sqrt(judged.floor.mean())))
    return (
        f"With these causes the motion is chaotic: by noise alone two runs of the validation logs differ by {apart} "
        f"of the {torque_of(stages.compared)}, and no simulator can come closer. Kept on these logs, it explains at "
        f"least {100 * _FOLLOWED:.0f} % of the gap.",
    )
