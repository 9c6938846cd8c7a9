"""Model files of robots with a floating base, against Pinocchio and MuJoCo."""

from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray
from typer.testing import CliRunner

from axisight import BaseMotion, Robot
from axisight.cli import app
from axisight.errors import RobotError
from axisight.robot_export import to_mujoco, to_pinocchio
from axisight.robot_import import import_robot
from floating_robot import inertia_of

Array = NDArray[np.float64]

# Numbers of the file pass through a few sums and products on both sides; MuJoCo diagonalises inertias.
TOLERANCE = 1e-12
OF_MUJOCO = 1e-9

INERTIAL = """<inertial><origin xyz="0.01 0.02 {z}" rpy="0.1 0.2 0.3"/><mass value="{mass}"/>
<inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0.001" ixz="0.002" iyz="0.003"/></inertial>"""


def link(name: str, mass: float) -> str:
    """Return a URDF link."""
    return f'<link name="{name}">{INERTIAL.format(z=0.03 * mass, mass=mass)}</link>'


def joint(name: str, kind: str, parent: str, child: str) -> str:
    """Return a URDF joint."""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="0.1 0.2 -0.3" rpy="0.3 -0.2 0.5"/><axis xyz="0 0.6 0.8"/>'
        f'<limit lower="-3" upper="3" velocity="1" effort="1"/></joint>'
    )


BODY = (
    link("trunk", 5.0)
    + link("plate", 1.0)
    + "".join(link(name, 2.0) for name in ("hip", "shank", "arm"))
    + joint("bolt", "fixed", "trunk", "plate")
    + joint("hip_joint", "continuous", "plate", "hip")
    + joint("knee", "prismatic", "hip", "shank")
    + joint("shoulder", "continuous", "trunk", "arm")
)
URDF = f'<robot name="walker">{BODY}</robot>'
IN_WORLD = f'<robot name="walker"><link name="world"/>{BODY}{joint("free", "floating", "world", "trunk")}</robot>'

MJCF = """<mujoco><compiler angle="radian"/><worldbody>
<body name="stand" pos="1 0 0"/>
<body name="trunk" pos="0.1 0.2 1.0" quat="0.8 0.6 0 0"><freejoint name="root"/>
  <inertial pos="0.01 0.02 0.03" mass="5" fullinertia="0.02 0.03 0.04 0.001 0.002 0.003"/>
  <body name="bag" pos="0.1 0 0" quat="0.6 0 0.8 0">
    <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.02 0.025"/></body>
  <body name="leg" pos="0.2 0.1 0" quat="0.6 0 0 0.8"><joint name="hip" axis="0 1 0"/>
    <inertial pos="0 0 -0.1" mass="2" diaginertia="0.03 0.02 0.025"/></body>
  <body name="arm" pos="-0.2 0.1 0"><joint name="shoulder" axis="1 0 0" pos="0 0.05 0"/>
    <inertial pos="0 0 0.1" mass="1.5" diaginertia="0.03 0.02 0.025"/></body>
</body></worldbody></mujoco>"""


def close(got: Array, wanted: Array, tolerance: float) -> None:
    """Fail if the largest difference exceeds a share of the largest number."""
    assert np.max(np.abs(got - wanted)) <= tolerance * np.max(np.abs(wanted))


def equals_pinocchio(robot: Robot, model: pin.Model) -> None:
    """Fail unless forces and inertia matrix of a robot are those of a free flyer at a random state."""
    order = [*range(6), *(model.joints[model.getJointId(n)].idx_v for n in robot.joint_names)]
    rng = np.random.default_rng(0)
    q, v, a = rng.normal(size=(3, robot.n_joints))
    turned, speeds, accelerations = rng.normal(size=(3, model.nv))
    for all_, own in ((turned, q), (speeds, v), (accelerations, a)):
        all_[order[6:]] = own
    at = pin.integrate(model, pin.neutral(model), turned)
    data = model.createData()
    pin.forwardKinematics(model, data, at)
    turn = data.oMi[1].rotation
    proper = accelerations[:3] + np.cross(speeds[3:6], speeds[:3]) - turn.T @ model.gravity.linear
    base = BaseMotion(speeds[3:6], accelerations[3:6], proper)
    tau = pin.rnea(model, model.createData(), at, speeds, accelerations)
    close(robot.inverse_dynamics(q, v, a, base=base), tau[order], TOLERANCE)
    close(robot.inertia_matrix(q), inertia_of(model, at)[np.ix_(order, order)], TOLERANCE)


def test_a_urdf_equals_pinocchios_free_flyer(tmp_path: Path):
    path = tmp_path / "walker.urdf"
    path.write_text(URDF)
    robot = import_robot(path, whole_tree=True, floating=True)
    assert robot.floating_base is not None
    assert robot.floating_base.mass_kg == 6.0
    equals_pinocchio(robot, pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer()))
    equals_pinocchio(robot, to_pinocchio(robot))
    # The file as text, and the same model from Pinocchio.
    equals_pinocchio(Robot.from_toml(robot.toml), to_pinocchio(robot))
    again = import_robot(to_pinocchio(robot), whole_tree=True, floating=True)
    equals_pinocchio(again, to_pinocchio(robot))


def test_the_base_is_the_body_on_the_free_joint(tmp_path: Path):
    path = tmp_path / "walker.urdf"
    path.write_text(IN_WORLD)
    robot = import_robot(path, whole_tree=True, floating=True)
    equals_pinocchio(robot, pin.buildModelFromUrdf(str(path)))
    with pytest.raises(RobotError, match="floating"):
        import_robot(path, whole_tree=True)


def test_one_leg_of_a_urdf_carries_the_rest_in_its_base(tmp_path: Path):
    path = tmp_path / "walker.urdf"
    path.write_text(URDF)
    robot = import_robot(path, tip="shank", floating=True)
    assert robot.floating_base is not None
    assert robot.floating_base.mass_kg == 8.0
    model = pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer())
    locked = [model.getJointId("shoulder")]
    equals_pinocchio(robot, pin.buildReducedModel(model, locked, pin.neutral(model)))
    assert "locked at zero, masses carried along: shoulder" in robot.toml


def mujoco_inertia(model: mujoco.MjModel, data: mujoco.MjData, names: list[str]) -> Array:
    """Return the inertia matrix in base axes; the first six rates of MuJoCo are in world and in body axes."""
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    order = [*range(6), *(int(model.joint(name).dofadr[0]) for name in names)]
    turn = np.eye(model.nv)
    turn[:3, :3] = data.body("trunk" if "trunk" in str(model.names) else "base").xmat.reshape(3, 3)
    return (turn.T @ full @ turn)[np.ix_(order, order)]


def test_an_mjcf_equals_mujoco(tmp_path: Path):
    path = tmp_path / "walker.xml"
    path.write_text(MJCF)
    robot = import_robot(path, whole_tree=True, floating=True)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    rng = np.random.default_rng(1)
    quaternion = rng.normal(size=4)
    q, v, a = rng.normal(size=(3, 2))
    data.qpos[:] = [*rng.normal(size=3), *(quaternion / np.linalg.norm(quaternion)), *q]
    data.qvel[:] = [*rng.normal(size=6), *v]
    data.qacc[:] = [*rng.normal(size=6), *a]
    mujoco.mj_inverse(model, data)
    turn = data.body("trunk").xmat.reshape(3, 3)
    base = BaseMotion(data.qvel[3:6], data.qacc[3:6], turn.T @ (data.qacc[:3] - model.opt.gravity))
    found = robot.inverse_dynamics(q, v, a, base=base)
    force = np.concatenate([turn.T @ data.qfrc_inverse[:3], data.qfrc_inverse[3:]])
    close(found, force, OF_MUJOCO)
    close(robot.inertia_matrix(q), mujoco_inertia(model, data, robot.joint_names), OF_MUJOCO)
    # Written again by the export.
    exported = to_mujoco(robot)
    other = mujoco.MjData(exported)
    other.qpos[:] = data.qpos
    mujoco.mj_forward(exported, other)
    close(robot.inertia_matrix(q), mujoco_inertia(exported, other, robot.joint_names), OF_MUJOCO)


def test_bases_that_cannot_float_are_refused(tmp_path: Path):
    path = tmp_path / "robot.urdf"
    massless = URDF.replace(link("trunk", 5.0), '<link name="trunk"/>')
    path.write_text(massless.replace(link("plate", 1.0), '<link name="plate"/>'))
    with pytest.raises(RobotError, match="expected a mass on the floating base 'trunk'"):
        import_robot(path, whole_tree=True, floating=True)
    path = tmp_path / "two.xml"
    second = MJCF[MJCF.index('<body name="trunk"') : MJCF.index("</worldbody>")]
    for name in ("trunk", "bag", "leg", "arm"):
        second = second.replace(f'"{name}"', f'"other {name}"')
    for name in ("root", "hip", "shoulder"):
        second = second.replace(f'"{name}"', f'"other {name}"')
    path.write_text(MJCF.replace("</worldbody>", second + "</worldbody>"))
    with pytest.raises(RobotError, match=r"expected one free joint, got 2.*trunk, other trunk"):
        import_robot(path, whole_tree=True, floating=True)
    robot = import_robot(path, base="other trunk", whole_tree=True, floating=True)
    assert robot.joint_names == ["other hip", "other shoulder"]


def test_the_command_line_writes_a_floating_base(tmp_path: Path):
    path, out = tmp_path / "walker.urdf", tmp_path / "walker.toml"
    path.write_text(URDF)
    done = CliRunner().invoke(
        app, ["robot", "import", str(path), "--whole-tree", "--floating", "-o", str(out)]
    )
    assert done.exit_code == 0, done.output
    robot = Robot.from_toml(out.read_text())
    assert robot.floating_base is not None
    assert robot.floating_base.mass_kg == 6.0
