"""Positions that come in steps: a cause that is noise.

What steps of an encoder do to the torque differs from run to run, and no simulator can repeat it: they raise
the floor. Where a simulator leaves no more than that floor, and the noise of its own sensor would leave
much less, the steps are what the gap is made of, or what is left of it beside other causes.

A torque that is predicted from the measured motion hardly feels them, but the logs show them: positions that
are far coarser than the stated sensor's lack something in the simulator, which makes none of this gap.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from axisight.effects import effect_info
from axisight.gap.facts.named_cause import NamedCause
from axisight.gap.facts.result import Interval
from axisight.gap.facts.settings import Settings
from axisight.gap.measure.gap_figures import Stage, Stages, gap_reduction
from axisight.gap.signals.encoder_steps import OF_A_STEP, as_effect
from axisight.gap.verdict.conclusion import Conclusion
from axisight.gap.verdict.controller_causes import NO_SHARE, SAYS
from axisight.gap.views.view import View
from axisight.logs import Log

Array = NDArray[np.float64]

# Squares of the floor over those that the stated sensor would leave, from where the steps make it.
_MOSTLY = 2.0
# Noise of steps over that of the stated sensor, from where it is another sensor.
_OTHER_SENSOR = 3.0
# Of steps that every log shows.
_SURE = 0.99


def with_coarse_encoders(
    conclusion: Conclusion,
    steps: Array,
    view: View,
    logs: Sequence[Log],
    stages: Stages,
    measure: Callable[[Sequence[Array]], Stage],
) -> tuple[Conclusion, list[Interval]]:
    """Return a conclusion with the steps of encoders among its causes, and what each explains of the gap.

    *Explained* by them instead of *none*. Where something is unknown, the floor tells nothing.
    ``steps`` (n_axes,): of positions [rad], where they exceed the sensor's noise. ``logs``: of validation,
    ``stages`` of them. Unchanged where nothing is made of steps.
    """
    if conclusion.verdict == "unknown" or not steps.any():
        return conclusion, []
    if view.feels_steps:
        quiet = measure(view.sensor_noises(logs, len(view.logs)))
        loud = np.mean(stages.floor.per_log(), axis=0) > _MOSTLY * np.mean(quiet.per_log(), axis=0)
        shares = {
            i: _share(i, stages, quiet, view.settings)
            for i in np.flatnonzero(steps * loud).tolist()
        }
    else:
        other = steps > _OTHER_SENSOR * np.sqrt(12.0) * view.robot.position_noise_std
        shares = dict.fromkeys(np.flatnonzero(other).tolist(), NO_SHARE)
    if not shares:
        return conclusion, []
    does = _RAISES if view.feels_steps else SAYS
    named = conclusion.with_causes_behind([_named(i, float(steps[i])) for i in shares])
    checks = [_says(i, float(steps[i]), does) for i in shares]
    return named.with_checks(checks), list(shares.values())


def _share(axis: int, stages: Stages, quiet: Stage, settings: Settings) -> Interval:
    """Return how much of the gap above the noise of the stated sensor the noise of steps is."""

    def of(stage: Stage) -> Stage:
        return replace(stage, blocks=tuple(b[:, [axis]] for b in stage.blocks))

    floor, still, given = of(stages.floor), of(quiet), of(stages.given)
    return gap_reduction(floor, still, given, still, draws=settings.bootstrap, seed=settings.seed)


def _named(axis: int, step: float) -> NamedCause:
    effect = as_effect(axis, step)
    info = effect_info(effect.name)
    value = Interval(step, step * (1 - OF_A_STEP), step * (1 + OF_A_STEP))
    values = dict.fromkeys(effect.parameters or {}, value)
    units = {p.name: p.unit for p in info.parameters}
    return NamedCause(info.name, effect.axis, _SURE, values, units, info.family, _SURE)


_RAISES = (
    "What they do to the torque no two runs repeat: the floor has it, and no simulator removes it."
)


def _says(axis: int, step: float, does: str) -> str:
    return (
        f"Axis {axis + 1}: positions come in steps of {step:.4g} rad, more than the noise of the stated "
        f"sensor. {does}"
    )
