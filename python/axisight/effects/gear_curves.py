"""Static gear laws: torque over deflection by the equations of the effect table, with sharp corners."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Curve = Callable[[Array, Mapping[str, float], float], Array]


def _play(x: Array, p: Mapping[str, float], _stiffness: float) -> Array:
    width = p["half_width_rad"]
    return x - np.clip(x, -width, width)


def _soft(x: Array, p: Mapping[str, float], _stiffness: float) -> Array:
    width, corner = p["half_width_rad"], p["rounding"] * p["half_width_rad"]
    middle = np.hypot(x + width, corner) - np.hypot(x - width, corner)
    scale = float(np.hypot(1.0, p["rounding"])) / 2
    return np.asarray(x - p["softness"] * scale * middle)


def _knee(x: Array, p: Mapping[str, float], _stiffness: float) -> Array:
    beyond = x - np.clip(x, -p["knee_rad"], p["knee_rad"])
    return (1 + p["within"]) * x + p["step"] * beyond


def _cube(x: Array, p: Mapping[str, float], stiffness: float) -> Array:
    return x + p["cubic_nm_rad3"] / stiffness * x**3


def _spring(x: Array, p: Mapping[str, float], _stiffness: float) -> Array:
    return (1 + p["relative_change"]) * x


CURVES: Mapping[str, Curve] = {
    "backlash": _play,
    "lost_motion": _soft,
    "piecewise_stiffness": _knee,
    "nonlinear_stiffness": _cube,
    "joint_stiffness": _spring,
}
"""Torque divided by stiffness [rad] by deflection [rad], parameters and stiffness [Nm/rad]; keys: effects."""
