"""Intervals of an effect's parameters: standard error of the fit and formula error, added in squares."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from axisight.effects import Effect, effect_info
from axisight.gap.facts.named_cause import NamedCause
from axisight.gap.facts.result import Interval
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.statistics.intervals import NORMAL_DEVIATIONS


def intervals(
    effect: Effect,
    free: Sequence[str],
    std: Mapping[str, float],
    sure: Mapping[str, tuple[float, float]] = MappingProxyType({}),
) -> dict[str, Interval]:
    """Return the 95 % intervals of the fitted parameters ``free``; ``std``: their standard errors in the fit.

    Intervals stay within the bounds of the effect: no speed is below zero. ``sure``: as in `Hypothesis`, the narrowest
    that an interval may be.
    """
    values = effect.parameters or {}
    bounds = {p.name: (p.lower, p.upper) for p in effect_info(effect.name).parameters}
    out = {}
    for name, deviation in total_std(effect, free, std, sure).items():
        spread = NORMAL_DEVIATIONS * deviation
        lower, upper = bounds[name]
        low, high = values[name] - spread, values[name] + spread
        out[name] = Interval(values[name], max(low, lower), min(high, upper))
    return out


def total_std(
    effect: Effect,
    free: Sequence[str],
    std: Mapping[str, float],
    sure: Mapping[str, tuple[float, float]] = MappingProxyType({}),
) -> dict[str, float]:
    """Return the standard deviations behind `intervals`, formula error included; arguments as there."""
    info = effect_info(effect.name)
    values = effect.parameters or {}
    neutral = {p.name: p.neutral for p in info.parameters if p.role == "amplitude"}
    share = info.formula.spread(len(free))
    out = {}
    for name in free:
        size = abs(values[name] - neutral.get(name, 0.0))
        known = max(std.get(name, 0.0), float(np.ptp(sure.get(name, 0.0))) / 2 / NORMAL_DEVIATIONS)
        out[name] = float(np.hypot(known, share * size))
    return out


def sureness(effect: Effect, fitted: Hypothesis, std: Mapping[str, float]) -> float:
    """Return by how many half-widths of its interval a fitted amplitude differs from what the simulator has.

    The largest over all amplitudes. At most one: the interval includes that the machine has no more than the simulator.
    Infinite if no amplitude of the effect was fitted. ``fitted``: the hypothesis that ``effect`` comes from.
    """
    table = {p.name: p for p in effect_info(effect.name).parameters if p.role == "amplitude"}
    found = intervals(effect, fitted.free, std, fitted.sure)
    shares = (
        _half_widths(found[name], fitted.stated.get(name, p.neutral))
        for name, p in table.items()
        if name in found
    )
    return max(shares, default=np.inf)


def _half_widths(found: Interval, nothing: float) -> float:
    """Return the distance of a value from ``nothing``, by the half-width of its interval.

    A bound of the effect may cut off one side of the interval.
    """
    half = max(found.value - found.low, found.high - found.value)
    return abs(found.value - nothing) / half if half > 0 else np.inf


def with_own_scatter(
    causes: Sequence[NamedCause], tolerated: Callable[[Effect], float]
) -> tuple[NamedCause, ...]:
    """Return the causes, with the tolerance of an own parameter in the interval of a cause that changes it.

    A heavy link may be a wrong mass or the scatter of its type. Logs cannot tell the two apart. ``tolerated``: the
    size of an effect up to which it is scatter, three standard deviations.
    """
    return tuple(_with_own_scatter(c, tolerated) for c in causes)


def _with_own_scatter(cause: NamedCause, tolerated: Callable[[Effect], float]) -> NamedCause:
    info = effect_info(cause.effect)
    if info.stands_for is None or cause.axis is None:
        return cause
    first = info.parameters[0]
    told = cause.parameters[first.name]
    effect = Effect(cause.effect, cause.axis, {first.name: told.value})
    scatter = own_scatter_std(effect, tolerated)
    low, high = (
        told.value + sign * float(np.hypot(reach - told.value, NORMAL_DEVIATIONS * scatter))
        for sign, reach in ((-1, told.low), (1, told.high))
    )
    wider = Interval(told.value, max(low, first.lower), min(high, first.upper))
    return replace(cause, parameters={**cause.parameters, first.name: wider})


def own_scatter_std(effect: Effect, tolerated: Callable[[Effect], float]) -> float:
    """Return the tolerance, one standard deviation, of the own parameter that an effect changes; zero without one.

    It belongs to the first parameter of the effect. ``tolerated`` as in `with_own_scatter`.
    """
    info = effect_info(effect.name)
    if info.stands_for is None or effect.axis is None:
        return 0.0
    scatter = tolerated(effect) / 3
    return scatter * (1 + effect.values()[0]) if info.stands_for[1] == "relative" else scatter
