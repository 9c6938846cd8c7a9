"""Arms in DART: a skeleton of the links, beside it a body for each rotor that drives an elastic gear.

DART gives the mass matrix and the Coriolis, centrifugal and gravity torques. Rotors of rigid gears are
reflected into the mass matrix. Runge-Kutta steps of order four are taken here, one a substep, because
DART's own integrator is of order one.
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
        # Axes whose motor is a body of its own, and those whose motor turns with the joint.
        self.geared = [i for i, m in enumerate(self.motors) if m.stiffness is not None]
        self.rigid = [i for i, m in enumerate(self.motors) if m.stiffness is None]
        self.springs = [i for i, joint in enumerate(arm.joints) if joint.ratio is None]
        self.skeleton = self._skeleton()
        self.size = self.skeleton.getNumDofs()
        self.reflected = np.zeros((self.size, self.size))
        for axis in self.rigid:
            joint, motor = self.driven[axis], self.motors[axis]
            self.reflected[joint, joint] = motor.motor_inertia / motor.ratio**2

    def _skeleton(self) -> Skeleton:
        skeleton = Skeleton(self.loop.arm.name)
        skeleton.setGravity(self.loop.arm.gravity_m_s2)
        parent = None
        for joint in self.joints:
            parent = _body(skeleton, parent, joint)
        for axis in self.geared:
            _rotor(skeleton, self.motors[axis].motor_inertia)
        return skeleton

    def start(self) -> np.ndarray:
        """Return coordinates and rates at the beginning of a log."""
        state = np.zeros(2 * self.size)
        state[: len(self.joints)] = self.loop.angles
        state[len(self.joints) : self.size] = self.loop.phi[self.geared]
        return state

    def split(self, state: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return angles and speeds of the motors, then those of the driven joints."""
        place, rate = state[: self.size], state[self.size :]
        q, v = place[self.driven], rate[self.driven]
        phi, w = q / self.loop.ratios, v / self.loop.ratios
        phi[self.geared], w[self.geared] = place[len(self.joints) :], rate[len(self.joints) :]
        return phi, w, q, v

    def rate(self, t: float, state: np.ndarray) -> np.ndarray:
        """Return the derivative of coordinates and rates."""
        skeleton, rate = self.skeleton, state[self.size :]
        skeleton.setPositions(state[: self.size])
        skeleton.setVelocities(rate)
        torque = self._torques(t, state) - skeleton.getCoriolisAndGravityForces()
        inertia = skeleton.getMassMatrix() + self.reflected
        return np.concatenate([rate, np.linalg.solve(inertia, torque)])

    def _torques(self, t: float, state: np.ndarray) -> np.ndarray:
        """Return the torques of motors, gears, springs and laws on all coordinates [Nm]."""
        loop = self.loop
        phi, w, q, v = self.split(state)
        loads = self._gears(phi, w, q, v)
        motor = loop.held - np.array([m.viscous for m in self.motors]) * w
        if loop.motor_laws:
            motor = motor + loop.motor_extra(t, phi.tolist(), w.tolist(), loads)
        out = np.zeros(self.size)
        for axis in self.rigid:
            out[self.driven[axis]] = motor[axis] / loop.ratios[axis]
        for number, axis in enumerate(self.geared, len(self.joints)):
            out[self.driven[axis]] = loads[axis]
            out[number] = motor[axis] - loop.ratios[axis] * loads[axis]
        for i in self.springs:
            spring = self.joints[i]
            out[i] = -spring.stiffness * state[i] - spring.damping * state[self.size + i]
        if loop.joint_laws:
            out[self.driven] += loop.joint_extra(t, q.tolist(), v.tolist())
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
        loop.substep(step, *plant.split(state))
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
