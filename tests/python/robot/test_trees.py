"""Robots with branches: the file format, and the dynamics against Pinocchio on random trees."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

import pinocchio_model
from axisight import Effect, Robot
from axisight.calibration import nominal_geometry
from axisight.errors import InputError, RobotError
from axisight.paths import tool_path
from axisight.rigid_body import TorqueModel, base_parameters
from axisight.robot_export import to_mujoco, to_pinocchio

Array = NDArray[np.float64]

# Sums of a few hundred products on both sides, rounded at 1.1e-16, give 1e-13 of the largest. Accelerations are
# worse by the condition of the inertia matrix, below 1e4.
TOLERANCE = 1e-12
OF_ACCELERATIONS = 1e-9


def text_of(parents: Sequence[int | None], rng: np.random.Generator) -> str:
    """Return a robot file with random joints and links, each on the joint of its parent."""
    tables = []
    for i, parent in enumerate(parents):
        axis = rng.normal(size=3) if rng.random() < 0.5 else np.eye(3)[rng.integers(3)]
        axis /= np.linalg.norm(axis)
        turned = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        inertia = turned @ np.diag(rng.uniform(1.0, 1.9, size=3)) @ turned.T
        xx, yy, zz, xy, xz, yz = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].tolist()
        stated = "" if parent == (i - 1 if i else None) else f'parent = "{_name(parent)}"\n'
        tables.append(f"""
[[joint]]
name = "j{i}"
{stated}kind = "driven"
motion = "{"prismatic" if rng.random() < 0.3 else "revolute"}"
origin = {rng.normal(size=3).tolist()}
axis = {axis.tolist()}
[joint.link]
mass = {rng.uniform(0.5, 5.0)}
com = {rng.normal(size=3).tolist()}
inertia = [{xx}, {yy}, {zz}, {xy}, {xz}, {yz}]
[joint.drive]
gear_ratio = 0.01
motor_inertia = 1e-3
viscous_friction = 0.01
""")
    head = 'schema = "axisight.robot/2"\nname = "tree"\ngravity = [0.3, -0.5, -9.81]\nsample_time = 1e-3\n'
    return head + "".join(tables)


def _name(parent: int | None) -> str:
    return "base" if parent is None else f"j{parent}"


def drawn(n: int, rng: np.random.Generator, *, in_order: bool) -> list[int | None]:
    """Return random parents of ``n`` joints; ``in_order``: every branch is whole before the next begins."""
    out: list[int | None] = [None]
    for i in range(1, n):
        path = [i - 1]
        while in_order and (before := out[path[-1]]) is not None:
            path.append(before)
        known = [None, *path] if in_order else [None, *range(i)]
        # Mostly on the joint before, so that branches are long.
        out.append(known[int(rng.integers(len(known)))] if rng.random() < 0.5 else i - 1)
    return out


@pytest.mark.parametrize("in_order", [True, False])
@pytest.mark.parametrize("n", [2, 5, 7, 8, 15, 32])
def test_dynamics_equal_pinocchio(n: int, in_order: bool):
    rng = np.random.default_rng(n)
    for _ in range(5):
        text = text_of(drawn(n, rng, in_order=in_order), rng)
        robot, model = Robot.from_toml(text), pinocchio_model.build(text)
        data = model.createData()
        q, v, a = rng.normal(size=(3, n))
        tau = pin.rnea(model, data, q, v, a)
        close(robot.inverse_dynamics(q, v, a), tau, TOLERANCE)
        inertia = robot.inertia_matrix(q)
        if in_order:
            close(inertia, pinocchio_model.inertia_matrix(model, data, q), TOLERANCE)
        # Pinocchio's inertia matrix needs joints in order of branches; its inverse dynamics does not.
        weight = pin.rnea(model, data, q, 0 * v, 0 * v)
        columns = [pin.rnea(model, data, q, 0 * v, unit) - weight for unit in np.eye(n)]
        close(inertia, np.array(columns), TOLERANCE)
        close(robot.gravity(q), pin.computeGeneralizedGravity(model, data, q), TOLERANCE)
        close(robot.forward_dynamics(q, v, tau), pin.aba(model, data, q, v, tau), OF_ACCELERATIONS)
        joint, point = int(rng.integers(n)), rng.normal(size=3)
        jacobian = pinocchio_model.point_jacobian(model, data, q, joint, point)
        close(robot.jacobian(q, joint, point.tolist()), jacobian, TOLERANCE)
        exported = to_pinocchio(robot)
        close(pin.rnea(exported, exported.createData(), q, v, a), tau, TOLERANCE)


def close(got: Array, wanted: Array, tolerance: float) -> None:
    """Fail if the largest difference exceeds a share of the largest number."""
    assert np.max(np.abs(got - wanted)) <= tolerance * max(1.0, float(np.max(np.abs(wanted))))


def test_the_regressor_equals_pinocchios_forces():
    rng = np.random.default_rng(3)
    text = text_of([None, 0, 1, 0, 3, None, 5], rng)
    model = TorqueModel(Robot.from_toml(text))
    q, v, a = rng.normal(size=(3, 20, 7))
    other = pinocchio_model.build(text)
    wanted = [pin.rnea(other, other.createData(), *state) for state in zip(q, v, a, strict=True)]
    close(model.matrix(q, v, a) @ model.nominal, np.array(wanted), TOLERANCE)


def test_base_parameters_of_two_arms_are_those_of_each():
    rng = np.random.default_rng(12)
    tables = text_of([None, 0, 1], rng).split("[[joint]]")
    renamed = [table.replace('"j', '"k') for table in tables[1:]]
    renamed[0] = renamed[0].replace('name = "k0"\n', 'name = "k0"\nparent = "base"\n')
    one = Robot.from_toml("[[joint]]".join(tables))
    two = Robot.from_toml("[[joint]]".join([*tables, *renamed]))
    alone, both = base_parameters(one), base_parameters(two)
    assert len(both.columns) == 2 * len(alone.columns)


def test_a_stated_parent_before_changes_nothing():
    rng = np.random.default_rng(4)
    text = text_of([None, 0, 1], rng)
    stated = text.replace('name = "j2"\n', 'name = "j2"\nparent = "j1"\n').replace(
        'name = "j0"\n', 'name = "j0"\nparent = "base"\n'
    )
    one, two = Robot.from_toml(text), Robot.from_toml(stated)
    q, v, a = rng.normal(size=(3, 3))
    assert np.array_equal(one.inverse_dynamics(q, v, a), two.inverse_dynamics(q, v, a))
    assert one.is_chain and two.is_chain
    assert [joint.parent for joint in two.joints] == [None, 0, 1]


@pytest.mark.parametrize(
    ("parent", "message"),
    [
        (
            '"j3"',
            r"joint\[2\]\.parent`: expected the name of a joint before this one.*j0, base.*j3",
        ),
        ('"j1"', r"joint\[2\]\.parent`: expected the name of a joint before this one"),
        ("0", r"joint\[2\]\.parent`: expected a string, got 0"),
    ],
)
def test_parents_that_come_later_or_are_the_joint_itself_are_refused(parent: str, message: str):
    text = text_of([None, 0, 1, 2], np.random.default_rng(5))
    with pytest.raises(RobotError, match=message):
        Robot.from_toml(text.replace('name = "j1"\n', f'name = "j1"\nparent = {parent}\n'))


def test_a_joint_called_base_makes_the_parent_base_ambiguous():
    text = text_of([None, 0, None], np.random.default_rng(6)).replace('"j0"', '"base"')
    with pytest.raises(RobotError, match=r"joint\[3\]\.parent`: expected a name of one thing only"):
        Robot.from_toml(text)


def test_version_one_has_no_parents():
    text = text_of([None, None], np.random.default_rng(7)).replace("robot/2", "robot/1")
    with pytest.raises(RobotError, match=r"unknown key `joint\[2\]\.parent`"):
        Robot.from_toml(text)


def test_effects_at_the_tip_refuse_branches():
    robot = Robot.from_toml(text_of([None, None], np.random.default_rng(8)))
    with pytest.raises(InputError, match=r"payload.*without branches.*link_mass"):
        robot.with_effects([Effect("payload", None, {"mass_kg": 1.0})])
    stated = robot.toml + '[[effect]]\nname = "payload"\nmass_kg = 1.0\n'
    with pytest.raises(
        RobotError, match=r"effect\[1\]\.name`: expected an effect of robots with branches"
    ):
        Robot.from_toml(stated)


def test_a_branch_without_mass_is_refused():
    text = text_of([None, 0, 0], np.random.default_rng(9))
    head, rest = text.split('name = "j1"')
    link = rest[rest.index("[joint.link]") : rest.index("[joint.drive]")]
    rest = rest.replace(link, "", 1).replace("motor_inertia = 1e-3", "motor_inertia = 0.0", 1)
    with pytest.raises(RobotError, match=r"joint\[2\]\.link.*singular"):
        Robot.from_toml(f'{head}name = "j1"{rest}')


def test_elastic_joints_belong_to_the_axis_before_them():
    text = text_of([None, None, 0], np.random.default_rng(10)).replace(
        'name = "j2"\nparent = "j0"\nkind = "driven"',
        'name = "j2"\nparent = "j0"\nkind = "elastic"\nstiffness = 100.0\ndamping = 1.0',
    )
    robot = Robot.from_toml(text[: text.rindex("[joint.drive]")])
    assert robot.axis_parameter(1, "stiffness") == "j2.stiffness"
    assert robot.axis_parameter(2, "stiffness") is None


def test_mujoco_has_the_same_inertia():
    mujoco = pytest.importorskip("mujoco")
    rng = np.random.default_rng(11)
    robot = Robot.from_toml(text_of([None, 0, 1, 0, 3, None], rng))
    model = to_mujoco(robot)
    data = mujoco.MjData(model)
    names = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, i) for i in range(6)]
    order = [names.index(name) for name in robot.joint_names]
    q = rng.normal(size=6)
    data.qpos[order] = q
    mujoco.mj_forward(model, data)
    full = np.zeros((6, 6))
    for column, unit in zip(full, np.eye(6), strict=True):
        mujoco.mj_mulM(model, data, column, unit)
    rotors = np.eye(6) * 1e-3 / 0.01**2
    # MuJoCo diagonalises inertias, which rounds them at about 1e-10.
    close(full[np.ix_(order, order)] - rotors, robot.inertia_matrix(q), 1e-8)
    close(data.qfrc_bias[order], robot.gravity(q), 1e-8)


def test_what_needs_one_chain_refuses_branches():
    robot = Robot.from_toml(text_of([None, 0, 0], np.random.default_rng(13)))
    named = r"needs, got branches: j2 is on j0\. Cut out one chain"
    with pytest.raises(RobotError, match=f"the calibration of one tool {named}"):
        nominal_geometry(robot)
    with pytest.raises(RobotError, match=f"a path of the tool {named}"):
        tool_path(robot, [[0.1, 0.2, 0.3]], start_rad=[0.0, 0.0, 0.0])
