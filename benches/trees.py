"""Compare whole robots of a folder with Pinocchio: RNEA, CRBA, ABA and the regressor.

    python benches/trees.py FOLDER [--states 10] [--floating]

Every URDF below FOLDER is read by Axisight (`import_robot`, whole tree) and by Pinocchio, on a fixed base, or on a
floating one with ``--floating`` (a free flyer). Joints that follow others are locked at zero in both. The table has
the largest difference at random states, relative to the largest number: inverse dynamics (RNEA), inertia matrix
(CRBA), accelerations (ABA) and the torque regressor times the nominal parameters. A last column says which models
Axisight refuses, and why.

The robots of the page "Robots with branches" are those of example-robot-data (github.com/Gepetto/example-robot-data
and the PyPI package of this name), those of "Floating bases" also the ones of github.com/unitreerobotics/unitree_ros.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from axisight import BaseMotion, Robot
from axisight.errors import RobotError
from axisight.rigid_body import TorqueModel, floating_motion
from axisight.robot_import import import_robot

Array = NDArray[np.float64]

WANTED = 1e-9


@dataclass(frozen=True)
class Twin:
    """A robot of Axisight and the model of Pinocchio from the same file.

    ``order`` (n,) is the index in Pinocchio's velocities of each coordinate of the robot: six of a floating base,
    then the joints.
    """

    robot: Robot
    model: pin.Model
    order: Array


def twin_of(path: Path, *, floating: bool) -> Twin:
    """Return both models of a URDF; raise RobotError if Axisight refuses it."""
    robot = import_robot(path, whole_tree=True, floating=floating)
    flyer = [pin.JointModelFreeFlyer()] if floating else []
    model = pin.buildModelFromUrdf(str(path), *flyer)
    model.gravity.linear = robot.gravity_m_s2
    names = robot.joint_names
    kept = ("root_joint", *names) if floating else names
    locked = [i for i in range(1, model.njoints) if model.names[i] not in kept]
    if locked:
        model = pin.buildReducedModel(model, locked, pin.neutral(model))
    base = list(range(6 if floating else 0))
    order = np.array(base + [model.joints[model.getJointId(name)].idx_v for name in names])
    return Twin(robot, model, order)


def differences(twin: Twin, states: int, seed: int = 0) -> dict[str, float]:
    """Return the largest relative differences at random states."""
    rng = np.random.default_rng(seed)
    robot, model, order = twin.robot, twin.model, twin.order
    data, n, first = model.createData(), robot.n_joints, len(order) - robot.n_joints
    torque_model = TorqueModel(robot)
    out = dict.fromkeys(("rnea", "crba", "aba", "regressor"), 0.0)
    for _ in range(states):
        q, v, a = rng.uniform(-1.0, 1.0, size=(3, n))
        turned, speeds, accelerations = np.zeros((3, len(order)))
        turned[order[first:]], speeds[order[first:]], accelerations[order[first:]] = q, v, a
        base, along = None, (q[None], v[None], a[None])
        if first:
            turned[:6], speeds[:6], accelerations[:6] = rng.uniform(-1.0, 1.0, size=(3, 6))
        at = pin.integrate(model, pin.neutral(model), turned)
        if first:
            base = base_motion(model, at, speeds, accelerations)
            along = floating_motion(robot, *along, base)
        tau = pin.rnea(model, data, at, speeds, accelerations)
        upper = np.triu(pin.crba(model, data, at))
        inertia = upper + np.triu(upper, 1).T
        forward = pin.aba(model, data, at, speeds, tau)
        pairs = {
            "rnea": (robot.inverse_dynamics(q, v, a, base=base), tau[order]),
            "crba": (robot.inertia_matrix(q), inertia[np.ix_(order, order)]),
            "aba": (
                robot.forward_dynamics(q, v, tau[order], base=base)[first:],
                forward[order[first:]],
            ),
            "regressor": ((torque_model.matrix(*along) @ torque_model.nominal)[0], tau[order]),
        }
        for name, (got, wanted) in pairs.items():
            error = np.max(np.abs(got - wanted)) / np.max(np.abs(wanted))
            out[name] = max(out[name], float(error))
    return out


def base_motion(model: pin.Model, at: Array, speeds: Array, accelerations: Array) -> BaseMotion:
    """Return the motion of a free flyer; its linear acceleration in Pinocchio leaves out ``w x v``."""
    turn = pin.XYZQUATToSE3(at[:7]).rotation
    linear, rate = np.split(speeds[:6], 2)
    proper = accelerations[:3] + np.cross(rate, linear) - turn.T @ model.gravity.linear
    return BaseMotion(rate, accelerations[3:6], proper)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--states", type=int, default=10)
    parser.add_argument("--floating", action="store_true", help="on a floating base")
    given = parser.parse_args()
    print(f"{'robot':32} {'joints':>6} {'tips':>4}  rnea     crba     aba      regressor")
    equal = trees = refused = 0
    for path in sorted(given.folder.rglob("*.urdf")):
        try:
            twin = twin_of(path, floating=given.floating)
        except (RobotError, ValueError) as error:
            refused += 1
            print(f"{path.stem:32} refused: {' '.join(str(error).split())[-110:]}")
            continue
        found = differences(twin, given.states)
        within = all(x < WANTED for x in found.values())
        equal += within
        trees += within and not twin.robot.is_chain
        parents = {joint.parent for joint in twin.robot.joints}
        tips = sum(i not in parents for i in range(twin.robot.n_joints))
        figures = "  ".join(f"{x:.1e}" for x in found.values())
        print(f"{path.stem:32} {twin.robot.n_joints:6} {tips:4}  {figures}")
    print(f"{equal} equal at {WANTED:g}, {trees} of them with branches; {refused} refused")


if __name__ == "__main__":
    main()
