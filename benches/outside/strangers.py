"""What is in no library: walls, tones, tight spots, people, and cables across two joints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import exp, hypot, pi, sin

import numpy as np

from .friction import MotorFriction
from .gears import Gear
from .loop import Law
from .withheld import Place, Withheld


@dataclass
class JointTorque(Law):
    """Torques on the driven joints: ``law(t, q, v, out)`` adds to them [Nm]."""

    law: Callable

    def joint(self, t, q, v, out) -> None:
        self.law(t, q, v, out)


class Dropouts(Law):
    """The drive loses commands now and then: the last torque stays for some samples."""

    def __init__(self, axis: int, every: int, length: int, seed: int):
        self.axis, self.every, self.length = axis, every, length
        self.rng, self.left = np.random.default_rng(seed), 0

    def applied(self, u, w, h):
        out = u.copy()
        if self.left > 0:
            self.left -= 1
            out[self.axis] = self.kept
        else:
            self.kept = float(u[self.axis])
            if self.rng.random() < 1 / self.every:
                self.left = self.length
        return out


def wall(p: Place) -> Withheld:
    """Return a soft wall that the joint meets in a part of its travel (Hunt and Crossley)."""
    begin = p.middle_rad + 0.2 * p.travel_rad
    depth = 0.2 * p.travel_rad
    stiffness = p.amount(0.3, 0.8) * p.torque_nm / p.ratio / depth**1.5

    def law(t, q, v, out):
        into = q[p.axis] - begin
        if into > 0:
            out[p.axis] -= stiffness * into**1.5 * max(1 + 0.6 * v[p.axis], 0.0)

    return Withheld("wall", p.axis + 1, {"nm_rad15": stiffness}, [JointTorque(law)])


def tone(p: Place) -> Withheld:
    """Return a machine beside the arm that shakes it at its own frequency."""
    size, frequency = p.amount(0.1, 0.3) * p.torque_nm, p.rng.uniform(4, 9)

    def law(t, phi, w, load):
        return size * sin(2 * pi * frequency * t)

    parameters = {"size_nm": size, "frequency_hz": frequency}
    return Withheld("tone", p.axis + 1, parameters, [MotorFriction(p.axis, law)])


def late_brake(p: Place) -> Withheld:
    """Return a brake that begins to drag in the middle of each log."""
    level, width = p.amount(0.15, 0.4) * p.torque_nm, 0.01 * p.speed_rad_s

    def law(t, phi, w, load):
        return level * w / hypot(w, width) if t > 2.2 else 0.0

    return Withheld("late_brake", p.axis + 1, {"level_nm": level}, [MotorFriction(p.axis, law)])


def tight_spot(p: Place) -> Withheld:
    """Return friction at one place of the travel."""
    level, width = p.amount(0.3, 0.8) * p.torque_nm, 0.01 * p.speed_rad_s
    centre = p.middle_rad + p.rng.uniform(-0.15, 0.15) * p.travel_rad
    spread = 0.06 * p.travel_rad

    def law(t, phi, w, load):
        off = (phi * p.ratio - centre) / spread
        return level * exp(-off * off) * w / hypot(w, width)

    return Withheld("tight_spot", p.axis + 1, {"level_nm": level}, [MotorFriction(p.axis, law)])


def leaning(p: Place) -> Withheld:
    """Return somebody who leans on the arm for a second and lets go."""
    size, start = p.signed(0.3, 0.8) * p.torque_nm / p.ratio, p.rng.uniform(0.8, 2.0)

    def law(t, q, v, out):
        if start < t < start + 1.2:
            out[p.axis] += size * sin(pi * (t - start) / 1.2) ** 2

    return Withheld("leaning", p.axis + 1, {"size_nm": size}, [JointTorque(law)])


def strap(p: Place) -> Withheld:
    """Return an elastic strap across two joints: it pulls both by the sum of their angles."""
    stiffness = p.amount(0.6, 1.5) * p.torque_nm / p.ratio / p.travel_rad
    slack = float(p.arm.pose_rad[p.axis : p.axis + 2].sum())

    def law(t, q, v, out):
        torque = stiffness * max(q[p.axis] + q[p.axis + 1] - slack, 0.0)
        out[p.axis] -= torque
        out[p.axis + 1] -= torque

    return Withheld("strap", p.axis + 1, {"nm_rad": stiffness}, [JointTorque(law)])


def dropouts(p: Place) -> Withheld:
    """Return a drive that loses commands."""
    law = Dropouts(p.axis, 60, round(12 * p.size), int(p.rng.integers(1 << 30)))
    return Withheld("dropouts", p.axis + 1, {"substeps": 12 * p.size}, [law])


def cubic_damper(p: Place) -> Withheld:
    """Return a gear whose damping grows with the square of its rate."""
    joint = p.arm.joints[p.joint]
    rate = 2 * pi * 5 * p.deflection_rad
    cubic = p.amount(4.0, 12.0) * joint.damping / rate**2

    def law(delta, speed, phi, w):
        return joint.stiffness * delta + joint.damping * speed + cubic * speed**3

    return Withheld("cubic_damper", p.axis + 1, {"nm_s3": cubic}, [Gear(p.axis, law)])
