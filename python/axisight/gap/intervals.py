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
    """Return the 95 % intervals of the fitted parameters ``free``, ``std`` those of the fit.

    Within what the effect takes: no speed is below zero, however little the data say of it.
    """
    info = effect_info(effect.name)
    values = effect.parameters or {}
    neutral = {p.name: p.neutral for p in info.parameters if p.role == "amplitude"}
    share = _LAW * len(free) if info.linear == "no" else _EXACT
    bounds = {p.name: (p.lower, p.upper) for p in info.parameters}
    out = {}
    for name in free:
        size = abs(values[name] - neutral.get(name, 0.0))
        spread = 1.96 * float(np.hypot(std.get(name, 0.0), share * size))
        lower, upper = bounds[name]
        low, high = values[name] - spread, values[name] + spread
        out[name] = Interval(values[name], max(low, lower), min(high, upper))
    return out
