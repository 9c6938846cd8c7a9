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
from .chain import DUST_KG, DUST_KG_M2, Stepped, march
from .loop import Loop

# Rotors turn about their own centre of mass, so that only their inertia about it counts.
ROTOR_KG = 1.0


class Plant(Stepped):
    """A machine in DART, rotors of elastic gears included."""

    def __init__(self, loop: Loop):
        super().__init__(loop)
        self.skeleton = self._skeleton()
        all_elastic = len(self.geared) == len(self.motors)
        self.rotors = None if all_elastic else self.reflected()

    def _skeleton(self) -> Skeleton:
        skeleton = Skeleton(self.loop.arm.name)
        skeleton.setGravity(self.loop.arm.gravity_m_s2)
        parent = None
        for joint in self.joints:
            parent = _body(skeleton, parent, joint)
        for axis in self.geared:
            _rotor(skeleton, self.motors[axis].motor_inertia)
        return skeleton

    def rate(self, t: float, state: np.ndarray) -> np.ndarray:
        """Return the derivative of coordinates and rates."""
        skeleton, rate = self.skeleton, state[self.size :]
        skeleton.setPositions(state[: self.size])
        skeleton.setVelocities(rate)
        torque = self.torques(t, state.tolist())
        if self.rotors is None:
            skeleton.setForces(torque)
            skeleton.computeForwardDynamics()
            return np.concatenate([rate, skeleton.getAccelerations()])
        inertia = skeleton.getMassMatrix() + self.rotors
        net = torque - skeleton.getCoriolisAndGravityForces()
        return np.concatenate([rate, np.linalg.solve(inertia, net)])


def run(loop: Loop) -> None:
    """Simulate all samples of a loop.

    Raises RuntimeError if the state does not stay finite.
    """
    march(Plant(loop))


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
