"""Formulas that a machine follows in the engine on Pinocchio.

Friction, springs, gears and resolvers follow other formulas than in `laws`. Offsets, limits, reports and
delays have only one formula.

A formula acts on one axis of many runs at once. It returns the torques on motor and joint at any moment of a
step, from the state of the axis and its state at the start of the step. `moved` ends a step. A formula may
also change sensor readings and what drives make of commands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Place:
    """State of an axis in every run, arrays (n_runs,) in the units of `laws.Axis`; one time [s] for all."""

    time_s: float
    motor: Array
    motor_speed: Array
    deflection: Array
    deflection_rate: Array
    gear_ratio: float
    stiffness: float
    """Gear stiffness, joint side [Nm/rad]."""
    damping: float
    """Gear damping, joint side [Nm s/rad]."""

    @property
    def joint(self) -> Array:
        """Angle of the joint [rad]."""
        return np.asarray(self.gear_ratio * self.motor - self.deflection)

    @property
    def joint_speed(self) -> Array:
        """Speed of the joint [rad/s]."""
        return np.asarray(self.gear_ratio * self.motor_speed - self.deflection_rate)

    @property
    def gear_torque(self) -> Array:
        """Torque of spring and damper on the joint [Nm]."""
        return np.asarray(self.stiffness * self.deflection + self.damping * self.deflection_rate)


class Formula:
    """A formula that does nothing: the base class."""

    def begin(self, place: Place, step_s: float) -> None:
        """Start at rest, with steps of ``step_s`` [s]."""

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return the torque on the motor and on the joint [Nm]."""
        del at
        return 0.0, 0.0

    def moved(self, at: Place) -> None:
        """End a step: keep what the next one needs."""

    def sensor(self, motor: Array) -> Array | float:
        """Return the error of the motor sensor [rad]; called once a sample."""
        del motor
        return 0.0

    def joint_sensor(self, joint: Array) -> Array | float:
        """Return the error of a sensor on the joint [rad]; called once a sample."""
        del joint
        return 0.0

    def read(self, angle: Array) -> Array:
        """Return the reading of an angle that includes noise [rad]."""
        return angle

    def command(self, torque: Array) -> Array:
        """Return the mean torque [Nm] over a step that the drive makes of a command [Nm]."""
        return torque

    def reported(self, torque: Array) -> Array:
        """Return the reported torque [Nm] of a command [Nm]."""
        return torque


def _through_gear(at: Place, torque: Array) -> tuple[Array, Array]:
    """Return the torques on motor and joint [Nm] of a gear torque."""
    return -at.gear_ratio * torque, torque


def _bristle(torque: Array, moved: Array, limit: Array | float, stiffness: float) -> Array:
    """Return Dahl's friction after a displacement in one direction, from that before it (Dahl 1968)."""
    end = np.sign(moved) * limit
    return np.asarray(end + (torque - end) * np.exp(-stiffness * np.abs(moved) / limit))


@dataclass
class DahlFriction(Formula):
    """Dry friction of the motor that builds up with displacement, like the strain of a bristle (Dahl)."""

    dry_nm: float
    stiffness_nm_rad: float
    torque_nm: Array = field(default_factory=lambda: np.zeros(1))
    motor: Array = field(default_factory=lambda: np.zeros(1))

    def begin(self, place: Place, step_s: float) -> None:
        """Begin without strain."""
        del step_s
        self.motor, self.torque_nm = place.motor, np.zeros_like(place.motor)

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return friction on the motor."""
        moved = at.motor - self.motor
        return -_bristle(self.torque_nm, moved, self.dry_nm, self.stiffness_nm_rad), 0.0

    def moved(self, at: Place) -> None:
        """Keep the strain."""
        self.torque_nm = -np.asarray(self.torque(at)[0])
        self.motor = at.motor


@dataclass
class OneSidedFriction(Formula):
    """Dry friction that differs by direction; an arc tangent of speed smooths its sign."""

    forward_nm: float
    backward_nm: float
    corner_rad_s: float

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return friction on the motor."""
        size = np.where(at.motor_speed > 0, self.forward_nm, self.backward_nm)
        return -size * (2 / np.pi) * np.arctan(at.motor_speed / self.corner_rad_s), 0.0


@dataclass
class Churning(Formula):
    """Churning of oil: friction with the power 7/4 of speed, as in turbulent flow (Blasius 1913)."""

    torque_nm: float
    speed_rad_s: float

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return friction on the motor."""
        share = at.motor_speed / self.speed_rad_s
        return -self.torque_nm * np.sign(share) * np.abs(share) ** 1.75, 0.0


@dataclass
class TanhStribeck(Formula):
    """Friction as three hyperbolic tangents of speed, differentiable everywhere (Makkar et al. 2005)."""

    dry_nm: float
    excess_nm: float
    decay_rad_s: float
    corner_rad_s: float

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return friction on the motor."""
        fast = np.tanh(at.motor_speed / self.corner_rad_s)
        excess = self.excess_nm * (fast - np.tanh(at.motor_speed / self.decay_rad_s))
        return -(excess + self.dry_nm * fast), 0.0


@dataclass
class ArctanLoadFriction(Formula):
    """Friction proportional to the gear's torque; an arc tangent of speed smooths its sign."""

    share: float
    corner_rad_s: float

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return friction on the motor."""
        sign = 2 / np.pi * np.arctan(at.motor_speed / self.corner_rad_s)
        return -self.share * np.abs(at.gear_torque * at.gear_ratio) * sign, 0.0


@dataclass
class WarmingFriction(Formula):
    """Viscous friction that changes with running time, as oil warms."""

    viscous_nm_s_rad: float
    time_s: float

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return friction on the motor."""
        return self.viscous_nm_s_rad * np.expm1(-at.time_s / self.time_s) * at.motor_speed, 0.0


@dataclass
class Play(Formula):
    """A gear that pulls and damps only in contact; hyperbolas round its corners."""

    half_width_rad: float

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return the missing gear torque without contact."""
        round_off = 0.05 * self.half_width_rad
        above, below = (
            np.hypot(at.deflection + s * self.half_width_rad, round_off) for s in (1.0, -1.0)
        )
        slack = 0.5 * (above - below)
        inside = 0.5 * (
            (at.deflection + self.half_width_rad) / above
            - (at.deflection - self.half_width_rad) / below
        )
        return _through_gear(at, -at.stiffness * slack - at.damping * inside * at.deflection_rate)


@dataclass
class HardeningSpring(Formula):
    """A gear spring with a hyperbolic sine of deflection; ``cubic_nm_rad3``: its third-order coefficient."""

    cubic_nm_rad3: float

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return the torque beyond the linear spring."""
        a = np.sqrt(6 * self.cubic_nm_rad3 / at.stiffness)
        x = np.clip(a * at.deflection, -20.0, 20.0)
        return _through_gear(at, at.stiffness * (np.sinh(x) - x) / a)


@dataclass
class RoundedKnee(Formula):
    """A gear with two stiffnesses; a hyperbola rounds the knee between them."""

    more_nm_rad: float
    knee_rad: float

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return the additional torque beyond the knee."""
        beyond = np.abs(at.deflection) - self.knee_rad
        past = 0.5 * (beyond + np.hypot(beyond, 0.05 * self.knee_rad))
        return _through_gear(at, self.more_nm_rad * np.sign(at.deflection) * past)


@dataclass
class SmoothMiddle(Formula):
    """A gear whose teeth meet one after another: a bell curve of deflection makes it softer."""

    less_nm_rad: float
    half_width_rad: float

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return the missing spring torque."""
        within = self.half_width_rad * np.tanh(at.deflection / self.half_width_rad)
        return _through_gear(at, -self.less_nm_rad * within)


@dataclass
class WeakSupply(Formula):
    """A drive whose torque falls exponentially with the power drawn, as its supply weakens."""

    share_1_w: float
    told_nm: Array = field(default_factory=lambda: np.zeros(1))

    def command(self, torque: Array) -> Array:
        """Keep the command, and return it unchanged."""
        self.told_nm = torque
        return torque

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return the missing torque on the motor."""
        if self.told_nm.shape != at.motor_speed.shape:
            return 0.0, 0.0
        drawn = np.maximum(self.told_nm * at.motor_speed, 0.0)
        return self.told_nm * np.expm1(-self.share_1_w * drawn), 0.0


@dataclass
class RunOut(Formula):
    """An encoder on the joint whose error is a sine of the joint's angle."""

    amplitude_rad: float
    phase: float
    first: Array | None = None

    def begin(self, place: Place, step_s: float) -> None:
        """Forget the error at the first reading."""
        del place, step_s
        self.first = None

    def joint_sensor(self, joint: Array) -> Array | float:
        """Return the error relative to that of the first reading."""
        error = np.asarray(self.amplitude_rad * np.sin(joint + self.phase))
        self.first = error if self.first is None else self.first
        return np.asarray(error - self.first)


@dataclass
class Counter(Formula):
    """An encoder with few lines that rounds to the nearest."""

    line_rad: float

    def read(self, angle: Array) -> Array:
        """Return the angle of the nearest line."""
        return np.asarray(np.round(angle / self.line_rad) * self.line_rad)


@dataclass
class DahlGear(Formula):
    """A gear whose spring slips in part, like a Dahl bristle."""

    stiffness: float
    slip_nm: float
    torque_nm: Array = field(default_factory=lambda: np.zeros(1))
    deflection: Array = field(default_factory=lambda: np.zeros(1))

    def begin(self, place: Place, step_s: float) -> None:
        """Begin without strain."""
        del step_s
        self.deflection = place.deflection
        self.torque_nm = np.zeros_like(place.deflection)

    def _on_joint(self, at: Place) -> Array:
        return _bristle(
            self.torque_nm, at.deflection - self.deflection, self.slip_nm, self.stiffness
        )

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return what the bristle adds to the gear's torque."""
        return _through_gear(at, self._on_joint(at))

    def moved(self, at: Place) -> None:
        """Keep the strain."""
        self.torque_nm, self.deflection = self._on_joint(at), at.deflection


@dataclass
class GearError(Formula):
    """A gear with an angle error periodic in the motor angle, plus a small second harmonic."""

    order: float
    amplitude_rad: float
    phase: float
    harmonic: float = 0.03

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return the torque that the angle error adds; the motor supplies its power."""
        angle = self.order * at.motor + self.phase
        shape = np.sin(angle) + self.harmonic * np.sin(2 * angle)
        slope = np.cos(angle) + 2 * self.harmonic * np.cos(2 * angle)
        total = at.stiffness * self.amplitude_rad * (shape - np.sin(self.phase))
        back = at.gear_ratio * total
        back = back + self.order * self.amplitude_rad * slope * (at.gear_torque + total)
        return -back, total


@dataclass
class Cogging(Formula):
    """Cogging: a motor torque periodic in the motor angle, independent of load."""

    orders: Sequence[float]
    amplitudes_nm: Sequence[float]
    phases: Sequence[float]

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return the torque on the motor."""
        terms = zip(self.orders, self.amplitudes_nm, self.phases, strict=True)
        return sum(a * np.cos(n * at.motor + p) for n, a, p in terms), 0.0


@dataclass
class ResolverImbalance(Formula):
    """A resolver with unequal windings: its angle is the arc tangent of unequal signals.

    ``pairs``: pole pairs. ``imbalance``: relative amplitude error, a wave at twice the electrical angle.
    ``offset`` of one winding: a wave at the electrical angle.
    """

    pairs: int
    imbalance: float
    offset: float

    def sensor(self, motor: Array) -> Array | float:
        """Return the angle error [rad]."""
        angle = self.pairs * motor
        sine, cosine = (1 + self.imbalance) * np.sin(angle), np.cos(angle) + self.offset
        # Sine and cosine of the difference: no turns to count.
        apart = np.arctan2(
            sine * np.cos(angle) - cosine * np.sin(angle),
            cosine * np.cos(angle) + sine * np.sin(angle),
        )
        return np.asarray(apart / self.pairs)


@dataclass
class ConstantTorque(Formula):
    """A constant torque on the motor."""

    torque_nm: float

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return the constant torque on the motor."""
        del at
        return self.torque_nm, 0.0


class DelayLine(Formula):
    """A drive that delays commands by any time."""

    def __init__(self, delay_s: float) -> None:
        self.delay_s = delay_s
        self.step_s = 0.0
        self.line: list[Array] = []

    def begin(self, place: Place, step_s: float) -> None:
        """Empty the line."""
        del place
        self.step_s, self.line = step_s, []

    def command(self, torque: Array) -> Array:
        """Return the mean delayed command over the step."""
        steps = self.delay_s / self.step_s
        whole = int(steps)
        self.line = [*self.line[-(whole + 1) :], torque]
        newer, older = (self.line[max(len(self.line) - 1 - whole - more, 0)] for more in (0, 1))
        return np.asarray(newer + (steps - whole) * (older - newer))


class Lag(Formula):
    """A drive with a first-order lag, exact over every step."""

    def __init__(self, time_constant_s: float) -> None:
        self.time_constant_s = time_constant_s
        self.step_s = 0.0
        self.made: Array | None = None

    def begin(self, place: Place, step_s: float) -> None:
        """Start in balance."""
        del place
        self.step_s, self.made = step_s, None

    def command(self, torque: Array) -> Array:
        """Return the mean torque over the step."""
        before = torque if self.made is None else self.made
        left = np.exp(-self.step_s / self.time_constant_s)
        self.made = torque + left * (before - torque)
        share = (1 - left) * self.time_constant_s / self.step_s
        return np.asarray(torque + share * (before - torque))


class ResonantLoop(Formula):
    """A drive with a second-order current loop, T^2 y'' + 2 D T y' + y = u, exact over every step."""

    def __init__(self, time_constant_s: float, damping: float) -> None:
        self.time_constant_s, self.damping = time_constant_s, damping
        self.ahead = np.eye(4)
        self.state: Array | None = None

    def begin(self, place: Place, step_s: float) -> None:
        """Start in balance."""
        del place
        # States: torque, its rate times the time constant, its mean over the step, the command.
        share, d = step_s / self.time_constant_s, self.damping
        rates = [[0, share, 0, 0], [-share, -2 * d * share, 0, share], [1, 0, 0, 0], [0, 0, 0, 0]]
        self.ahead, self.state = scipy.linalg.expm(np.array(rates, np.float64)), None

    def command(self, torque: Array) -> Array:
        """Return the mean torque over the step."""
        still = np.zeros_like(torque)
        made, rate = (torque, still) if self.state is None else self.state
        made, rate, mean, _ = self.ahead @ np.array([made, rate, still, torque])
        self.state = np.array([made, rate])
        return np.asarray(mean)


class StaleSensor(Formula):
    """A sensor that returns the motor angle of some samples ago."""

    def __init__(self, samples: int) -> None:
        self.samples = samples
        self.line: list[Array] = []

    def begin(self, place: Place, step_s: float) -> None:
        """Empty the line."""
        del place, step_s
        self.line = []

    def sensor(self, motor: Array) -> Array | float:
        """Return the difference to the present angle."""
        self.line = [*self.line[-self.samples :], motor]
        return np.asarray(self.line[0] - motor)


@dataclass
class WrongReport(Formula):
    """A drive that reports a share of its torque minus a constant."""

    share: float = 1.0
    less_nm: float = 0.0

    def reported(self, torque: Array) -> Array:
        """Return the reported torque."""
        return np.asarray(self.share * torque - self.less_nm)


@dataclass
class CurrentLimit(Formula):
    """A drive with limited torque, which reports the limited torque."""

    limit_nm: float

    def command(self, torque: Array) -> Array:
        """Return the command within the limit."""
        return np.clip(torque, -self.limit_nm, self.limit_nm)

    reported = command


@dataclass
class DeadZone(Formula):
    """A drive that ignores small commands."""

    width_nm: float

    def command(self, torque: Array) -> Array:
        """Return the part of the command beyond the zone."""
        return np.asarray(torque - np.clip(torque, -self.width_nm, self.width_nm))


@dataclass
class Tone(Formula):
    """An external torque on the motor at a fixed frequency."""

    amplitude_nm: float
    frequency_hz: float
    phase: float

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return the torque on the motor."""
        angle = 2 * np.pi * self.frequency_hz * at.time_s + self.phase
        return self.amplitude_nm * float(np.sin(angle)), 0.0


@dataclass
class Push(Formula):
    """A person who leans on the arm for a while, independent of the motions."""

    torque_nm: float
    from_s: float
    for_s: float

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return a bump on the joint."""
        phase = (at.time_s - self.from_s) / self.for_s
        inside = 0.0 < phase < 1.0
        return 0.0, self.torque_nm * float(np.sin(np.pi * phase)) ** 2 if inside else 0.0


@dataclass
class LateFriction(Formula):
    """Dry friction that sets in at some time."""

    friction_nm: float
    corner_rad_s: float
    from_s: float

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return friction on the motor."""
        size = self.friction_nm if at.time_s > self.from_s else 0.0
        return -size * np.tanh(at.motor_speed / self.corner_rad_s), 0.0


@dataclass
class QuadraticDamper(Formula):
    """A gear damper with the square of the deflection rate."""

    quadratic_nm_s2_rad2: float

    def torque(self, at: Place) -> tuple[Array | float, Array | float]:
        """Return what the damper adds to the gear's torque."""
        rate = at.deflection_rate
        return _through_gear(at, self.quadratic_nm_s2_rad2 * np.abs(rate) * rate)
