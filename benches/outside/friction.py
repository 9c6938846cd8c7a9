"""Friction of motors. Dry friction has its own sign function: w / hypot(w, v0)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import exp, hypot, sin

import numpy as np

from .arms import Arm
from .loop import Law
from .withheld import Place, Withheld


@dataclass
class MotorFriction(Law):
    """Torque against the motion of one motor: ``law(t, phi, w, load)`` [Nm]."""

    axis: int
    law: Callable[[float, float, float, float], float]
    needs_load: bool = False

    def motor(self, t, phi, w, load, out) -> None:
        i = self.axis
        out[i] -= self.law(t, phi[i], w[i], load[i] if self.needs_load else 0.0)


@dataclass
class Viscous(Law):
    """More viscous friction, by the engine's own damping."""

    axis: int
    added: float

    def change(self, arm: Arm) -> Arm:
        joint = arm.driven[self.axis]
        return arm.with_joint(joint, viscous=arm.joints[joint].viscous + self.added)


@dataclass
class Bristle(Law):
    """A Dahl bristle: z' = w - |w| z / yield, solved exactly over a substep of constant speed."""

    axis: int
    level_nm: float
    yield_rad: float
    bend: float = 0.0

    def substep(self, t, h, phi, w, q, v) -> None:
        way = w[self.axis] * h
        end = self.yield_rad * np.sign(way)
        self.bend = end + (self.bend - end) * exp(-abs(way) / self.yield_rad)

    def motor(self, t, phi, w, load, out) -> None:
        out[self.axis] -= self.level_nm * self.bend / self.yield_rad


def _withheld(place: Place, effect: str, law, loaded: bool = False, **parameters) -> Withheld:
    friction = MotorFriction(place.axis, law, loaded)
    return Withheld(effect, place.axis + 1, parameters, [friction])


def viscous_friction(p: Place) -> Withheld:
    """Return friction in proportion to speed."""
    added = p.amount(0.06, 0.25) * p.torque_nm / p.speed_rad_s
    name = "viscous_friction"
    return Withheld(name, p.axis + 1, {"viscous_nm_s_rad": added}, [Viscous(p.axis, added)])


def coulomb_friction(p: Place) -> Withheld:
    """Return dry friction."""
    level, width = p.amount(0.05, 0.25) * p.torque_nm, p.rng.uniform(0.004, 0.02) * p.speed_rad_s
    return _withheld(
        p, "coulomb_friction", lambda t, phi, w, load: level * w / hypot(w, width), coulomb_nm=level
    )


def stribeck_friction(p: Place) -> Withheld:
    """Return dry friction that rises towards standstill, by a rational law."""
    level, width = p.amount(0.05, 0.2) * p.torque_nm, p.rng.uniform(0.004, 0.01) * p.speed_rad_s
    excess, knee = level * p.rng.uniform(0.5, 1.2), p.rng.uniform(0.05, 0.2) * p.speed_rad_s

    def law(t, phi, w, load):
        return (level + excess / (1 + (w / knee) ** 2)) * w / hypot(w, width)

    return _withheld(p, "stribeck_friction", law, level=level, rational_excess=excess, knee=knee)


def asymmetric_friction(p: Place) -> Withheld:
    """Return dry friction that is larger in one direction."""
    width = p.rng.uniform(0.004, 0.02) * p.speed_rad_s
    small, large = np.array([1.0, p.rng.uniform(1.5, 3)]) * p.amount(0.05, 0.15) * p.torque_nm
    ahead, back = (small, large) if p.rng.random() < 0.5 else (large, small)

    def law(t, phi, w, load):
        return (ahead if w > 0 else back) * w / hypot(w, width)

    return _withheld(p, "asymmetric_friction", law, forward_nm=ahead, backward_nm=back)


def quadratic_drag(p: Place) -> Withheld:
    """Return friction with the square of speed."""
    drag = p.amount(0.06, 0.2) * p.torque_nm / p.speed_rad_s**2
    return _withheld(
        p, "quadratic_drag", lambda t, phi, w, load: drag * w * abs(w), drag_nm_s2_rad2=drag
    )


def position_dependent_friction(p: Place) -> Withheld:
    """Return dry friction with about one wave over the travel."""
    mean, width = p.amount(0.1, 0.25) * p.torque_nm, p.rng.uniform(0.004, 0.02) * p.speed_rad_s
    wave, phase = mean * p.rng.uniform(0.5, 0.9), p.rng.uniform(0, 2 * np.pi)
    order = p.ratio * 2 * np.pi / p.travel_rad * p.rng.uniform(0.8, 1.4)

    def law(t, phi, w, load):
        return (mean + wave * sin(order * phi + phase)) * w / hypot(w, width)

    return _withheld(p, "position_dependent_friction", law, mean_nm=mean, order=order)


def friction_warmup(p: Place) -> Withheld:
    """Return viscous friction that falls with time by a rational law."""
    cold, constant = (
        p.amount(0.15, 0.4) * p.torque_nm / p.speed_rad_s,
        p.rng.uniform(0.8, 2.0),
    )
    return _withheld(
        p, "friction_warmup", lambda t, phi, w, load: cold * w / (1 + t / constant), cold=cold
    )


def presliding_friction(p: Place) -> Withheld:
    """Return dry friction with a bristle that yields over some hundredths of a radian of the motor."""
    level, distance = p.amount(0.08, 0.25) * p.torque_nm, p.rng.uniform(0.03, 0.12)
    parameters = {"coulomb_nm": level, "presliding_rad": distance}
    law = Bristle(p.axis, level, distance)
    return Withheld("presliding_friction", p.axis + 1, parameters, [law])


def load_dependent_friction(p: Place) -> Withheld:
    """Return friction in proportion to the torque that the gear carries."""
    share, width, ratio = p.amount(0.03, 0.12), 0.01 * p.speed_rad_s, p.ratio

    def law(t, phi, w, load):
        return share * abs(load) * ratio * w / hypot(w, width)

    return _withheld(p, "load_dependent_friction", law, True, coefficient=share)


@dataclass
class SharedFriction(Law):
    """Friction of two motors by a sum of their speeds."""

    first: int
    ratio: float
    viscous: float
    level_nm: float
    width_rad_s: float

    def motor(self, t, phi, w, load, out) -> None:
        i = self.first
        s = w[i] + self.ratio * w[i + 1]
        torque = self.viscous * s + self.level_nm * s / hypot(s, self.width_rad_s)
        out[i] -= torque
        out[i + 1] -= self.ratio * torque


def axis_coupling(p: Place) -> Withheld:
    """Return friction that the axis shares with the next one."""
    level, ratio = p.amount(0.1, 0.3) * p.torque_nm, float(p.rng.choice([-1.0, 1.0]))
    viscous, width = 0.3 * level / p.speed_rad_s, 0.01 * p.speed_rad_s
    parameters = {"coulomb_nm": level, "viscous_nm_s_rad": viscous, "speed_ratio": ratio}
    law = SharedFriction(p.axis, ratio, viscous, level, width)
    axes = [p.axis + 1, p.axis + 2]
    return Withheld("axis_coupling", p.axis + 1, parameters, [law], axes=axes)
