"""Elastic arms in Exudyn: a kinematic tree of links, a rotor per motor, spring dampers as gears.

Rotors are coordinates on the joint side of their gears. Exudyn's explicit Runge-Kutta solver of order
four takes the steps.
"""

from __future__ import annotations

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    CoordinateSpringDamper,
    MarkerNodeCoordinate,
    NodeGenericODE2,
    ObjectGenericODE2,
    ObjectKinematicTree,
)

from .loop import SUBSTEPS, Loop

exu.config.printToConsole = False  # warnings of memory that user functions take
COORDINATES = exu.OutputVariableType.Coordinates
RATES = exu.OutputVariableType.Coordinates_t
TYPES = {
    "x": exu.JointType.RevoluteX,
    "y": exu.JointType.RevoluteY,
    "z": exu.JointType.RevoluteZ,
}


def run(loop: Loop) -> None:
    """Simulate all samples of a loop."""
    arm = loop.arm
    driven, ratios = arm.driven, loop.ratios
    system = exu.SystemContainer()
    mbs = system.AddSystem()
    tree = _tree(mbs, loop)
    rotors = mbs.AddNode(
        NodeGenericODE2(
            referenceCoordinates=[0.0] * loop.axes,
            initialCoordinates=list(loop.phi * ratios),
            initialCoordinates_t=[0.0] * loop.axes,
            numberOfODE2Coordinates=loop.axes,
        )
    )

    def state():
        angles, rates = mbs.GetNodeOutput(tree, COORDINATES), mbs.GetNodeOutput(tree, RATES)
        return np.atleast_1d(angles)[driven], np.atleast_1d(rates)[driven]

    def gear_torques(theta, theta_t) -> list[float]:
        q, v = state()
        torques = []
        for axis, joint in enumerate(driven):
            gear, part = loop.gears[axis], arm.joints[joint]
            delta, rate = theta[axis] - q[axis], theta_t[axis] - v[axis]
            if gear is None:
                torques.append(part.stiffness * delta + part.damping * rate)
            else:
                phi, w = theta[axis] / ratios[axis], theta_t[axis] / ratios[axis]
                torques.append(gear(delta, rate, phi, w))
        return torques

    def drive(_, t, item, theta, theta_t):
        load = gear_torques(theta, theta_t) if loop.needs_load else None
        phi = [a / r for a, r in zip(theta, ratios, strict=True)]
        w = [a / r for a, r in zip(theta_t, ratios, strict=True)]
        extra = loop.motor_extra(t, phi, w, load)
        return [(u + e) / r for u, e, r in zip(loop.held, extra, ratios, strict=True)]

    motors = [arm.joints[joint] for joint in driven]
    mbs.AddObject(
        ObjectGenericODE2(
            nodeNumbers=[rotors],
            massMatrix=np.diag([m.motor_inertia for m in motors] / ratios**2),
            dampingMatrix=np.diag([m.viscous for m in motors] / ratios**2),
            forceUserFunction=drive,
        )
    )
    for axis in range(loop.axes):
        _gear(mbs, loop, axis, rotors, tree)
    step = [0]

    def before_step(_, t) -> bool:
        q, v = state()
        theta = np.atleast_1d(mbs.GetNodeOutput(rotors, COORDINATES))
        theta_t = np.atleast_1d(mbs.GetNodeOutput(rotors, RATES))
        loop.substep(step[0], theta / ratios, theta_t / ratios, q, v)
        step[0] += 1
        return True

    mbs.SetPreStepUserFunction(before_step)
    mbs.Assemble()
    settings = exu.SimulationSettings()
    steps = len(loop.w_ref) * SUBSTEPS
    settings.timeIntegration.numberOfSteps = steps
    settings.timeIntegration.endTime = steps * loop.h
    settings.timeIntegration.verboseMode = 0
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = steps * loop.h
    settings.displayStatistics = settings.displayComputationTime = False
    mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.RK44)


def _tree(mbs, loop: Loop) -> int:
    """Add the links; return the node of their joint angles."""
    arm = loop.arm
    count = len(arm.joints)
    node = mbs.AddNode(
        NodeGenericODE2(
            referenceCoordinates=[0.0] * count,
            initialCoordinates=list(loop.angles),
            initialCoordinates_t=[0.0] * count,
            numberOfODE2Coordinates=count,
        )
    )
    links = [joint.link for joint in arm.joints]
    elastic = [joint.ratio is None for joint in arm.joints]
    pairs = list(zip(arm.joints, elastic, strict=True))

    def pulls(_, t, item, q, q_t):
        out = [0.0] * count
        extra = loop.joint_extra(t, [q[i] for i in arm.driven], [q_t[i] for i in arm.driven])
        for joint, torque in zip(arm.driven, extra, strict=True):
            out[joint] = torque
        return out

    mbs.AddObject(
        ObjectKinematicTree(
            nodeNumber=node,
            gravity=list(arm.gravity_m_s2),
            jointTypes=[TYPES[joint.axis] for joint in arm.joints],
            linkParents=[i - 1 for i in range(count)],
            jointTransformations=exu.Matrix3DList([np.eye(3)] * count),
            jointOffsets=exu.Vector3DList([list(joint.origin_m) for joint in arm.joints]),
            linkInertiasCOM=exu.Matrix3DList(
                [np.zeros((3, 3)) if link is None else link.inertia_kg_m2 for link in links]
            ),
            linkCOMs=exu.Vector3DList([[0.0] * 3 if k is None else list(k.com_m) for k in links]),
            linkMasses=[0.0 if link is None else link.mass_kg for link in links],
            jointPControlVector=[joint.stiffness if e else 0.0 for joint, e in pairs],
            jointDControlVector=[joint.damping if e else 0.0 for joint, e in pairs],
            jointPositionOffsetVector=[0.0] * count,
            jointVelocityOffsetVector=[0.0] * count,
            forceUserFunction=pulls if loop.joint_laws else 0,
        )
    )
    return node


def _gear(mbs, loop: Loop, axis: int, rotors: int, tree: int) -> None:
    """Add the gear of an axis between its rotor and its joint."""
    joint = loop.arm.driven[axis]
    part, ratio, law = loop.arm.joints[joint], loop.ratios[axis], loop.gears[axis]
    markers = [
        mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=tree, coordinate=joint)),
        mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=rotors, coordinate=axis)),
    ]

    def torque(_, t, item, delta, rate, stiffness, damping, offset):
        theta = np.atleast_1d(mbs.GetNodeOutput(rotors, COORDINATES))[axis]
        theta_t = np.atleast_1d(mbs.GetNodeOutput(rotors, RATES))[axis]
        return law(delta, rate, theta / ratio, theta_t / ratio)

    mbs.AddObject(
        CoordinateSpringDamper(
            markerNumbers=markers,
            stiffness=part.stiffness,
            damping=part.damping,
            springForceUserFunction=0 if law is None else torque,
        )
    )
