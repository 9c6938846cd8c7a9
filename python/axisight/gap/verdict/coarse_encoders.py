"""Coarse encoders: steps of a position as a cause that acts like noise.

The effect of the steps on the torque differs from run to run, so no simulator can repeat it: they raise the
floor. They are a cause where the simulator leaves no more than that floor, and the noise of the stated sensor
alone would leave much less.

By inverse dynamics the predicted torque hardly feels the steps, but the logs show them. Positions far coarser
than the stated sensor are a cause then too, one that makes no part of the gap.
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
    """Return a conclusion with the steps of encoders among its causes, and the share of the gap that each explains.

    *None* becomes *explained*. *Unknown* stays as it is, because the floor tells nothing there.
    ``steps`` (n_axes,): of positions [rad], zero where the sensor's noise is larger. ``logs``: validation
    logs, ``stages`` of them. Unchanged where no axis has steps that count.
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


_RAISES = "Their effect on the torque differs from run to run. It is part of the floor; no simulator removes it."


def _says(axis: int, step: float, does: str) -> str:
    return (
        f"Axis {axis + 1}: positions come in steps of {step:.4g} rad, larger than the noise of the stated sensor. "
        f"{does}"
    )
