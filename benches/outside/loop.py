"""The control loop and the encoders of a machine, and the hooks by which a law changes them."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass, field

import numpy as np

from .arms import Arm, rest

# Substeps of an engine per sample: its torques are held, its friction and springs are not.
SUBSTEPS = 2
ENCODER_BITS = 22


class Law:
    """A property of the machine. Every hook may be overridden; vectors have one number per driven axis.

    Angles ``phi`` and speeds ``w`` are those of the motors, ``q`` and ``v`` those of the driven joints.
    """

    needs_load = False

    def change(self, arm: Arm) -> Arm:
        """Return the arm with other parameters."""
        return arm

    def references(self, w_ref: np.ndarray, time_s: np.ndarray) -> np.ndarray:
        """Return the references that the controller follows [rad/s], samples first."""
        return w_ref

    def measured(self, phi: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Return the positions that the encoders read [rad], once a sample."""
        return phi

    def counted(self, y: np.ndarray) -> np.ndarray:
        """Return what the counters make of the noisy signals of the encoders [rad], once a sample."""
        return y

    def speed(self, w: np.ndarray) -> np.ndarray:
        """Return the speeds that the controller uses [rad/s], once a sample."""
        return w

    def command(self, u: np.ndarray, w_ref: np.ndarray) -> np.ndarray:
        """Return the torques that the drive is told and reports [Nm], once a sample."""
        return u

    def reported(self, u: np.ndarray) -> np.ndarray:
        """Return the torques of the log [Nm]."""
        return u

    def applied(self, u: np.ndarray, w: np.ndarray, h: float) -> np.ndarray:
        """Return the torques that the drives deliver over a substep of ``h`` seconds [Nm]."""
        return u

    def settled(self, torque: np.ndarray) -> np.ndarray:
        """Return the constant commands that deliver these torques [Nm]."""
        return torque

    def substep(self, t: float, h: float, phi, w, q, v) -> None:
        """Advance states of the law over a substep."""

    def motor(self, t: float, phi, w, load, out: list[float]) -> None:
        """Add torques on the motors to ``out`` [Nm]; ``load`` are gear torques on the joints or None."""

    def joint(self, t: float, q, v, out: list[float]) -> None:
        """Add torques on the driven joints to ``out`` [Nm]."""

    def gear(self, axis: int):
        """Return a function (deflection, its rate, phi, w) -> gear torque [Nm] of an axis, or None."""
        return None

    def has(self, hook: str) -> bool:
        """Whether the law overrides a hook."""
        return getattr(type(self), hook) is not getattr(Law, hook)


@dataclass
class Loop:
    """A machine under its controller over one log. Engines call :meth:`substep` before every substep."""

    arm: Arm
    laws: list[Law]
    w_ref: np.ndarray
    rng: np.random.Generator | None
    positions: list[np.ndarray] = field(default_factory=list)
    torques: list[np.ndarray] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.laws = deepcopy(self.laws)  # their states begin anew with every log
        arm = self.arm
        self.ratios = arm.ratios
        self.axes = len(self.ratios)
        self.h = arm.sample_time_s / SUBSTEPS
        self.joint_laws = [law for law in self.laws if law.has("joint")]
        self.motor_laws = [law for law in self.laws if law.has("motor")]
        self.needs_load = any(law.needs_load for law in self.laws)
        self.angles, self.load = rest(arm, self.pull)
        self.gears = [self._gear(axis) for axis in range(self.axes)]
        q = self.angles[arm.driven]
        self.phi = (q + self._deflection()) / self.ratios
        extra = self.motor_extra(0.0, self.phi, np.zeros(self.axes), self.load)
        u = self.load * self.ratios - np.array(extra)
        for law in self.laws:
            u = law.settled(u)
        self.u_ff = self.held = self.u = u
        self.index, self.integral = 0, np.zeros(self.axes)
        self.before = None
        time = np.arange(len(self.w_ref)) * arm.sample_time_s
        self.told = self.w_ref
        for law in self.laws:
            self.told = law.references(self.told, time)

    def pull(self, q: np.ndarray) -> list[float]:
        """Return the torques of springs and the like on the joints at rest [Nm]."""
        return self.joint_extra(0.0, q, np.zeros(len(q)))

    def joint_extra(self, t: float, q, v) -> list[float]:
        """Return what the laws add on the driven joints [Nm]."""
        out = [0.0] * len(q)
        for law in self.joint_laws:
            law.joint(t, q, v, out)
        return out

    def motor_extra(self, t: float, phi, w, load) -> list[float]:
        """Return what the laws add on the motors [Nm], viscous friction of the robot file apart."""
        out = [0.0] * len(phi)
        for law in self.motor_laws:
            law.motor(t, phi, w, load, out)
        return out

    def _gear(self, axis: int):
        found = [g for g in (law.gear(axis) for law in self.laws) if g is not None]
        return found[0] if found else None

    def _deflection(self) -> np.ndarray:
        """Return the deflections that carry the load at rest [rad]."""
        deflection = np.zeros(self.axes)
        for axis, joint in enumerate(self.arm.driven):
            stiffness = self.arm.joints[joint].stiffness
            if stiffness is None:
                continue
            torque = self.load[axis]
            deflection[axis] = torque / stiffness
            gear = self.gears[axis]
            if gear is not None:
                low, high = sorted((-5 * deflection[axis] - 0.02, 5 * deflection[axis] + 0.02))
                for _ in range(80):  # bisection: a gear's torque grows with its deflection
                    middle = (low + high) / 2
                    angle = (self.angles[joint] + middle) / self.ratios[axis]
                    low, high = (
                        (middle, high) if gear(middle, 0.0, angle, 0.0) < torque else (low, middle)
                    )
                deflection[axis] = (low + high) / 2
        return deflection

    def substep(self, step: int, phi, w, q, v) -> None:
        """Take a sample where one is due and set the torques of the substep, ``held``."""
        phi, w = np.asarray(phi, dtype=float), np.asarray(w, dtype=float)
        if step % SUBSTEPS == 0 and self.index < len(self.told):
            self._sample(phi, np.asarray(q, dtype=float))
        held = self.u
        for law in self.laws:
            held = law.applied(held, w, self.h)
            law.substep(step * self.h, self.h, phi, w, q, v)
        self.held = held

    def _sample(self, phi: np.ndarray, q: np.ndarray) -> None:
        period = self.arm.sample_time_s
        y = phi - self.arm.zeros_rad / self.ratios
        for law in self.laws:
            y = law.measured(y, q)
        if self.index == 0:
            self.phi_ref = y.copy()
        if self.rng is not None:
            count = 2 * np.pi / 2**ENCODER_BITS
            y = y + self.arm.noise_std_rad * self.rng.standard_normal(self.axes)
            y = count * np.round(y / count)
        for law in self.laws:
            y = law.counted(y)
        w = np.zeros(self.axes) if self.before is None else (y - self.before) / period
        self.before = y
        for law in self.laws:
            w = law.speed(w)
        arm, w_ref = self.arm, self.told[self.index]
        if arm.controller == "cascade":
            error = arm.kv * (self.phi_ref - y) + w_ref - w
            u = self.u_ff + arm.kp * error + arm.ki * self.integral
            self.integral = self.integral + period * error
        else:
            u = self.u_ff + arm.kp * (w_ref - w) + arm.ki * (self.phi_ref - y)
        for law in self.laws:
            u = law.command(u, w_ref)
        self.phi_ref = self.phi_ref + period * w_ref
        self.index += 1
        self.u, shown = u, u
        for law in self.laws:
            shown = law.reported(shown)
        self.positions.append(y)
        self.torques.append(shown)
