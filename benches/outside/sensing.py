"""What encoders read, what the drive reports, and what the controller makes of it."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from .loop import Law
from .withheld import Place, Withheld


@dataclass
class PositionWaves(Law):
    """Errors of the position that repeat with the motor's angle: (order, cosine, sine) [rad]."""

    axis: int
    waves: list[tuple[float, float, float]]

    def measured(self, phi, q):
        out, angle = phi.copy(), phi[self.axis]
        for order, c, s in self.waves:
            out[self.axis] += c * np.cos(order * angle) + s * np.sin(order * angle)
        return out


class OffCentre(Law):
    """An encoder off centre on the joint; no error where the log begins."""

    def __init__(self, axis: int, cosine_rad: float, sine_rad: float, ratio: float):
        self.axis, self.cosine, self.sine, self.ratio = axis, cosine_rad, sine_rad, ratio
        self.start: float | None = None

    def measured(self, phi, q):
        angle = q[self.axis]
        error = self.cosine * np.cos(angle) + self.sine * np.sin(angle)
        if self.start is None:
            self.start = error
        out = phi.copy()
        out[self.axis] += (error - self.start) / self.ratio
        return out


@dataclass
class Steps(Law):
    """A coarse encoder: rounded to the nearest step, after the noise of the signal."""

    axis: int
    increment_rad: float

    def counted(self, y):
        out = y.copy()
        out[self.axis] = self.increment_rad * np.round(out[self.axis] / self.increment_rad)
        return out


class LateReading(Law):
    """Positions are read late; between samples by a straight line."""

    def __init__(self, axis: int, delay_s: float, period_s: float):
        self.axis, self.samples = axis, delay_s / period_s
        self.kept: deque[float] = deque()

    def measured(self, phi, q):
        whole, part = divmod(self.samples, 1.0)
        value = float(phi[self.axis])
        if not self.kept:
            self.kept.extend([value] * (int(whole) + 2))
        self.kept.append(value)
        self.kept.popleft()
        out = phi.copy()
        out[self.axis] = (1 - part) * self.kept[-1 - int(whole)] + part * self.kept[-2 - int(whole)]
        return out


@dataclass
class Reported(Law):
    """The drive reports ``gain`` times its torque, less an offset."""

    axis: int
    gain: float = 1.0
    offset_nm: float = 0.0

    def reported(self, u):
        out = u.copy()
        out[self.axis] = self.gain * out[self.axis] - self.offset_nm
        return out


@dataclass
class Gains(Law):
    """The controller has other gains."""

    axis: int
    proportional: float
    integral: float

    def change(self, arm):
        kp, ki = arm.kp.copy(), arm.ki.copy()
        kp[self.axis] *= 1 + self.proportional
        ki[self.axis] *= 1 + self.integral
        return replace(arm, kp=kp, ki=ki)


class SpeedFilter(Law):
    """The controller smooths the measured speed (backward Euler, first order)."""

    def __init__(self, axis: int, constant_s: float, period_s: float):
        self.axis, self.share, self.kept = axis, period_s / (period_s + constant_s), 0.0

    def speed(self, w):
        self.kept += self.share * (w[self.axis] - self.kept)
        out = w.copy()
        out[self.axis] = self.kept
        return out


class FeedForward(Law):
    """The controller feeds forward torque for acceleration and speed of its reference."""

    def __init__(self, axis: int, acceleration: float, speed: float, period_s: float):
        self.axis, self.acceleration, self.by_speed = axis, acceleration, speed
        self.period_s, self.before = period_s, None

    def command(self, u, w_ref):
        now = w_ref[self.axis]
        rate = 0.0 if self.before is None else (now - self.before) / self.period_s
        self.before = now
        out = u.copy()
        out[self.axis] += self.acceleration * rate + self.by_speed * now
        return out


@dataclass
class Clock(Law):
    """The machine meets its references early or late: its clock runs at another rate."""

    rate: float

    def references(self, w_ref, time_s):
        seen = np.clip((1 + self.rate) * time_s, time_s[0], time_s[-1])
        return np.stack([np.interp(seen, time_s, column) for column in w_ref.T], axis=1)


def resolver_ripple(p: Place) -> Withheld:
    """Return errors of a resolver, once and twice a turn or more often."""
    orders = sorted(p.rng.choice([1.0, 2.0, 4.0, 8.0], size=p.rng.integers(1, 3), replace=False))
    waves, parameters = [], {}
    for number, order in enumerate(orders, 1):
        size, phase = p.amount(0.5, 1.5) * 1e-3, p.rng.uniform(0, 2 * np.pi)
        waves.append((order, size * np.cos(phase), size * np.sin(phase)))
        parameters |= {
            f"order_{number}": order,
            f"cosine_{number}_rad": waves[-1][1],
            f"sine_{number}_rad": waves[-1][2],
        }
    return Withheld("resolver_ripple", p.axis + 1, parameters, [PositionWaves(p.axis, waves)])


def encoder_eccentricity(p: Place) -> Withheld:
    """Return an encoder off centre."""
    size, phase = min(p.amount(0.01, 0.04), 0.3), p.rng.uniform(0, 2 * np.pi)
    cosine, sine = size * np.cos(phase), size * np.sin(phase)
    parameters = {"cosine_rad": cosine, "sine_rad": sine}
    law = OffCentre(p.axis, cosine, sine, p.ratio)
    return Withheld("encoder_eccentricity", p.axis + 1, parameters, [law])


def position_quantization(p: Place) -> Withheld:
    """Return an encoder of 9 to 13 bits."""
    bits = int(p.rng.integers(12, 14)) - round(np.log2(p.size))
    increment = 2 * np.pi / 2**bits
    return Withheld(
        "position_quantization",
        p.axis + 1,
        {"increment_rad": increment},
        [Steps(p.axis, increment)],
    )


def sensor_delay(p: Place) -> Withheld:
    """Return positions that are read one or two samples late."""
    period = p.arm.sample_time_s
    delay = period * min(p.rng.uniform(0.7, 1.5) * p.size, 4.0)
    law = LateReading(p.axis, delay, period)
    return Withheld("sensor_delay", p.axis + 1, {"delay_s": delay}, [law])


def torque_sensor_gain(p: Place) -> Withheld:
    """Return a torque that is reported too large or too small."""
    error = float(np.clip(p.signed(0.05, 0.15), -0.6, 1.0))
    law = Reported(p.axis, gain=1 + error)
    return Withheld("torque_sensor_gain", p.axis + 1, {"relative_error": error}, [law])


def torque_sensor_offset(p: Place) -> Withheld:
    """Return a torque that is reported with an offset."""
    offset = p.signed(0.2, 0.6) * p.torque_nm
    law = Reported(p.axis, offset_nm=offset)
    return Withheld("torque_sensor_offset", p.axis + 1, {"offset_nm": offset}, [law])


def controller_gain(p: Place) -> Withheld:
    """Return a controller with other gains."""
    kp = float(np.clip(p.signed(0.15, 0.3), -0.5, 0.5))
    ki = float(np.clip(p.signed(0.2, 0.6), -0.6, 1.0))
    parameters = {"relative_proportional": kp, "relative_integral": ki}
    return Withheld("controller_gain", p.axis + 1, parameters, [Gains(p.axis, kp, ki)])


def velocity_filter(p: Place) -> Withheld:
    """Return a filter on the measured speed."""
    constant = p.amount(1.5, 4.0) * 1e-3
    law = SpeedFilter(p.axis, constant, p.arm.sample_time_s)
    return Withheld("velocity_filter", p.axis + 1, {"time_constant_s": constant}, [law])


def feedforward_missing(p: Place) -> Withheld:
    """Return torque that the real controller feeds forward."""
    joint = p.arm.joints[p.joint]
    acceleration = joint.motor_inertia * min(p.amount(0.2, 0.6), 1.2)
    speed = joint.viscous * p.amount(0.3, 1.0)
    parameters = {"acceleration_nm_s2_rad": acceleration, "speed_nm_s_rad": speed}
    law = FeedForward(p.axis, acceleration, speed, p.arm.sample_time_s)
    return Withheld("feedforward_missing", p.axis + 1, parameters, [law])


def clock_drift(p: Place) -> Withheld:
    """Return a clock of the machine that runs at another rate."""
    rate = float(np.clip(p.signed(5e-4, 2e-3), -8e-3, 8e-3))
    return Withheld("clock_drift", None, {"relative_rate": rate}, [Clock(rate)])
