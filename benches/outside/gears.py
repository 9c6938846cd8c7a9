"""Gears of elastic arms: stiffness, play, hysteresis and errors of the transmission."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, exp, sin, tanh

import numpy as np

from .arms import Arm
from .loop import Law
from .withheld import Place, Withheld


@dataclass
class Gear(Law):
    """A gear torque of its own: ``law(deflection, rate, phi, w)`` [Nm], joint side."""

    axis: int
    law: Callable[[float, float, float, float], float]

    def gear(self, axis: int):
        return self.law if axis == self.axis else None


@dataclass
class Scaled(Law):
    """A gear of other stiffness or damping."""

    axis: int
    name: str
    change_1: float

    def change(self, arm: Arm) -> Arm:
        joint = arm.driven[self.axis]
        value = getattr(arm.joints[joint], self.name) * (1 + self.change_1)
        return arm.with_joint(joint, **{self.name: value})


class Slipping(Law):
    """A Dahl element beside the gear's spring, which it replaces in part."""

    def __init__(
        self, axis: int, share: float, distance_rad: float, stiffness: float, damping: float
    ):
        self.axis, self.share, self.distance_rad = axis, share, distance_rad
        self.stiffness, self.damping = stiffness, damping
        self.before, self.bend = 0.0, 0.0

    def _bent(self, delta: float) -> float:
        way = delta - self.before
        end = self.distance_rad * float(np.sign(way))
        return end + (self.bend - end) * exp(-abs(way) / self.distance_rad)

    def gear(self, axis: int):
        if axis != self.axis:
            return None

        def law(delta, rate, phi, w):
            spring = (1 - self.share) * delta + self.share * self._bent(delta)
            self.seen = delta
            return self.stiffness * spring + self.damping * rate

        return law

    def substep(self, t, h, phi, w, q, v) -> None:
        """Keep the deflection at the beginning of the substep; within it the way is monotonic."""
        delta = phi[self.axis] * self.ratio - q[self.axis]
        self.bend, self.before = self._bent(delta), delta


class GearWithError(Law):
    """A gear that leads and lags with the motor's angle; power is conserved."""

    needs_load = True

    def __init__(self, axis, order, cosine_rad, sine_rad, stiffness, damping):
        self.axis, self.order, self.c, self.s = axis, order, cosine_rad, sine_rad
        self.stiffness, self.damping = stiffness, damping

    def _slope(self, phi: float) -> float:
        n = self.order
        return n * (-self.c * sin(n * phi) + self.s * cos(n * phi))

    def gear(self, axis: int):
        if axis != self.axis:
            return None

        def law(delta, rate, phi, w):
            angle = self.order * phi
            error = self.c * cos(angle) + self.s * sin(angle)
            return self.stiffness * (delta + error) + self.damping * (rate + self._slope(phi) * w)

        return law

    def motor(self, t, phi, w, load, out) -> None:
        out[self.axis] -= self._slope(phi[self.axis]) * load[self.axis]


def _own(place: Place) -> tuple[float, float]:
    joint = place.arm.joints[place.joint]
    return joint.stiffness, joint.damping


def joint_stiffness(p: Place) -> Withheld:
    """Return a softer or stiffer gear."""
    change = float(np.clip(p.signed(0.12, 0.3), -0.5, 1.0))
    law = Scaled(p.axis, "stiffness", change)
    return Withheld("joint_stiffness", p.axis + 1, {"relative_change": change}, [law])


def joint_damping(p: Place) -> Withheld:
    """Return a gear of more or less damping."""
    change = float(np.clip(p.signed(0.6, 2.0), -0.7, 6.0))
    law = Scaled(p.axis, "damping", change)
    return Withheld("joint_damping", p.axis + 1, {"relative_change": change}, [law])


def backlash(p: Place) -> Withheld:
    """Return play whose flanks damp only where they touch, and never pull."""
    half = p.amount(0.1, 0.4) * p.deflection_rad
    stiffness, damping = _own(p)

    def law(delta, rate, phi, w):
        depth = abs(delta) - half
        if depth <= 0:
            return 0.0
        side = 1.0 if delta > 0 else -1.0
        # Damping sets in over a tenth of the gap, so that flanks meet without a jump of torque.
        damped = damping * min(depth / (0.1 * half), 1.0)
        return side * max(stiffness * depth + damped * rate * side, 0.0)

    return Withheld("backlash", p.axis + 1, {"half_width_rad": half}, [Gear(p.axis, law)])


def nonlinear_stiffness(p: Place) -> Withheld:
    """Return a spring with a cubic term."""
    stiffness, damping = _own(p)
    cubic = p.amount(0.02, 0.08) * stiffness / p.deflection_rad**2

    def law(delta, rate, phi, w):
        return stiffness * delta + cubic * delta**3 + damping * rate

    return Withheld(
        "nonlinear_stiffness", p.axis + 1, {"cubic_nm_rad3": cubic}, [Gear(p.axis, law)]
    )


def piecewise_stiffness(p: Place) -> Withheld:
    """Return a spring that is stiffer beyond a deflection, rounded by a softplus."""
    stiffness, damping = _own(p)
    knee, step = p.deflection_rad * p.rng.uniform(0.5, 1.2), min(p.amount(0.3, 0.8), 3.0)
    soft = 0.1 * knee

    def beyond(x):
        return soft * float(np.logaddexp(0.0, x / soft))

    def law(delta, rate, phi, w):
        more = beyond(delta - knee) - beyond(-delta - knee)
        return stiffness * (delta + step * more) + damping * rate

    parameters = {"step": step, "knee_rad": knee}
    return Withheld("piecewise_stiffness", p.axis + 1, parameters, [Gear(p.axis, law)])


def lost_motion(p: Place) -> Withheld:
    """Return a gear that is soft about zero, by a hyperbolic tangent."""
    stiffness, damping = _own(p)
    share, width = min(p.rng.uniform(0.4, 0.8), 0.9), p.amount(0.15, 0.4) * p.deflection_rad

    def law(delta, rate, phi, w):
        return stiffness * (delta - share * width * tanh(delta / width)) + damping * rate

    parameters = {"tanh_share": share, "tanh_width_rad": width}
    return Withheld("lost_motion", p.axis + 1, parameters, [Gear(p.axis, law)])


def gear_hysteresis(p: Place) -> Withheld:
    """Return a gear of which a part slips."""
    share, distance = min(p.amount(0.2, 0.4), 0.8), p.rng.uniform(0.3, 1.0) * p.deflection_rad
    law = Slipping(p.axis, share, distance, *_own(p))
    law.ratio = p.ratio
    parameters = {"dahl_share": share, "dahl_distance_rad": distance}
    return Withheld("gear_hysteresis", p.axis + 1, parameters, [law])


def transmission_error(p: Place) -> Withheld:
    """Return a gear that leads and lags once to four times a turn of the motor."""
    order = float(p.rng.choice([1.0, 2.0, 4.0]))
    size, phase = p.amount(0.03, 0.12) * p.deflection_rad, p.rng.uniform(0, 2 * np.pi)
    cosine, sine = size * np.cos(phase), size * np.sin(phase)
    law = GearWithError(p.axis, order, cosine, sine, *_own(p))
    parameters = {"order": order, "cosine_rad": cosine, "sine_rad": sine}
    return Withheld("transmission_error", p.axis + 1, parameters, [law])
