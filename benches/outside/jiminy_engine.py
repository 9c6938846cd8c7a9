"""Arms in Jiminy: a robot of the links, beside it a body for each rotor that drives an elastic gear.

Rotors of rigid gears are armatures of their joints. Jiminy's own Runge-Kutta integrator of order four
takes fixed steps of a substep; its controller, called as often, takes the samples.
"""

from __future__ import annotations

import numpy as np
from jiminy_py import core as jiminy
from jiminy_py.core import pinocchio as pin

from .arms import Joint
from .chain import DUST_KG, DUST_KG_M2, Chain
from .loop import SUBSTEPS, Loop

# Rotors turn about their own centre of mass, so that only their inertia about it counts.
ROTOR_KG = 1.0
JOINTS = {"x": pin.JointModelRX, "y": pin.JointModelRY, "z": pin.JointModelRZ}


class Plant(Chain):
    """A machine in Jiminy, rotors included: its bodies, and what Jiminy asks its controller for.

    It does not hold the engine, which holds it: a circle through Jiminy would never be freed.
    """

    steps: int | None = None  # substeps that have begun; None while Jiminy tries the controller

    def model(self) -> pin.Model:
        """Return the bodies."""
        model, parent = pin.Model(), 0
        for joint in self.joints:
            parent = _body(model, parent, joint)
        for axis in self.geared:
            _rotor(model, axis, self.motors[axis].motor_inertia)
        model.rotorInertia = self.reflected().diagonal().copy()
        return model

    def command(self, t, q, v, sensors, command) -> None:
        """Take a sample where one is due; Jiminy asks at the start of a substep, at zero twice."""
        if self.steps == round(t / self.loop.h):
            self.loop.substep(self.steps, *self.split([*q.tolist(), *v.tolist()]))
            self.steps += 1

    def inside(self, t, q, v, sensors, torques) -> None:
        """Set the torques on all coordinates [Nm]."""
        torques[:] = self.torques(t, [*q.tolist(), *v.tolist()])


def run(loop: Loop) -> None:
    """Simulate all samples of a loop.

    Raises RuntimeError if the state does not stay finite.
    """
    plant = Plant(loop)
    engine = _engine(plant)
    plant.steps = 0
    start = plant.start()
    length_s = len(loop.w_ref) * SUBSTEPS * loop.h
    engine.simulate(length_s, start[: plant.size], start[plant.size :])


def _engine(plant: Plant) -> jiminy.Engine:
    """Return an engine that holds the machine."""
    robot, engine = jiminy.Robot(), jiminy.Engine()
    robot.initialize(plant.model())
    robot.controller = jiminy.FunctionalController(plant.command, plant.inside)
    engine.add_robot(robot)
    options = engine.get_options()
    options["world"]["gravity"][:3] = plant.loop.arm.gravity_m_s2
    options["stepper"] |= {
        "odeSolver": "runge_kutta_4",
        "dtMax": plant.loop.h,
        "controllerUpdatePeriod": plant.loop.h,
    }
    engine.set_options(options)
    return engine


def _body(model: pin.Model, parent: int, joint: Joint) -> int:
    """Add a joint and its body behind ``parent``; return the number of the joint."""
    place = pin.SE3(np.eye(3), np.array(joint.origin_m, dtype=float))
    added = model.addJoint(parent, JOINTS[joint.axis](), place, joint.name)
    link = joint.link
    if link is None:
        inertia = pin.Inertia(DUST_KG, np.zeros(3), DUST_KG_M2 * np.eye(3))
    else:
        inertia = pin.Inertia(link.mass_kg, link.com_m, link.inertia_kg_m2)
    model.appendBodyToJoint(added, inertia, pin.SE3.Identity())
    return added


def _rotor(model: pin.Model, axis: int, inertia_kg_m2: float) -> None:
    """Add a rotor of its own, in motor angles."""
    added = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), f"rotor_{axis}")
    inertia = pin.Inertia(ROTOR_KG, np.zeros(3), inertia_kg_m2 * np.eye(3))
    model.appendBodyToJoint(added, inertia, pin.SE3.Identity())
