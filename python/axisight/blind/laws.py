"""Laws that a machine follows and its simulator lacks; they come from other papers than the library's.

A law acts on one axis. Every step it gets the state of the axis and returns a torque on the motor and one on
the joint. It may also change sensor readings and what the drive makes of a command.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, copysign, cos, exp, floor, pi, sin


@dataclass(frozen=True)
class Axis:
    """State of an axis: time [s], angle [rad] and speed [rad/s] of motor and joint, gear deflection [rad]."""

    time_s: float
    motor: float
    motor_speed: float
    joint: float
    joint_speed: float
    gear_ratio: float
    gear_torque: float
    """Torque of the gear spring on the joint [Nm]."""

    @property
    def deflection(self) -> float:
        """Gear deflection, joint side [rad]."""
        return self.gear_ratio * self.motor - self.joint


class Law:
    """A law that does nothing: the base class."""

    def begin(self, step_s: float) -> None:
        """Start anew, with steps of ``step_s`` [s]."""

    def torque(self, at: Axis) -> tuple[float, float]:
        """Return the torque on the motor and on the joint [Nm]."""
        del at
        return 0.0, 0.0

    def sensor(self, motor: float) -> float:
        """Return the error of the motor sensor [rad]."""
        del motor
        return 0.0

    def joint_sensor(self, joint: float) -> float:
        """Return the error of a sensor on the joint [rad]."""
        del joint
        return 0.0

    def read(self, angle: float) -> float:
        """Return the reading of an angle that includes noise [rad]."""
        return angle

    def command(self, torque: float) -> float:
        """Return the torque that the drive makes of a command [Nm]; called every step."""
        return torque

    def reported(self, torque: float) -> float:
        """Return the reported torque [Nm] of a command [Nm]."""
        return torque


@dataclass
class ExponentialStribeck(Law):
    """Dry friction that falls with speed as exp(-|v|/vs) (Tustin), sign smoothed by v / (|v| + v0)."""

    dry_nm: float
    static_nm: float
    speed_rad_s: float
    corner_rad_s: float

    def torque(self, at: Axis) -> tuple[float, float]:
        """Return friction on the motor."""
        v = at.motor_speed
        size = self.dry_nm + (self.static_nm - self.dry_nm) * exp(-abs(v) / self.speed_rad_s)
        return -size * v / (abs(v) + self.corner_rad_s), 0.0


@dataclass
class Warmup(Law):
    """Viscous friction that appears or vanishes as 1 - exp(-t / T)."""

    viscous_nm_s_rad: float
    time_s: float

    def torque(self, at: Axis) -> tuple[float, float]:
        """Return friction on the motor."""
        done = 1 - exp(-at.time_s / self.time_s)
        return -self.viscous_nm_s_rad * done * at.motor_speed, 0.0


@dataclass
class LoadFriction(Law):
    """Friction proportional to the gear torque, referred to the motor."""

    share: float
    corner_rad_s: float

    def torque(self, at: Axis) -> tuple[float, float]:
        """Return friction on the motor."""
        v = at.motor_speed
        load = abs(at.gear_torque * at.gear_ratio)
        return -self.share * load * v / (abs(v) + self.corner_rad_s), 0.0


@dataclass
class OneSidedFriction(Law):
    """Dry friction that differs by direction; v / (|v| + v0) smooths its sign."""

    forward_nm: float
    backward_nm: float
    corner_rad_s: float

    def torque(self, at: Axis) -> tuple[float, float]:
        """Return friction on the motor."""
        v = at.motor_speed
        size = self.forward_nm if v > 0 else self.backward_nm
        return -size * v / (abs(v) + self.corner_rad_s), 0.0


@dataclass
class Drag(Law):
    """Friction with the square of speed."""

    drag_nm_s2_rad2: float

    def torque(self, at: Axis) -> tuple[float, float]:
        """Return friction on the motor."""
        return -self.drag_nm_s2_rad2 * at.motor_speed * abs(at.motor_speed), 0.0


class MaxwellSlip(Law):
    """A gear that slips: parallel springs, each in series with a slider."""

    def __init__(self, stiffness: Sequence[float], slip_rad: Sequence[float]) -> None:
        self.stiffness, self.slip = list(stiffness), list(slip_rad)
        self.anchor = [0.0] * len(self.slip)

    def begin(self, step_s: float) -> None:
        """Relax all springs."""
        del step_s
        self.anchor = [0.0] * len(self.slip)

    def torque(self, at: Axis) -> tuple[float, float]:
        """Return the torque that the slipping springs add to the gear's."""
        total = 0.0
        for i, (k, slip) in enumerate(zip(self.stiffness, self.slip, strict=True)):
            stretch = at.deflection - self.anchor[i]
            if abs(stretch) > slip:
                self.anchor[i] = at.deflection - copysign(slip, stretch)
                stretch = copysign(slip, stretch)
            total += k * stretch
        return -at.gear_ratio * total, total


class HeldSpring(Law):
    """A spring whose torque the engine holds over a step.

    The held torque is late by half a step, by which a stiff spring would drive an oscillation. The law
    therefore takes the deflection in the middle of the step.
    """

    half_step_s = 0.0

    def begin(self, step_s: float) -> None:
        """Keep half a step."""
        self.half_step_s = 0.5 * step_s

    def deflection(self, at: Axis) -> float:
        """Return the deflection of the gear in the middle of the step."""
        rate = at.gear_ratio * at.motor_speed - at.joint_speed
        return at.deflection + self.half_step_s * rate


@dataclass
class CubicSpring(HeldSpring):
    """A gear whose stiffness grows with its deflection: a cubic torque."""

    cubic_nm_rad3: float

    def torque(self, at: Axis) -> tuple[float, float]:
        """Return what the cube adds to the gear's torque in the middle of the step."""
        total = self.cubic_nm_rad3 * self.deflection(at) ** 3
        return -at.gear_ratio * total, total


@dataclass
class KneeSpring(HeldSpring):
    """A gear with one stiffness up to a knee and another beyond it."""

    more_nm_rad: float
    knee_rad: float

    def torque(self, at: Axis) -> tuple[float, float]:
        """Return the additional torque beyond the knee, in the middle of the step."""
        deflection = self.deflection(at)
        beyond = copysign(max(abs(deflection) - self.knee_rad, 0.0), deflection)
        total = self.more_nm_rad * beyond
        return -at.gear_ratio * total, total


@dataclass
class SoftMiddle(HeldSpring):
    """A gear that is softer at small deflection, where few teeth carry."""

    less_nm_rad: float
    half_width_rad: float

    def torque(self, at: Axis) -> tuple[float, float]:
        """Return the missing spring torque, in the middle of the step."""
        deflection = self.deflection(at)
        within = min(max(deflection, -self.half_width_rad), self.half_width_rad)
        total = -self.less_nm_rad * within
        return -at.gear_ratio * total, total


@dataclass
class Sag(Law):
    """A drive whose torque falls in proportion to the power drawn."""

    share_1_w: float
    told_nm: float = 0.0

    def command(self, torque: float) -> float:
        """Keep the command, and return it unchanged."""
        self.told_nm = torque
        return torque

    def torque(self, at: Axis) -> tuple[float, float]:
        """Return the missing torque on the motor."""
        drawn = max(self.told_nm * at.motor_speed, 0.0)
        return -self.told_nm * min(self.share_1_w * drawn, 0.9), 0.0


@dataclass
class GearWave(Law):
    """A gear with an angle error that is a Fourier series of the motor angle; power is conserved or not."""

    stiffness: float
    order: float
    amplitude_rad: float
    phase: float
    conserves: bool

    def torque(self, at: Axis) -> tuple[float, float]:
        """Return the torque that the angle error adds to the gear's."""
        angle = self.order * at.motor + self.phase
        wave = self.amplitude_rad * (sin(angle) - sin(self.phase))
        total = self.stiffness * wave
        slope = self.order * self.amplitude_rad * cos(angle) if self.conserves else 0.0
        back = total * at.gear_ratio + slope * (at.gear_torque + total)
        return -back, total


@dataclass
class MotorWave(Law):
    """Motor torque that is a Fourier series of the motor angle, such as cogging."""

    orders: Sequence[float]
    amplitudes_nm: Sequence[float]
    phases: Sequence[float]

    def torque(self, at: Axis) -> tuple[float, float]:
        """Return the ripple on the motor."""
        terms = zip(self.orders, self.amplitudes_nm, self.phases, strict=True)
        return sum(a * sin(n * at.motor + p) for n, a, p in terms), 0.0


@dataclass
class SensorWave(Law):
    """A resolver with a periodic angle error."""

    orders: Sequence[float]
    amplitudes_rad: Sequence[float]
    phases: Sequence[float]

    def sensor(self, motor: float) -> float:
        """Return the angle error [rad]."""
        terms = zip(self.orders, self.amplitudes_rad, self.phases, strict=True)
        return sum(a * sin(n * motor + p) for n, a, p in terms)


@dataclass
class EccentricDisc(Law):
    """An encoder on the joint whose disc turns about a point ``run_out`` of its radius off centre."""

    run_out: float
    phase: float
    first: float | None = None

    def begin(self, step_s: float) -> None:
        """Count from the joint's first angle."""
        del step_s
        self.first = None

    def joint_sensor(self, joint: float) -> float:
        """Return the error of the angle."""
        at = joint + self.phase
        error = atan2(self.run_out * sin(at), 1 + self.run_out * cos(at))
        self.first = error if self.first is None else self.first
        return error - self.first


@dataclass
class FewLines(Law):
    """An encoder with few lines that counts the lines passed."""

    line_rad: float

    def read(self, angle: float) -> float:
        """Return the angle of the last line passed plus half a line."""
        return (floor(angle / self.line_rad) + 0.5) * self.line_rad


@dataclass
class Offset(Law):
    """A constant torque on the motor."""

    torque_nm: float

    def torque(self, at: Axis) -> tuple[float, float]:
        """Return the constant torque on the motor."""
        del at
        return self.torque_nm, 0.0


class Delay(Law):
    """A drive that delays commands."""

    def __init__(self, delay_s: float) -> None:
        self.delay_s = delay_s
        self.line: deque[float] = deque()

    def begin(self, step_s: float) -> None:
        """Empty the line."""
        self.line = deque(maxlen=max(1, round(self.delay_s / step_s)) + 1)

    def command(self, torque: float) -> float:
        """Return the command of some steps ago."""
        self.line.append(torque)
        return self.line[0]


class ResonantLoop(Law):
    """A drive with a second-order current loop, T^2 y'' + 2 D T y' + y = u, by the implicit midpoint rule."""

    def __init__(self, time_constant_s: float, damping: float) -> None:
        self.time_constant_s, self.damping = time_constant_s, damping
        self.half = 0.0
        self.made: float | None = None
        self.rate = 0.0

    def begin(self, step_s: float) -> None:
        """Start in balance."""
        self.half = 0.5 * step_s / self.time_constant_s
        self.made, self.rate = None, 0.0

    def command(self, torque: float) -> float:
        """Return the mean torque over the step."""
        before = torque if self.made is None else self.made
        h, damped = self.half, 1 + 2 * self.damping * self.half
        # The rate in the middle of the step, times the time constant.
        rate = (self.rate + h * (torque - before)) / (damped + h * h)
        self.made, self.rate = before + 2 * h * rate, 2 * rate - self.rate
        return before + h * rate


class LateSensor(Law):
    """A sensor that returns the motor angle of some samples ago; called once a sample."""

    def __init__(self, samples: int) -> None:
        self.samples = samples
        self.line: deque[float] = deque()

    def begin(self, step_s: float) -> None:
        """Empty the line."""
        del step_s
        self.line = deque(maxlen=self.samples + 1)

    def sensor(self, motor: float) -> float:
        """Return the difference to the present angle."""
        self.line.append(motor)
        return self.line[0] - motor


@dataclass
class ReportedLess(Law):
    """A drive that reports its torque minus a constant."""

    offset_nm: float

    def reported(self, torque: float) -> float:
        """Return the reported torque."""
        return torque - self.offset_nm


@dataclass
class Reported(Law):
    """A drive that reports a share of its torque."""

    share: float

    def reported(self, torque: float) -> float:
        """Return the reported torque."""
        return self.share * torque


@dataclass
class Limit(Law):
    """A drive with limited torque, which reports the limited torque."""

    limit_nm: float

    def command(self, torque: float) -> float:
        """Return the command within the limit."""
        return min(max(torque, -self.limit_nm), self.limit_nm)

    reported = command


@dataclass
class Deadband(Law):
    """A drive that ignores small commands."""

    width_nm: float

    def command(self, torque: float) -> float:
        """Return the part of the command beyond the band."""
        return copysign(max(abs(torque) - self.width_nm, 0.0), torque)


@dataclass
class Tone(Law):
    """An external torque on the motor at a fixed frequency."""

    amplitude_nm: float
    frequency_hz: float
    phase: float

    def torque(self, at: Axis) -> tuple[float, float]:
        """Return the torque on the motor."""
        return self.amplitude_nm * sin(2 * pi * self.frequency_hz * at.time_s + self.phase), 0.0


@dataclass
class FrictionStep(Law):
    """Dry friction that sets in at some time."""

    friction_nm: float
    corner_rad_s: float
    from_s: float

    def torque(self, at: Axis) -> tuple[float, float]:
        """Return friction on the motor."""
        v = at.motor_speed
        size = self.friction_nm if at.time_s > self.from_s else 0.0
        return -size * v / (abs(v) + self.corner_rad_s), 0.0


@dataclass
class CubicDamper(Law):
    """A gear damper with the cube of the deflection rate."""

    cubic_nm_s3_rad3: float

    def torque(self, at: Axis) -> tuple[float, float]:
        """Return what the damper adds to the gear's torque."""
        rate = at.gear_ratio * at.motor_speed - at.joint_speed
        total = self.cubic_nm_s3_rad3 * rate**3
        return -at.gear_ratio * total, total
