"""Rigid-body algorithms against Pinocchio at a thousand random states."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

import pinocchio_model
from axisight import _core

Array = NDArray[np.float64]
COUNT = 1000
# For the forward dynamics, rounding of 1e-15 times the condition number of the inertia
# matrix, below 1e5 away from singular poses, ten-fold. All else is sums of products.
TOLERANCE = 1e-9

MIXED = """
schema = "axisight.robot/1"
name = "rail, swing, reach, wrist"
gravity = [0.5, -1.0, -9.81]
sample_time = 1e-3
[[joint]]
name = "rail"
kind = "driven"
motion = "prismatic"
origin = [0, 0, 0.2]
axis = [1, 0, 0]
link = { mass = 30, com = [0.1, 0, 0.05], inertia = [2, 3, 4, 0.1, -0.2, 0.3] }
drive = { gear_ratio = 0.01, motor_inertia = 0.001, viscous_friction = 0.001 }
[[joint]]
name = "swing"
kind = "driven"
origin = [0.1, 0.2, 0.3]
axis = [0.6, 0, 0.8]
link = { mass = 12, com = [0.2, -0.1, 0.3], inertia = [1, 1.2, 0.7, 0.05, 0.1, -0.1] }
drive = { gear_ratio = 0.01, motor_inertia = 0.001, viscous_friction = 0.001 }
[[joint]]
name = "reach"
kind = "driven"
motion = "prismatic"
origin = [0, 0, 0]
axis = [0, 0.6, -0.8]
drive = { gear_ratio = 0.01, motor_inertia = 0.001, viscous_friction = 0.001 }
[[joint]]
name = "wrist"
kind = "elastic"
origin = [0.4, 0, 0]
axis = [0, 1, 0]
stiffness = 1e4
damping = 10
link = { mass = 5, com = [0.1, 0.05, -0.1], inertia = [0.2, 0.3, 0.25, 0.01, 0, 0.02] }
[controller]
kind = "none"
[sensor]
position_noise_std = 0
[operating_point]
joint_angle = [0, 0, 0]
"""


class Case:
    """A robot, its Pinocchio model and random states."""

    def __init__(self, text: str) -> None:
        self.robot = _core.Robot.from_toml(text)
        self.model = pinocchio_model.build(text)
        self.data = self.model.createData()
        rng = np.random.default_rng(4)
        shape = (COUNT, self.robot.n_joints)
        self.q = rng.uniform(-np.pi, np.pi, shape)
        self.v = rng.normal(0, 2, shape)
        self.a = rng.normal(0, 5, shape)

    def rnea(self, q: Array, v: Array, a: Array) -> Array:
        rows = zip(q, v, a, strict=True)
        return np.array([pin.rnea(self.model, self.data, *row) for row in rows])


@pytest.fixture(scope="module", params=["preset", "mixed"])
def case(request: pytest.FixtureRequest, repository: Path) -> Case:
    if request.param == "mixed":
        return Case(MIXED)
    return Case((repository / "python/axisight/robot/presets/irb6600_like.toml").read_text())


def assert_close(got: Array, want: Array, tolerance: float = TOLERANCE) -> None:
    """Every state on its own, relative to its largest entry."""
    assert got.shape == want.shape
    assert np.isfinite(got).all()
    axes = tuple(range(1, want.ndim))
    error = np.abs(got - want).max(axes) / np.abs(want).max(axes)
    assert error.max() < tolerance


def test_inertia_matrix(case: Case) -> None:
    want = [pinocchio_model.inertia_matrix(case.model, case.data, q) for q in case.q]
    assert_close(case.robot.inertia_matrix(case.q), np.array(want), 1e-13)


def test_bias(case: Case) -> None:
    assert_close(case.robot.bias(case.q, case.v), case.rnea(case.q, case.v, 0 * case.a), 1e-12)


def test_gravity(case: Case) -> None:
    want = case.rnea(case.q, 0 * case.v, 0 * case.a)
    assert_close(case.robot.gravity(case.q), want, 1e-12)


def test_inverse_dynamics(case: Case) -> None:
    want = case.rnea(case.q, case.v, case.a)
    assert_close(case.robot.inverse_dynamics(case.q, case.v, case.a), want, 1e-12)


def test_forward_dynamics(case: Case) -> None:
    # Where the middle one of three axes through a point is a right angle off, the outer two
    # line up and the inertia matrix is singular; elastic joints never get there.
    q = case.q.copy()
    elastic = [i for i in range(q.shape[1]) if i not in case.robot.axis_joints]
    q[:, elastic] /= np.pi
    tau = 100 * case.a
    rows = zip(q, case.v, tau, strict=True)
    want = np.array([pin.aba(case.model, case.data, *row) for row in rows])
    assert_close(case.robot.forward_dynamics(q, case.v, tau), want)


def test_energy(case: Case) -> None:
    got = case.robot.energy(case.q, case.v)
    kinetic = [
        pin.computeKineticEnergy(case.model, case.data, q, v)
        for q, v in zip(case.q, case.v, strict=True)
    ]
    potential = [pin.computePotentialEnergy(case.model, case.data, q) for q in case.q]
    assert_close(got[:, :1], np.array(kinetic)[:, None], 1e-12)
    # A potential may be near zero by chance: relative to the largest one.
    assert np.abs(got[:, 1] - potential).max() < 1e-12 * np.abs(potential).max()


def test_pose(case: Case) -> None:
    for q in case.q:
        pin.forwardKinematics(case.model, case.data, q)
        for joint in range(case.robot.n_joints):
            rotation, origin = case.robot.pose(q.tolist(), joint)
            placement = case.data.oMi[joint + 1]
            assert np.abs(rotation - placement.rotation).max() < 1e-13
            assert np.abs(origin - placement.translation).max() < 1e-13 * (1 + np.abs(q).max())


def test_jacobian(case: Case) -> None:
    point = np.array([0.3, -0.2, 0.5])
    last = case.robot.n_joints - 1
    for joint in (last, last // 2):
        for q in case.q[: COUNT // 2]:
            got = case.robot.jacobian(q.tolist(), joint, point.tolist())
            want = pinocchio_model.point_jacobian(case.model, case.data, q, joint, point)
            assert np.abs(got - want).max() < 1e-12 * np.abs(want).max()


def test_wrong_shapes_name_the_argument(case: Case) -> None:
    n = case.robot.n_joints
    with pytest.raises(ValueError, match=rf"q: expected shape \(n, {n}\)"):
        case.robot.gravity(np.zeros((3, n + 1)))
    with pytest.raises(ValueError, match="v: expected 3 rows, got 2"):
        case.robot.bias(np.zeros((3, n)), np.zeros((2, n)))
    with pytest.raises(ValueError, match="q: expected finite values"):
        case.robot.gravity(np.full((1, n), np.nan))
