"""The path from command to torque: constants, limits, lags, ripple."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import cos, sin

import numpy as np

from .loop import Law
from .withheld import Place, Withheld


@dataclass
class Gain(Law):
    """The motor delivers ``1 + error`` of its command."""

    axis: int
    error: float

    def applied(self, u, w, h):
        out = u.copy()
        out[self.axis] *= 1 + self.error
        return out

    def settled(self, torque):
        out = torque.copy()
        out[self.axis] /= 1 + self.error
        return out


@dataclass
class Offset(Law):
    """A constant torque beside the command."""

    axis: int
    offset_nm: float

    def applied(self, u, w, h):
        out = u.copy()
        out[self.axis] += self.offset_nm
        return out

    def settled(self, torque):
        out = torque.copy()
        out[self.axis] -= self.offset_nm
        return out


@dataclass
class Limit(Law):
    """The drive limits the torque and reports what is left."""

    axis: int
    limit_nm: float

    def command(self, u, w_ref):
        out = u.copy()
        out[self.axis] = np.clip(out[self.axis], -self.limit_nm, self.limit_nm)
        return out


@dataclass
class Deadband(Law):
    """Nothing for small commands, too little for others."""

    axis: int
    width_nm: float

    def applied(self, u, w, h):
        out = u.copy()
        out[self.axis] -= np.clip(out[self.axis], -self.width_nm, self.width_nm)
        return out

    def settled(self, torque):
        out = torque.copy()
        if out[self.axis] != 0.0:
            out[self.axis] += np.sign(out[self.axis]) * self.width_nm
        return out


class Linear(Law):
    """A linear filter of one command: x' = A x + B u, torque x[0]; means over the substeps are exact."""

    def __init__(self, axis: int, a: np.ndarray, b: np.ndarray):
        self.axis, self.a, self.b = axis, a, b
        self.state: np.ndarray | None = None

    def _matrices(self, h: float) -> np.ndarray:
        n = len(self.b)
        whole = np.zeros((n + 2, n + 2))  # state, input, integral of the torque
        whole[:n, :n], whole[:n, n], whole[n + 1, 0] = self.a, self.b, 1.0
        term, total = np.eye(n + 2), np.eye(n + 2)
        scaled = whole * h / 2**12
        for order in range(1, 8):
            term = term @ scaled / order
            total = total + term
        for _ in range(12):
            total = total @ total
        return total

    def applied(self, u, w, h):
        value = u[self.axis]
        if self.state is None:
            self.state = -np.linalg.solve(self.a, self.b) * value
            self.step = self._matrices(h)
        after = self.step @ np.concatenate([self.state, [value, 0.0]])
        self.state = after[:-2]
        out = u.copy()
        out[self.axis] = after[-1] / h
        return out


class Late(Law):
    """Commands act late by any time: the mean of the delayed command over each substep."""

    def __init__(self, axis: int, delay_s: float):
        self.axis, self.delay_s = axis, delay_s
        self.kept: deque[float] = deque()

    def applied(self, u, w, h):
        whole, part = divmod(self.delay_s / h, 1.0)
        value = float(u[self.axis])
        length = int(whole) + 2
        if not self.kept:
            self.kept.extend([value] * length)
        self.kept.append(value)
        self.kept.popleft()
        out = u.copy()
        out[self.axis] = (1 - part) * self.kept[-1 - int(whole)] + part * self.kept[-2 - int(whole)]
        return out


@dataclass
class Sag(Law):
    """The supply sags with the power drawn: torque less by an exponential of it."""

    axis: int
    sag_1_w: float

    def applied(self, u, w, h):
        out = u.copy()
        i = self.axis
        out[i] *= np.exp(-self.sag_1_w * max(out[i] * w[i], 0.0))
        return out


@dataclass
class Ripple(Law):
    """Torque waves over the motor angle: (order, cosine, sine) [Nm]."""

    axis: int
    waves: list[tuple[float, float, float]]

    def motor(self, t, phi, w, load, out) -> None:
        angle = phi[self.axis]
        for order, c, s in self.waves:
            out[self.axis] += c * cos(order * angle) + s * sin(order * angle)


def torque_constant(p: Place) -> Withheld:
    """Return a motor that is stronger or weaker than stated."""
    error = float(np.clip(p.signed(0.05, 0.15), -0.6, 1.0))
    return Withheld("torque_constant", p.axis + 1, {"relative_error": error}, [Gain(p.axis, error)])


def torque_offset(p: Place) -> Withheld:
    """Return a constant torque."""
    offset = p.signed(0.2, 0.6) * p.torque_nm
    return Withheld("torque_offset", p.axis + 1, {"offset_nm": offset}, [Offset(p.axis, offset)])


def torque_saturation(p: Place) -> Withheld:
    """Return a limit above what holds the arm and below the largest torque."""
    limit = abs(p.rest_nm) + p.peak_nm * p.rng.uniform(0.45, 0.7) / p.size
    return Withheld("torque_saturation", p.axis + 1, {"limit_nm": limit}, [Limit(p.axis, limit)])


def torque_deadband(p: Place) -> Withheld:
    """Return a drive that does nothing for small commands."""
    width = p.amount(0.04, 0.15) * p.torque_nm
    return Withheld("torque_deadband", p.axis + 1, {"width_nm": width}, [Deadband(p.axis, width)])


def actuator_bandwidth(p: Place) -> Withheld:
    """Return a lag of first order."""
    constant = p.amount(1.0, 3.0) * 1e-3
    law = Linear(p.axis, np.array([[-1 / constant]]), np.array([1 / constant]))
    return Withheld("actuator_bandwidth", p.axis + 1, {"time_constant_s": constant}, [law])


def current_loop(p: Place) -> Withheld:
    """Return a lag of second order that overshoots."""
    constant, damping = p.amount(1.2, 2.5) * 1e-3, p.rng.uniform(0.3, 0.6)
    a = np.array([[0.0, 1.0], [-1 / constant**2, -2 * damping / constant]])
    law = Linear(p.axis, a, np.array([0.0, 1 / constant**2]))
    parameters = {"time_constant_s": constant, "damping": damping}
    return Withheld("current_loop", p.axis + 1, parameters, [law])


def input_delay(p: Place) -> Withheld:
    """Return commands that act some milliseconds late."""
    delay = p.amount(1.0, 3.0) * 1e-3
    return Withheld("input_delay", p.axis + 1, {"delay_s": delay}, [Late(p.axis, delay)])


def power_supply_sag(p: Place) -> Withheld:
    """Return a supply that sags under load."""
    sag = p.amount(0.05, 0.2) / (p.torque_nm * p.speed_rad_s)
    return Withheld("power_supply_sag", p.axis + 1, {"exponential_1_w": sag}, [Sag(p.axis, sag)])


def torque_ripple(p: Place) -> Withheld:
    """Return cogging of one or two orders."""
    orders = sorted(
        p.rng.choice([1.0, 2.0, 4.0, 6.0, 12.0], size=p.rng.integers(1, 3), replace=False)
    )
    waves, parameters = [], {}
    for number, order in enumerate(orders, 1):
        size, phase = p.amount(0.04, 0.15) * p.torque_nm / number, p.rng.uniform(0, 2 * np.pi)
        waves.append((order, size * np.cos(phase), size * np.sin(phase)))
        parameters |= {
            f"order_{number}": order,
            f"cosine_{number}_nm": waves[-1][1],
            f"sine_{number}_nm": waves[-1][2],
        }
    return Withheld("torque_ripple", p.axis + 1, parameters, [Ripple(p.axis, waves)])
