"""Start values of laws of dry friction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from axisight.effects.stated import BEHIND_GEAR, BRISTLES, LEAD
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.hypotheses.start_context import StartContext

SMOOTHING = 0.003
"""Smoothing of dry friction around zero speed, as a share of the top speed."""

TURNS_SLOWLY = 0.05
"""The same where positions are compared.

Positions do not show at which speed friction changes sign, and a law that changes within one sample chatters.
"""

# Stribeck speed, as a share of top speed.
_STRIBECK = 0.1
# Further starts of the Stribeck speed, as shares of the top speed: 0.001 to 0.1 by grease and load; more if slow.
_STRIBECK_STARTS = (0.003, 0.01, 0.03, 0.3)
# Pre-sliding distances as shares of the motor's travel: shorter ones look like dry friction, longer ones like a spring.
_YIELDING = (3e-4, 1.5e-3, 6e-3)


def dry_law(**shares: float) -> Callable[[StartContext], Hypothesis]:
    """Return starts at neutral values, also behind the gear; shape speeds are ``shares`` of the axis's top speed.

    Where the simulator moves in steps, dry friction is also tried as such simulators have it: ahead of the speed.
    """

    def start(trial: StartContext) -> Hypothesis:
        top = max(float(np.abs(x[trial.index].speed_rad_s).max()) for x in trial.at.turning) or 1.0
        found = {name: share * top for name, share in shares.items()}
        values = {p.name: p.neutral for p in trial.info.parameters} | found
        # All laws of dry friction may turn equally sharply.
        bounds = {k: (0.1 * min(v, SMOOTHING * top), 10 * v) for k, v in found.items()}
        starts: list[dict[str, float]] = [{BEHIND_GEAR: 1.0}] if BEHIND_GEAR in values else []
        if LEAD in values and trial.robot.stepped is not None:
            usual = next(p.typical for p in trial.info.parameters if p.name == LEAD)
            starts += [{LEAD: 0.0}, {LEAD: usual}]
        free = tuple(name for name in values if name != LEAD)
        return Hypothesis(trial.effect(values), free, bounds=bounds, starts=tuple(starts))

    return start


def by_direction(trial: StartContext) -> Hypothesis:
    """Start without a difference between the directions; the corner at zero speed is sharp and stays.

    Near zero speed this friction vanishes, so logs do not show its corner.
    """
    begin = dry_law(smoothing_rad_s=SMOOTHING)(trial)
    free = tuple(p.name for p in trial.info.parameters if p.role == "amplitude")
    return replace(begin, free=free, bounds={})


def stribeck(trial: StartContext) -> Hypothesis:
    """Start as a friction law with several Stribeck speeds; a fit does not move over decades of speed."""
    name = "stribeck_speed_rad_s"
    begin = dry_law(smoothing_rad_s=SMOOTHING, **{name: _STRIBECK})(trial)
    speed = float((begin.effect.parameters or {})[name])
    starts = tuple(
        {name: share / _STRIBECK * speed, **side}
        for share in _STRIBECK_STARTS
        for side in ({}, *begin.starts)
    )
    bounds = {**begin.bounds, name: (0.1 * starts[0][name], 10 * speed)}
    return replace(begin, bounds=bounds, starts=starts)


def presliding(trial: StartContext) -> Hypothesis:
    """Start with several pre-sliding distances, no break-away torque, and a relaxation time of one sample."""
    _, way, relaxation = BRISTLES
    travel = max(float(np.ptp(x[trial.index].angle_rad)) for x in trial.at.turning)
    starts = tuple({way: share * max(travel, 1e-3)} for share in _YIELDING)
    values = {p.name: p.neutral for p in trial.info.parameters} | starts[1]
    values[relaxation] = trial.robot.sample_time_s
    return Hypothesis(
        trial.effect(values),
        ("coulomb_nm", way, "bristle_time_s"),
        bounds={way: (0.5 * starts[0][way], 5 * starts[-1][way]), "bristle_time_s": (0.0, 0.1)},
        starts=(starts[0], starts[2]),
    )
