"""Arms in DART: a skeleton of the links, beside it a body for each rotor that drives an elastic gear.

DART gives the accelerations. Where a gear is rigid, it gives the mass matrix and the Coriolis,
centrifugal and gravity torques, and the rotor is reflected into this matrix. Runge-Kutta steps of order
four are taken here, one a substep, because DART's own integrator is of order one.
"""

from __future__ import annotations

import numpy as np
from dartpy.dynamics import Inertia, Skeleton
from dartpy.math import Isometry3

from .arms import Joint
from .loop import SUBSTEPS, Loop

# A body without mass is a speck of dust, a billionth of any link [kg, kg m^2].
DUST_KG, DUST_KG_M2 = 1e-9, 1e-12
# Rotors turn about their own centre of mass, so that only their inertia about it counts.
ROTOR_KG = 1.0


class Plant:
    """A machine in DART: coordinates are the joints of the chain, then the rotors of elastic gears."""

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
        self.skeleton = self._skeleton()
        self.size = self.skeleton.getNumDofs()
        self.reflected = None if len(elastic) == len(self.motors) else self._reflected()

    def _skeleton(self) -> Skeleton:
        skeleton = Skeleton(self.loop.arm.name)
        skeleton.setGravity(self.loop.arm.gravity_m_s2)
        parent = None
        for joint in self.joints:
            parent = _body(skeleton, parent, joint)
        for axis in self.geared:
            _rotor(skeleton, self.motors[axis].motor_inertia)
        return skeleton

    def _reflected(self) -> np.ndarray:
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

    def rate(self, t: float, state: np.ndarray) -> np.ndarray:
        """Return the derivative of coordinates and rates."""
        skeleton, rate = self.skeleton, state[self.size :]
        skeleton.setPositions(state[: self.size])
        skeleton.setVelocities(rate)
        torque = self._torques(t, state.tolist())
        if self.reflected is None:
            skeleton.setForces(torque)
            skeleton.computeForwardDynamics()
            return np.concatenate([rate, skeleton.getAccelerations()])
        inertia = skeleton.getMassMatrix() + self.reflected
        net = torque - skeleton.getCoriolisAndGravityForces()
        return np.concatenate([rate, np.linalg.solve(inertia, net)])

    def _torques(self, t: float, state: list[float]) -> list[float]:
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


def run(loop: Loop) -> None:
    """Simulate all samples of a loop.

    Raises RuntimeError if the state does not stay finite.
    """
    plant = Plant(loop)
    state, h = plant.start(), loop.h
    for step in range(len(loop.w_ref) * SUBSTEPS):
        if not np.isfinite(state).all():
            raise RuntimeError(f"expected a finite state, got {state} in substep {step}")
        loop.substep(step, *plant.split(state.tolist()))
        state = _after(plant, step * h, state, h)


def _after(plant: Plant, t: float, state: np.ndarray, h: float) -> np.ndarray:
    """Return the state after a Runge-Kutta step of order four."""
    first = plant.rate(t, state)
    second = plant.rate(t + h / 2, state + h / 2 * first)
    third = plant.rate(t + h / 2, state + h / 2 * second)
    fourth = plant.rate(t + h, state + h * third)
    return state + h / 6 * (first + 2 * second + 2 * third + fourth)


def _body(skeleton: Skeleton, parent, joint: Joint):
    """Add a joint and its body behind ``parent``; return the body."""
    pair = skeleton.createRevoluteJointAndBodyNodePair
    revolute, body = pair() if parent is None else pair(parent)
    revolute.setAxis(np.eye(3)["xyz".index(joint.axis)])
    place = Isometry3()
    place.set_translation(np.array(joint.origin_m, dtype=float))
    revolute.setTransformFromParentBodyNode(place)
    link = joint.link
    if link is None:
        body.setInertia(Inertia(DUST_KG, np.zeros(3), DUST_KG_M2 * np.eye(3)))
    else:
        body.setInertia(Inertia(link.mass_kg, link.com_m, link.inertia_kg_m2))
    return body


def _rotor(skeleton: Skeleton, inertia_kg_m2: float) -> None:
    """Add a rotor of its own, in motor angles."""
    revolute, body = skeleton.createRevoluteJointAndBodyNodePair()
    revolute.setAxis(np.array([0.0, 0.0, 1.0]))
    body.setInertia(Inertia(ROTOR_KG, np.zeros(3), inertia_kg_m2 * np.eye(3)))
