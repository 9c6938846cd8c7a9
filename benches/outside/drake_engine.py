"""Rigid arms in Drake: a multibody plant with reflected rotors, and a system of drives in its loop.

Drake's Runge-Kutta integrator of order three takes fixed steps of a substep.
"""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    RevoluteJoint,
    RotationalInertia,
    SpatialInertia,
    UnitInertia,
)
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from .loop import SUBSTEPS, Loop


class Drives(LeafSystem):
    """Joint torques of the motors: what the loop holds, and what its laws add continuously."""

    def __init__(self, loop: Loop):
        super().__init__()
        self.loop = loop
        self.DeclareVectorInputPort("state", 2 * loop.axes)
        self.DeclareVectorOutputPort("torque", loop.axes, self._torque)

    def _torque(self, context, output) -> None:
        loop, n = self.loop, self.loop.axes
        state = self.get_input_port().Eval(context)
        q, v = state[:n], state[n:]
        t = context.get_time()
        torque = np.asarray(loop.held)
        if loop.motor_laws:
            phi, w = (q / loop.ratios).tolist(), (v / loop.ratios).tolist()
            torque = torque + loop.motor_extra(t, phi, w, None)
        torque = torque / loop.ratios
        if loop.joint_laws:
            torque = torque + loop.joint_extra(t, q.tolist(), v.tolist())
        output.SetFromVector(torque)


def run(loop: Loop) -> None:
    """Simulate all samples of a loop."""
    builder = DiagramBuilder()
    plant = builder.AddSystem(_plant(loop))
    drives = builder.AddSystem(Drives(loop))
    builder.Connect(plant.get_state_output_port(), drives.get_input_port())
    builder.Connect(drives.get_output_port(), plant.get_actuation_input_port())
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    inside = plant.GetMyMutableContextFromRoot(context)
    plant.SetPositions(inside, loop.angles)
    simulator = Simulator(diagram, context)
    integrator = ResetIntegratorFromFlags(simulator, "runge_kutta3", loop.h)
    integrator.set_fixed_step_mode(True)
    simulator.Initialize()
    for step in range(len(loop.w_ref) * SUBSTEPS):
        q, v = plant.GetPositions(inside), plant.GetVelocities(inside)
        loop.substep(step, q / loop.ratios, v / loop.ratios, q, v)
        context.SetTime(
            step * loop.h
        )  # also marks what was computed from the torques before as old
        simulator.AdvanceTo((step + 1) * loop.h)


def _plant(loop: Loop) -> MultibodyPlant:
    """Return the arm with its rotors and viscous friction."""
    arm = loop.arm
    plant = MultibodyPlant(0.0)
    parent = plant.world_body()
    for joint in arm.joints:
        link = joint.link
        inertia = link.inertia_kg_m2
        central = RotationalInertia(
            inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2]
        )
        about_origin = central.ShiftFromCenterOfMass(link.mass_kg, -link.com_m)
        unit = UnitInertia()
        unit.SetFromRotationalInertia(about_origin, link.mass_kg)
        body = plant.AddRigidBody(joint.name, SpatialInertia(link.mass_kg, link.com_m, unit))
        base = FixedOffsetFrame(
            f"{joint.name}_base", parent.body_frame(), RigidTransform(joint.origin_m)
        )
        revolute = plant.AddJoint(
            RevoluteJoint(
                joint.name,
                plant.AddFrame(base),
                body.body_frame(),
                np.eye(3)["xyz".index(joint.axis)],
                joint.viscous / joint.ratio**2,
            )
        )
        actuator = plant.AddJointActuator(joint.name, revolute)
        actuator.set_default_rotor_inertia(joint.motor_inertia)
        actuator.set_default_gear_ratio(1 / joint.ratio)
        parent = body
    plant.mutable_gravity_field().set_gravity_vector(arm.gravity_m_s2)
    plant.Finalize()
    return plant
