"""Laws of friction at steady speed, by the equations of the table."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from axisight.effects.effect import Effect

Array = NDArray[np.float64]
Curve = Callable[[Array, Mapping[str, float]], Array]
# Speeds that are looked at, of the one over which friction falls.
_LOOKED_AT = np.geomspace(1e-3, 10.0, 200)


def _falling(v: Array, p: Mapping[str, float]) -> Array:
    excess = p["excess_nm"] * np.exp(-((v / p["stribeck_speed_rad_s"]) ** 2))
    return np.asarray((p["coulomb_nm"] + excess) * np.tanh(v / p["smoothing_rad_s"]))


CURVES: Mapping[str, Curve] = {"stribeck_friction": _falling}
"""Torque [Nm] by speed of the motor [rad/s] and parameters, of laws that rise towards standstill."""


def rise_over_high_speed(effect: Effect) -> float:
    """Return by how much friction is at most larger than at high speed, of that [1].

    Infinite where there is none at high speed.
    """
    values = effect.parameters or {}
    dry, excess = values["coulomb_nm"], values["excess_nm"]
    if dry <= 0:
        return float("inf") if excess > 0 else 0.0
    friction = CURVES[effect.name](_LOOKED_AT * values["stribeck_speed_rad_s"], values)
    return float(friction.max() / dry - 1.0)
