"""Friction laws at steady speed, by the equations of the effect table."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from axisight.effects.effect import Effect

Array = NDArray[np.float64]
Curve = Callable[[Array, Mapping[str, float]], Array]
# Speeds at which the rise is looked for, relative to the Stribeck speed.
_LOOKED_AT = np.geomspace(1e-3, 10.0, 200)


def _falling(v: Array, p: Mapping[str, float]) -> Array:
    excess = p["excess_nm"] * np.exp(-((v / p["stribeck_speed_rad_s"]) ** 2))
    return np.asarray((p["coulomb_nm"] + excess) * np.tanh(v / p["smoothing_rad_s"]))


CURVES: Mapping[str, Curve] = {"stribeck_friction": _falling}
"""Friction [Nm] by motor speed [rad/s] and parameters, for laws that rise towards standstill."""


def rise_over_high_speed(effect: Effect) -> float:
    """Return the largest rise of friction above its high-speed value, as a share of that value [1].

    Infinite if friction vanishes at high speed and not below it.
    """
    values = effect.parameters or {}
    dry, excess = values["coulomb_nm"], values["excess_nm"]
    if dry <= 0:
        return float("inf") if excess > 0 else 0.0
    friction = CURVES[effect.name](_LOOKED_AT * values["stribeck_speed_rad_s"], values)
    return float(friction.max() / dry - 1.0)
