"""Robots with a floating base: the file format, the dynamics against Pinocchio, and conservation laws."""

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

import pinocchio_model
from axisight import BaseMotion, Robot, simulate
from axisight.errors import InputError, RobotError
from floating_robot import drifting, floating_text, inertia_of, pinocchio_motion, random_base

Array = NDArray[np.float64]

TREES: dict[str, list[int | None]] = {
    "one arm": [None, 0, 1],
    "two arms": [None, 0, 1, None, 3, 4],
    "four legs": [None, 0, 1, None, 3, 4, None, 6, 7, None, 9, 10],
    "hand": [None, 0, 1, 2, 1, 4, 1, 6, 7],
    "long chain": [None, *range(19)],
    "most joints": [None, *range(15), None, *range(16, 31)],
}
# Sums of a few hundred products on both sides, rounded at 1.1e-16, give 1e-13 of the largest. Accelerations are
# worse by the condition of the inertia matrix, below 1e4.
TOLERANCE = 1e-12
OF_ACCELERATIONS = 1e-9


def close(got: Array, wanted: Array, tolerance: float) -> None:
    """Fail if the largest difference exceeds a share of the largest number."""
    assert np.max(np.abs(got - wanted)) <= tolerance * np.max(np.abs(wanted))


@pytest.mark.parametrize("tree", TREES)
def test_dynamics_equal_those_of_pinocchios_free_flyer(tree: str):
    text = floating_text(TREES[tree])
    robot, model = Robot.from_toml(text), pinocchio_model.build(text)
    rng = np.random.default_rng(1)
    n = robot.n_joints
    for _ in range(5):
        q, v, a = rng.normal(size=(3, n))
        base, speed = random_base(rng, 1), rng.normal(size=3)
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        turn *= np.sign(np.linalg.det(turn))
        at, rates, growths = pinocchio_motion(turn, speed, base, robot.gravity_m_s2)
        pose = np.concatenate([at, q])
        tau = pin.rnea(
            model,
            model.createData(),
            pose,
            np.concatenate([rates, v]),
            np.concatenate([growths, a]),
        )
        close(robot.inverse_dynamics(q, v, a, base=base)[0], tau, TOLERANCE)
        close(robot.inertia_matrix(q), inertia_of(model, pose), TOLERANCE)
        found = robot.forward_dynamics(q, v, tau, base=base)[0]
        wanted = np.concatenate([base.parts()[2][0], base.parts()[1][0], a])
        close(found, wanted, OF_ACCELERATIONS)
        forward = pin.aba(model, model.createData(), pose, np.concatenate([rates, v]), tau)
        close(found[6:], forward[6:], OF_ACCELERATIONS)


def test_momentum_and_energy_stay_in_free_flight():
    robot = Robot.from_toml(floating_text(TREES["two arms"]))
    rng = np.random.default_rng(2)
    q, v, twist = rng.normal(size=6), rng.normal(size=6), rng.normal(size=6)

    def momentum(turn: Array, twist: Array, q: Array, v: Array) -> tuple[Array, float]:
        inertia = robot.inertia_matrix(q)
        rates = np.concatenate([twist, v])
        linear, angular = np.split((inertia @ rates)[:6], 2)
        # About the centre of mass, in world axes.
        mass = inertia[0, 0]
        m = inertia[3:6, :3] / mass
        com = np.array([m[2, 1], m[0, 2], m[1, 0]])
        about = angular - np.cross(com, linear)
        return np.concatenate([turn @ linear, turn @ about]), float(rates @ inertia @ rates / 2)

    before, energy = momentum(np.eye(3), twist, q, v)
    errors = []
    for steps in (200, 400):
        after, left = momentum(*drifting(robot, q, v, twist, np.zeros(6), 0.5 / steps, steps))
        errors.append(float(np.abs(after - before).max() + abs(left - energy)))
    # The error of RK4 falls with the fourth power of the step: 16, less what the next order takes.
    assert errors[1] < 1e-5 * np.abs(before).max()
    assert errors[1] < errors[0] / 10.0


def test_joint_torques_do_not_change_the_momentum():
    robot = Robot.from_toml(floating_text(TREES["hand"]))
    rng = np.random.default_rng(3)
    q, v, torque = rng.normal(size=(3, robot.n_joints))
    base = random_base(rng, 1)[:1]
    rate = BaseMotion(base.angular_velocity_rad_s, np.zeros((1, 3)), np.zeros((1, 3)))
    found = robot.forward_dynamics(q, v, torque, base=rate)[0]
    moved = BaseMotion(rate.angular_velocity_rad_s[0], found[3:6], found[:3])
    forces = robot.inverse_dynamics(q, v, found[6:], base=moved)
    size = np.abs(robot.inertia_matrix(q)).max() * np.abs(found).max()
    assert np.abs(forces[:6]).max() < 1e-13 * size
    assert np.abs(forces[6:] - torque).max() < 1e-13 * size


def test_the_wrench_at_rest_is_the_weight():
    robot = Robot.from_toml(floating_text(TREES["four legs"]))
    rng = np.random.default_rng(4)
    q = rng.normal(size=12)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    nothing = np.zeros(12)
    wrench = robot.inverse_dynamics(q, nothing, nothing, base=BaseMotion.at_rest(turn))[:6]
    assert robot.floating_base is not None
    links = [robot.floating_base, *(joint.link for joint in robot.joints if joint.link is not None)]
    mass = sum(link.mass_kg for link in links)
    places = [(np.eye(3), np.zeros(3)), *(robot.pose(q, joint) for joint in range(12))]
    com = sum(
        link.mass_kg * (origin + rotation @ link.com_m)
        for link, (rotation, origin) in zip(links, places, strict=True)
    )
    up = turn.T @ [0.0, 0.0, 9.81]
    close(wrench[:3], mass * up, TOLERANCE)
    close(wrench[3:], np.cross(com, up), TOLERANCE)


def test_a_base_that_does_not_move_gives_the_forces_of_a_fixed_one():
    text = floating_text(TREES["two arms"])
    cut = text.index("[base]"), text.index("[[joint]]")
    fixed = Robot.from_toml(text[: cut[0]] + text[cut[1] :])
    robot = Robot.from_toml(text)
    q, v, a = np.random.default_rng(5).normal(size=(3, 4, 6))
    base = BaseMotion.at_rest(np.eye(3))
    close(
        robot.inverse_dynamics(q, v, a, base=base)[:, 6:],
        fixed.inverse_dynamics(q, v, a),
        TOLERANCE,
    )
    close(robot.inertia_matrix(q)[:, 6:, 6:], fixed.inertia_matrix(q), TOLERANCE)


def test_an_imu_anywhere_gives_the_motion_at_the_origin():
    rng = np.random.default_rng(6)
    base = random_base(rng, 5)
    rate, growth, proper = base.parts()
    place = rng.normal(size=3)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    axes *= np.sign(np.linalg.det(axes))
    force = proper + np.cross(growth, place) + np.cross(rate, np.cross(rate, place))
    # Row vectors: axes.T turns base axes into those of the unit.
    found = BaseMotion.from_imu(
        rate @ axes, growth @ axes, force @ axes, position_m=place, rotation=axes
    )
    for got, wanted in zip(found.parts(), base.parts(), strict=True):
        close(got, wanted, TOLERANCE)


def test_shapes_follow_the_arguments():
    robot = Robot.from_toml(floating_text(TREES["one arm"]))
    q, v, a = np.random.default_rng(7).normal(size=(3, 4, 3))
    one, many = BaseMotion.at_rest(np.eye(3)), random_base(np.random.default_rng(8), 4)
    assert robot.coordinate_names[:7] == [
        *("base.x", "base.y", "base.z", "base.turn_x", "base.turn_y", "base.turn_z"),
        "j0",
    ]
    assert robot.inverse_dynamics(q[0], v[0], a[0], base=one).shape == (9,)
    assert robot.inverse_dynamics(q, v, a, base=one).shape == (4, 9)
    assert robot.inverse_dynamics(q[0], v[0], a[0], base=many).shape == (4, 9)
    assert robot.forward_dynamics(q[0], v[0], a[0], base=one).shape == (9,)
    assert robot.forward_dynamics(q, v, np.zeros((4, 9)), base=many).shape == (4, 9)
    assert robot.inertia_matrix(q).shape == (4, 9, 9)
    assert Robot.from_toml(robot.toml).floating_base is not None


def test_misuse_is_refused_by_name():
    robot = Robot.from_toml(floating_text(TREES["one arm"]))
    q, v, a = np.zeros((3, 3))
    with pytest.raises(InputError, match="expected a BaseMotion, as the base of 'flyer' floats"):
        robot.inverse_dynamics(q, v, a)
    with pytest.raises(InputError, match="expected 2 rows as q, got 3"):
        robot.inverse_dynamics(
            np.zeros((2, 3)), v, a, base=random_base(np.random.default_rng(0), 3)
        )
    with pytest.raises(InputError, match="gravity: expected a fixed base"):
        robot.gravity(q)
    with pytest.raises(InputError, match="finite"):
        BaseMotion(np.full(3, np.nan), np.zeros(3), np.zeros(3))
    with pytest.raises(InputError, match="rotation matrices"):
        BaseMotion.at_rest(2 * np.eye(3))
    fixed = Robot.from_toml(
        robot.toml.replace('kind = "floating"', 'kind = "fixed"').replace(
            robot.toml[robot.toml.index("[base.link]") : robot.toml.index("[[joint]]")], ""
        )
    )
    assert fixed.floating_base is None
    with pytest.raises(InputError, match="base: expected none"):
        fixed.inverse_dynamics(q, v, a, base=BaseMotion.at_rest(np.eye(3)))
    with pytest.raises(InputError, match="got a floating one"):
        robot.linearize()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('kind = "floating"', 'kind = "loose"', 'base.kind`: expected "fixed" or "floating"'),
        ("[base.link]", "[base.body]", "unknown key `base.body`"),
        ('kind = "floating"', 'kind = "fixed"', "expected no link, as the base is fixed"),
        ('name = "j0"', 'name = "base.x"', "a name that the floating base does not have"),
        ("axisight.robot/2", "axisight.robot/1", "unknown key `base`"),
    ],
)
def test_files_of_other_bases_are_refused(old: str, new: str, message: str):
    text = floating_text([None])
    assert text.count(old) == 1
    with pytest.raises(RobotError, match=message):
        Robot.from_toml(text.replace(old, new))


def test_no_simulation_of_a_floating_base():
    robot = Robot.from_toml(floating_text([None]))
    with pytest.raises(InputError, match="expected a fixed base, got a floating one"):
        simulate(robot, np.zeros((10, 1)))
