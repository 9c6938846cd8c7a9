"""Coordinates of a machine and the torques on them; steps for an engine whose own are too coarse.

Coordinates are the joints of the chain, then the rotors of elastic gears. A rotor of its own meets the
arm only through its gear; one behind a rigid gear turns with its joint.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from .loop import SUBSTEPS, Loop

# A body without mass is a speck of dust, a billionth of any link [kg, kg m^2].
DUST_KG, DUST_KG_M2 = 1e-9, 1e-12


class Chain:
    """Coordinates and torques of a machine; a subclass holds its bodies in an engine."""

    def __init__(self, loop: Loop):
        arm = loop.arm
        self.loop = loop
        self.joints, self.driven = arm.joints, arm.driven
        self.motors = [arm.joints[i] for i in arm.driven]
        self.ratios = arm.ratios.tolist()
        # Axes whose motor is a body of its own, with its coordinate; the others turn with the joint.
        elastic = [axis for axis, motor in enumerate(self.motors) if motor.stiffness is not None]
        self.geared = {axis: len(arm.joints) + i for i, axis in enumerate(elastic)}
        self.springs = [i for i, joint in enumerate(arm.joints) if joint.ratio is None]
        self.size = len(arm.joints) + len(elastic)

    def reflected(self) -> np.ndarray:
        """Return what the rotors of rigid gears add to the mass matrix [kg m^2]."""
        added = np.zeros(self.size)
        for axis, (joint, motor) in enumerate(zip(self.driven, self.motors, strict=True)):
            if axis not in self.geared:
                added[joint] = motor.motor_inertia / motor.ratio**2
        return np.diag(added)

    def start(self) -> np.ndarray:
        """Return coordinates and rates at the beginning of a log."""
        state = np.zeros(2 * self.size)
        state[: len(self.joints)] = self.loop.angles
        for axis, rotor in self.geared.items():
            state[rotor] = self.loop.phi[axis]
        return state

    def split(self, state: list[float]) -> tuple[list[float], ...]:
        """Return angles and speeds of the motors, then those of the driven joints."""
        size = self.size
        q = [state[i] for i in self.driven]
        v = [state[size + i] for i in self.driven]
        phi = [a / r for a, r in zip(q, self.ratios, strict=True)]
        w = [a / r for a, r in zip(v, self.ratios, strict=True)]
        for axis, rotor in self.geared.items():
            phi[axis], w[axis] = state[rotor], state[size + rotor]
        return phi, w, q, v

    def torques(self, t: float, state: list[float]) -> list[float]:
        """Return the torques of motors, gears, springs and laws on all coordinates [Nm]."""
        loop, out = self.loop, [0.0] * self.size
        phi, w, q, v = self.split(state)
        loads = self._gears(phi, w, q, v)
        extra = loop.motor_extra(t, phi, w, loads)
        for axis, motor in enumerate(self.motors):
            torque = float(loop.held[axis]) + extra[axis] - motor.viscous * w[axis]
            if axis in self.geared:
                out[self.driven[axis]] = loads[axis]
                out[self.geared[axis]] = torque - motor.ratio * loads[axis]
            else:
                out[self.driven[axis]] = torque / motor.ratio
        for i in self.springs:
            spring = self.joints[i]
            out[i] = -spring.stiffness * state[i] - spring.damping * state[self.size + i]
        if loop.joint_laws:
            for joint, torque in zip(self.driven, loop.joint_extra(t, q, v), strict=True):
                out[joint] += torque
        return out

    def _gears(self, phi, w, q, v) -> list[float]:
        """Return the torques of the elastic gears on the joints [Nm]; zero where a gear is rigid."""
        loads = [0.0] * len(self.motors)
        for axis in self.geared:
            gear, motor = self.loop.gears[axis], self.motors[axis]
            delta, speed = motor.ratio * phi[axis] - q[axis], motor.ratio * w[axis] - v[axis]
            if gear is None:
                loads[axis] = motor.stiffness * delta + motor.damping * speed
            else:
                loads[axis] = gear(delta, speed, phi[axis], w[axis])
        return loads


class Stepped(Chain, ABC):
    """A machine whose steps are taken beside its engine."""

    @abstractmethod
    def rate(self, t: float, state: np.ndarray) -> np.ndarray:
        """Return the derivative of coordinates and rates."""


def march(chain: Stepped) -> None:
    """Simulate all samples of the loop of a machine, a Runge-Kutta step of order four a substep.

    Raises RuntimeError if the state does not stay finite.
    """
    loop, state = chain.loop, chain.start()
    for step in range(len(loop.w_ref) * SUBSTEPS):
        if not np.isfinite(state).all():
            raise RuntimeError(f"expected a finite state, got {state} in substep {step}")
        loop.substep(step, *chain.split(state.tolist()))
        state = _after(chain, step * loop.h, state, loop.h)


def _after(chain: Stepped, t: float, state: np.ndarray, h: float) -> np.ndarray:
    """Return the state after a Runge-Kutta step of order four."""
    first = chain.rate(t, state)
    second = chain.rate(t + h / 2, state + h / 2 * first)
    third = chain.rate(t + h / 2, state + h / 2 * second)
    fourth = chain.rate(t + h, state + h * third)
    return state + h / 6 * (first + 2 * second + 2 * third + fourth)
