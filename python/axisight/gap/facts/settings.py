"""Settings of a diagnosis: what counts as scatter, as noise and as significant."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from types import MappingProxyType
from typing import Any

from axisight.display.summary import summarized
from axisight.robot import Robot

# Standard deviation of a simulator's own parameters, relative [1]. About one
# per cent in masses, stiffness and motor inertia, two in viscous friction, five
# in damping is ordinary scatter between machines of one type; a half more is
# allowed here so that such scatter is never called an effect.
DEFAULT_TOLERANCES: Mapping[str, float] = MappingProxyType(
    {
        "mass": 0.015,
        "inertia_scale": 0.02,
        "stiffness": 0.015,
        "damping": 0.08,
        "motor_inertia": 0.015,
        "viscous_friction": 0.03,
    }
)

KNOWN_AS = "viscous_friction"
"""Quantity whose tolerance is that of effects that a simulator states itself, dry friction first."""


@summarized
@dataclass(frozen=True)
class Settings:
    """Settings of a diagnosis.

    ``tolerances``: relative standard deviation of the simulator's parameters by
    quantity (``mass``) or name (``axis1.mass``, which comes first); what is left out is
    taken as exact. None: those that the robot file states, ``DEFAULT_TOLERANCES`` for
    others, and by name the standard errors of an identification beside the file. Gains of a controller of
    targets (``kp``, ``kd``; of a cascade ``kv``, ``kp``, ``ki``) are taken as exact unless they have one.
    ``model_error``: error of a perfect diagnosis relative to the torque spectrum (formulas differ from
    nature), part of the weight of residuals. ``bandwidth_hz``: residuals above
    are not used. ``block_s``: length of data blocks for cross-validation and
    bootstrap. ``max_causes``: forward selection stops there.
    A cause must remove at least ``smallest_gain`` from the mean square of the
    weighted residual (in units of noise plus model error), ``smallest_score`` of
    what is left to explain and ``smallest_share`` of what there was, by
    ``significance`` standard errors, or more where the false alarms of all
    candidates together would exceed ``false_alarms``. A mean square up to
    ``largest_scatter`` above the floor counts as scatter of the simulator.
    ``explained_share``: below it, the causes found do not explain the gap.
    ``cutoff_hz``: of the low-pass on motion and torque in inverse dynamics; None chooses it
    from the data. ``despite``: names of faults of the logs that would be refused, and are flagged
    only. ``time_limit_s``: the search stops after this time, counted from the start of the diagnosis, and what was
    found by then is reported; infinity is no limit. A limit that is not reached changes nothing.
    ``seed`` rules every random choice.
    """

    tolerances: Mapping[str, float] | None = None
    model_error: float = 0.01
    bandwidth_hz: float = 125.0
    block_s: float = 1.0
    max_causes: int = 40
    smallest_gain: float = 0.05
    largest_scatter: float = 0.3
    smallest_score: float = 0.1
    smallest_share: float = 0.005
    explained_share: float = 0.6
    significance: float = 3.0
    false_alarms: float = 0.05
    cutoff_hz: float | None = None
    despite: tuple[str, ...] = ()
    bootstrap: int = 1000
    seed: int = 0
    time_limit_s: float = 600.0
    threads: int = field(default_factory=lambda: os.cpu_count() or 1)

    def tolerances_of(self, robot: Robot) -> Mapping[str, float]:
        """Return the tolerances of a robot's parameters by quantity or name."""
        if self.tolerances is not None:
            return self.tolerances
        return {**DEFAULT_TOLERANCES, **robot.tolerances}

    def as_dict(self, robot: Robot) -> dict[str, Any]:
        """Return the settings by name as plain values, without those that change no result of a finished search."""
        effort = ("threads", "time_limit_s")
        names = [f.name for f in fields(self) if f.name not in effort]
        return {
            **{name: getattr(self, name) for name in names},
            "despite": list(self.despite),
            "tolerances": dict(self.tolerances_of(robot)),
        }
