"""A parameter of a posterior, and the driven axes to which parameters belong."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.display.summary import summarized

Array = NDArray[np.float64]
PriorKind = Literal["normal", "half_normal", "log_normal", "uniform"]


# Units of a robot's parameters, of a joint that turns and of one that slides; the others are relative.
_UNITS = {
    "mass": ("kg", "kg"),
    "com_x": ("m", "m"),
    "com_y": ("m", "m"),
    "com_z": ("m", "m"),
    "stiffness": ("Nm/rad", "N/m"),
    "damping": ("Nm s/rad", "N s/m"),
    "motor_inertia": ("kg m^2", "kg m^2"),
    "viscous_friction": ("Nm s/rad", "Nm s/rad"),
}


def unit_of(quantity: str, *, sliding: bool) -> str:
    """Return the unit of a parameter of a robot by the end of its name; ``1`` for a relative one.

    ``sliding``: whether its joint slides.
    """
    return _UNITS.get(quantity, ("1", "1"))[int(sliding)]


@dataclass(frozen=True)
class Prior:
    """Distribution of a parameter before the logs, truncated to the bounds of the parameter.

    ``centre`` and ``spread`` are in the unit of the parameter. ``spread`` of a log-normal prior is the standard
    deviation of the logarithm [1]. A uniform prior needs neither. ``half_normal`` is symmetric about ``centre``.
    """

    kind: PriorKind
    centre: float
    spread: float

    def at(self, share: Array, lower: float, upper: float) -> Array:
        """Return the quantiles of ``share`` (n,), each from 0 to 1, within the bounds ``lower`` to ``upper``."""
        if self.kind == "uniform":
            return np.asarray(lower + share * (upper - lower))
        logarithmic = self.kind == "log_normal"
        low, high = (self._standard(x, logarithmic) for x in (lower, upper))
        below, above = scipy.special.ndtr([low, high])
        z = scipy.special.ndtri(below + share * (above - below))
        if logarithmic:
            return np.asarray(self.centre * np.exp(self.spread * z))
        return np.asarray(np.clip(self.centre + self.spread * z, lower, upper))

    def _standard(self, bound: float, logarithmic: bool) -> float:
        if not logarithmic:
            return (bound - self.centre) / self.spread
        return math.log(bound / self.centre) / self.spread if bound > 0 else -math.inf


@summarized
@dataclass(frozen=True)
class PosteriorParameter:
    """One parameter of a posterior.

    - ``name``: name of the robot's parameter (``axis1.motor_inertia``), or ``effect@axis.parameter`` for a cause.
    - ``unit``: unit on the motor side, as in robot files and in the table of effects; ``1`` without one.
    - ``kind``: ``"own"`` for a parameter of the simulator, ``"cause"`` for one of a cause.
    - ``axis``: driven axis from 1; None for the whole arm, or for a joint without a motor.
    - ``effect``, ``quantity``: effect and parameter that hold the value in a simulation. For a parameter of
      `Robot.parameters`, ``effect`` is None and ``quantity`` is the end of its name.
    - ``neutral``: nominal value of an own parameter; value without the effect for a cause.
    - ``lower``, ``upper``: bounds of the effect, or of an own parameter in the fit. Samples stay within them.
    - ``changes``: own parameter that a cause changes, and how (``"absolute"`` or ``"relative"``).
    """

    name: str
    unit: str
    kind: Literal["own", "cause"]
    axis: int | None
    effect: str | None
    quantity: str
    neutral: float
    lower: float
    upper: float
    prior: Prior
    axes: tuple[int, int] | None = None
    changes: tuple[str, Literal["absolute", "relative"]] | None = None


@summarized
@dataclass(frozen=True)
class DrivenAxis:
    """What a training environment has to know of a driven axis.

    ``gear_ratio`` r [1]: joint angle over motor angle (m/rad of a slide without unit gear); ``sliding``: whether the
    joint is prismatic; ``elastic``: whether the simulator has a spring in its gear.
    """

    joint: str
    gear_ratio: float
    sliding: bool
    elastic: bool


@summarized
@dataclass(frozen=True)
class Simulated:
    """The simulator that a posterior belongs to: its axes, nominal parameters and controller.

    ``nominal``: values of `Robot.parameters` by name. ``controller``: its kind in robot files.
    """

    robot: str
    controller: str
    axes: tuple[DrivenAxis, ...]
    nominal: dict[str, float] = field(default_factory=dict)
