"""Masses, springs and the stand of the arm."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import cos, pi, sin, sqrt

import numpy as np

from .arms import Arm, Joint, Link, rotation
from .loop import Law
from .withheld import Place, Withheld


@dataclass
class Changed(Law):
    """An arm of other parameters."""

    how: Callable[[Arm], Arm]

    def change(self, arm: Arm) -> Arm:
        return self.how(arm)


@dataclass
class Pull(Law):
    """A torque on one joint as a function of its angle [Nm]."""

    axis: int
    torque: Callable[[float], float]

    def joint(self, t, q, v, out) -> None:
        out[self.axis] += self.torque(q[self.axis])


class Swinging(Law):
    """An inertia on a spring and a damper, carried by a joint.

    Heun's method moves it once a substep, by the joint's angles at both of its ends; within the
    substep it moves on along a parabola.
    """

    def __init__(self, axis: int, inertia: float, frequency_hz: float, damping: float):
        self.axis, self.inertia, self.damping = axis, inertia, damping
        self.omega = 2 * pi * frequency_hz
        self.start_s: float | None = None

    def _pull(self, place: float, speed: float, angle: float, rate: float) -> float:
        """Return the acceleration of the inertia [rad/s^2]."""
        spring = self.omega**2 * (angle - place)
        return spring + 2 * self.damping * self.omega * (rate - speed)

    def substep(self, t, h, phi, w, q, v) -> None:
        angle, rate = q[self.axis], v[self.axis]
        if self.start_s is None:
            self.angle_rad, self.rate_rad_s = angle, rate
        else:
            self.angle_rad, self.rate_rad_s = self._after(h, angle, rate)
        self.start_s = t
        self.pulled = self._pull(self.angle_rad, self.rate_rad_s, angle, rate)

    def _after(self, h: float, angle: float, rate: float) -> tuple[float, float]:
        first = self.pulled
        place = self.angle_rad + h * self.rate_rad_s + h * h * first / 2
        second = self._pull(place, self.rate_rad_s + h * first, angle, rate)
        return place, self.rate_rad_s + h * (first + second) / 2

    def joint(self, t, q, v, out) -> None:
        if self.start_s is None:
            return
        past = t - self.start_s
        place = self.angle_rad + past * self.rate_rad_s + past * past * self.pulled / 2
        speed = self.rate_rad_s + past * self.pulled
        out[self.axis] -= self.inertia * self._pull(place, speed, q[self.axis], v[self.axis])


def _link(arm: Arm, axis: int) -> tuple[int, Link]:
    joint = arm.carrier(axis)
    return joint, arm.joints[joint].link


def motor_inertia(p: Place) -> Withheld:
    """Return a rotor that is heavier or lighter."""
    change = float(np.clip(p.signed(0.15, 0.4), -0.6, 2.0))

    def how(arm: Arm) -> Arm:
        return arm.with_joint(
            p.joint, motor_inertia=arm.joints[p.joint].motor_inertia * (1 + change)
        )

    return Withheld("motor_inertia", p.axis + 1, {"relative_change": change}, [Changed(how)])


def rotor_inertia(p: Place) -> Withheld:
    """Return a rotor that the robot file leaves out."""
    inertia = p.arm.joints[p.joint].motor_inertia
    return Withheld(
        "rotor_inertia",
        p.axis + 1,
        {"inertia_kg_m2": inertia},
        simulator=lambda arm: arm.with_joint(p.joint, motor_inertia=0.0),
    )


def payload(p: Place) -> Withheld:
    """Return a load on the last link, as a point mass away from its centre of mass."""
    last = len(p.arm.joints) - 1
    link = p.arm.joints[last].link
    mass = link.mass_kg * min(p.amount(0.1, 0.4), 1.0)
    at = link.com_m * p.rng.uniform(1.1, 1.6) + p.rng.uniform(-0.05, 0.05, 3)
    names = zip(("x_m", "y_m", "z_m"), at, strict=True)

    def how(arm: Arm) -> Arm:
        return arm.with_joint(last, link=arm.joints[last].link.with_point_mass(mass, at))

    return Withheld("payload", None, {"mass_kg": mass, **dict(names)}, [Changed(how)])


def link_mass(p: Place) -> Withheld:
    """Return a link that is heavier or lighter."""
    change = float(np.clip(p.signed(0.1, 0.3), -0.6, 2.0))

    def how(arm: Arm) -> Arm:
        joint, link = _link(arm, p.axis)
        return arm.with_joint(joint, link=replace(link, mass_kg=link.mass_kg * (1 + change)))

    return Withheld("link_mass", p.axis + 1, {"relative_change": change}, [Changed(how)])


def link_com(p: Place) -> Withheld:
    """Return a centre of mass elsewhere, in the plane that the joint turns."""
    plane = [i for i in range(3) if i != "xyz".index(p.arm.joints[p.joint].axis)]
    reach = max(0.2, float(np.linalg.norm(_link(p.arm, p.axis)[1].com_m)))
    shift = np.zeros(3)
    shift[plane] = p.rng.normal(size=2)
    shift *= min(p.amount(0.1, 0.3), 1.0) * reach / np.linalg.norm(shift)

    def how(arm: Arm) -> Arm:
        joint, link = _link(arm, p.axis)
        return arm.with_joint(joint, link=replace(link, com_m=link.com_m + shift))

    names = zip(("x_m", "y_m", "z_m"), shift, strict=True)
    parameters = {name: value for name, value in names if value != 0.0}
    return Withheld("link_com", p.axis + 1, parameters, [Changed(how)])


def link_inertia(p: Place) -> Withheld:
    """Return a link whose inertia about its centre of mass is larger or smaller."""
    change = float(np.clip(p.signed(0.2, 0.6), -0.7, 4.0))

    def how(arm: Arm) -> Arm:
        joint, link = _link(arm, p.axis)
        return arm.with_joint(
            joint, link=replace(link, inertia_kg_m2=link.inertia_kg_m2 * (1 + change))
        )

    return Withheld("link_inertia", p.axis + 1, {"relative_change": change}, [Changed(how)])


def joint_zero_offset(p: Place) -> Withheld:
    """Return an encoder whose zero is elsewhere."""
    offset = float(np.clip(p.signed(0.02, 0.06), -0.4, 0.4))

    def how(arm: Arm) -> Arm:
        zeros = arm.zeros_rad.copy()
        zeros[p.axis] += offset
        return replace(arm, zero_rad=zeros)

    return Withheld("joint_zero_offset", p.axis + 1, {"offset_rad": offset}, [Changed(how)])


def base_tilt(p: Place) -> Withheld:
    """Return a base that was not levelled."""
    about_x, about_y = (
        float(np.clip(p.signed(0.01, 0.04), -0.3, 0.3)),
        float(np.clip(p.signed(0.01, 0.04), -0.3, 0.3)),
    )
    turn = rotation("y", -about_y) @ rotation("x", -about_x)
    parameters = {"about_x_rad": about_x, "about_y_rad": about_y}
    law = Changed(lambda arm: replace(arm, gravity_m_s2=turn @ arm.gravity_m_s2))
    return Withheld("base_tilt", None, parameters, [law])


def base_compliance(p: Place) -> Withheld:
    """Return a base that rocks about x and y, as two elastic joints below the first axis."""
    gear = p.arm.joints[p.arm.driven[0]].stiffness
    about_x, about_y = p.amount(0.15, 0.5) / gear, p.amount(0.15, 0.5) / gear
    parameters = {"about_x_rad_nm": about_x, "about_y_rad_nm": about_y}

    def how(arm: Arm) -> Arm:
        rocks = tuple(
            Joint(f"rock_{axis}", (0.0, 0.0, 0.0), axis, None, 1 / c, 0.002 / c)
            for axis, c in (("x", about_x), ("y", about_y))
        )
        return replace(arm, joints=rocks + arm.joints)

    return Withheld("base_compliance", None, parameters, [Changed(how)])


def gravity_compensation(p: Place) -> Withheld:
    """Return a balancer: a spring of some free length between the joint and a point above it."""
    size, phase = (
        p.amount(0.15, 0.5) * max(p.torque_nm, abs(p.rest_nm)) / p.ratio,
        p.rng.uniform(-0.4, 0.4),
    )
    height, radius, free = 0.5, 0.12, 0.1

    def torque(q: float) -> float:
        length = sqrt(height**2 + radius**2 - 2 * height * radius * cos(q - phase))
        return -size * (1 - free / length) * sin(q - phase)

    parameters = {"spring_nm": size, "spring_at_rad": phase}
    return Withheld("gravity_compensation", p.axis + 1, parameters, [Pull(p.axis, torque)])


def cable_stiffness(p: Place) -> Withheld:
    """Return a cable that pulls the joint back."""
    stiffness = p.amount(0.15, 0.5) * p.torque_nm / p.ratio / p.travel_rad * 2
    at_zero = stiffness * p.rng.uniform(-0.2, 0.2)
    parameters = {"stiffness_nm_rad": stiffness, "at_zero_nm": at_zero}
    law = Pull(p.axis, lambda q: at_zero - stiffness * q)
    return Withheld("cable_stiffness", p.axis + 1, parameters, [law])


def extra_mode(p: Place) -> Withheld:
    """Return something on the joint that swings on a spring."""
    link = p.arm.joints[p.arm.carrier(p.axis)].link
    own = p.arm.joints[p.joint].motor_inertia / p.ratio**2 + link.inertia_kg_m2.trace() / 3
    inertia, frequency = min(p.amount(0.05, 0.15), 0.5) * own, p.rng.uniform(5, 12)
    damping = p.rng.uniform(0.02, 0.08)
    parameters = {"inertia_kg_m2": inertia, "frequency_hz": frequency, "damping": damping}
    law = Swinging(p.axis, inertia, frequency, damping)
    return Withheld("extra_mode", p.axis + 1, parameters, [law])
