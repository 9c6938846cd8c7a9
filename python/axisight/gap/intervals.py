"""Intervals of an effect's parameters: what the fit leaves open, and how far formulas of one effect differ."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from axisight.effects import Effect, effect_info
from axisight.gap.result import Interval

# Standard deviations between formulas of one physical effect, as shares of a parameter's size: what
# a linear model holds is the same in all books, and only integrators differ; of a law with several
# numbers each makes up for what another formula says of the rest. From the development draws of the
# benchmark on a foreign engine (seeds 3 and 5).
_EXACT = 0.004
_LAW = 0.02


def intervals(effect: Effect, free: Sequence[str], std: dict[str, float]) -> dict[str, Interval]:
    """Return the 95 % intervals of the fitted parameters ``free``, ``std`` those of the fit."""
    info = effect_info(effect.name)
    values = effect.parameters or {}
    neutral = {p.name: p.neutral for p in info.parameters if p.role == "amplitude"}
    share = _LAW * len(free) if info.linear == "no" else _EXACT
    out = {}
    for name in free:
        size = abs(values[name] - neutral.get(name, 0.0))
        spread = 1.96 * float(np.hypot(std.get(name, 0.0), share * size))
        out[name] = Interval(values[name], values[name] - spread, values[name] + spread)
    return out
