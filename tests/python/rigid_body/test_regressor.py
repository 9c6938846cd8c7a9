"""The torque regressor against inverse dynamics, Pinocchio and hand calculation."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
import xarray as xr
from numpy.typing import NDArray

import pinocchio_model
from axisight.errors import InputError
from axisight.rigid_body import DriveTerms, MotorCoupling, TorqueModel, torque_regressor
from axisight.robot import load_robot
from rigid_body_data import motion, parse, random_chain, robot_of, wrist_arm

Array = NDArray[np.float64]
# Pinocchio orders the inertia xx xy yy xz yz zz; the names here are in our order.
PINOCCHIO_PLACES = [0, 1, 2, 3, 4, 6, 9, 5, 7, 8]
# Sums of products of numbers of the same size: rounding of 1e-16 times the cancellation in
# long chains, where terms exceed their sum up to a thousandfold.
TOLERANCE = 1e-12


def assert_close(got: Array, want: Array, tolerance: float = TOLERANCE) -> None:
    """Every sample on its own, relative to its largest entry."""
    assert got.shape == want.shape
    axes = tuple(range(1, want.ndim))
    error = np.abs(got - want).max(axes) / np.abs(want).max(axes)
    assert error.max() < tolerance


@pytest.mark.parametrize("seed", range(30))
def test_times_parameters_is_inverse_dynamics(seed: int) -> None:
    robot = robot_of(random_chain(seed, n_joints=1 + seed % 9))
    q, v, a = motion(robot, 203, seed)
    h = torque_regressor(robot, q, v, a)
    assert h.dims == ("sample", "joint", "parameter")
    assert_close(h.values @ h.nominal.values, robot.inverse_dynamics(q, v, a))


@pytest.mark.parametrize("seed", range(40, 52))
def test_against_pinocchio(seed: int) -> None:
    text = random_chain(seed)
    robot = robot_of(text)
    model = pinocchio_model.build(text)
    data = model.createData()
    q, v, a = motion(robot, 60, seed)
    h = torque_regressor(robot, q, v, a)
    loaded = [i for i, joint in enumerate(parse(text)["joint"]) if "link" in joint]
    take = np.concatenate([10 * i + np.array(PINOCCHIO_PLACES) for i in loaded])
    want = [pin.computeJointTorqueRegressor(model, data, *row) for row in zip(q, v, a, strict=True)]
    assert_close(h.values, np.array(want)[:, :, take])


def test_parameters_are_moments_about_the_link_frame() -> None:
    robot = load_robot("irb6600_like")
    model = TorqueModel(robot)
    m, c = 260.0, np.array([0.0, -0.1883, 0.45])
    about_com = np.array([[38.0, 0, 0], [0, 36.0, 0], [0, 0, 7.0]])
    about_frame = about_com + m * (c @ c * np.eye(3) - np.outer(c, c))
    nominal = dict(zip(model.names, model.nominal, strict=True))
    assert nominal["axis2_yaw.mass"] == m
    assert nominal["axis2_yaw.mass_y"] == pytest.approx(m * c[1], rel=1e-15)
    for name, (i, j) in {"xx": (0, 0), "zz": (2, 2), "yz": (1, 2)}.items():
        assert nominal[f"axis2_yaw.inertia_{name}"] == pytest.approx(about_frame[i, j], rel=1e-14)
    assert not any(name.startswith("axis2_roll.") for name in model.names)  # massless


def test_changed_parameters_of_a_robot_count() -> None:
    core = load_robot("irb6600_like").core
    changed = type(load_robot("irb6600_like"))(core.with_parameters([("axis1.inertia_scale", 2.0)]))
    q, v, a = motion(changed, 20)
    h = torque_regressor(changed, q, v, a)
    assert_close(h.values @ h.nominal.values, changed.inverse_dynamics(q, v, a))


ALL_TERMS = DriveTerms(
    inertia=("motor", "joint"),
    viscous=("motor", "joint"),
    coulomb=("motor", "joint"),
    offset=("motor", "joint"),
)


def test_drive_terms_of_coupled_motors() -> None:
    """Against the equations written out: tau = R_tau^-1 (M q'' + .. + joint terms) + motor terms."""
    robot = robot_of(wrist_arm())
    gears = np.diag(1 / robot.gear_ratio)
    gears[5, 4] = 32.0
    loss = gears.T * 1.1
    coupling = MotorCoupling(gears, loss)
    q, v, a = motion(robot, 50)
    h = torque_regressor(robot, q, v, a, terms=ALL_TERMS, side="motor", coupling=coupling)
    assert h.dims == ("sample", "axis", "parameter")
    rng = np.random.default_rng(1)
    theta = xr.DataArray(rng.normal(size=h.sizes["parameter"]), coords={"parameter": h.parameter})
    theta[:60] = h.nominal[:60]

    def of(name: str) -> Array:
        return theta.sel(parameter=[f"axis{i}.{name}" for i in range(1, 7)]).values

    joint = robot.inverse_dynamics(q, v, a) + of("joint_rotor_inertia") * a
    joint += of("joint_viscous_friction") * v + of("joint_coulomb_friction") * np.sign(v)
    joint += of("joint_torque_offset")
    speed, growth = v @ gears.T, a @ gears.T
    motor = of("motor_inertia") * growth + of("viscous_friction") * speed
    motor += of("coulomb_friction") * np.sign(speed) + of("torque_offset")
    want = np.linalg.solve(loss, joint.T).T + motor
    assert_close(h.values @ theta.values, want)
    # The same regression on the joint side.
    h = torque_regressor(robot, q, v, a, terms=ALL_TERMS, coupling=coupling)
    assert_close(h.values @ theta.values, coupling.joint_torque(want))


def test_coupling_converts_there_and_back() -> None:
    gears = np.diag([32.0, 45.0]) + np.array([[0, 0], [32.0, 0]])
    coupling = MotorCoupling(gears)
    x = np.random.default_rng(0).normal(size=(5, 2))
    np.testing.assert_allclose(coupling.joint_motion(coupling.motor_motion(x)), x, rtol=1e-14)
    np.testing.assert_allclose(coupling.motor_torque(coupling.joint_torque(x)), x, rtol=1e-14)
    # Virtual work: the power is the same on both sides.
    power = (coupling.joint_torque(x) * x).sum()
    assert (x * coupling.motor_motion(x)).sum() == pytest.approx(power, rel=1e-14)
    # Motor 2 turns with joint 1.
    np.testing.assert_array_equal(coupling.motor_motion([1.0, 0.0]), [32.0, 32.0])
    np.testing.assert_array_equal(coupling.joint_torque([0.0, 1.0]), [32.0, 45.0])


def test_dead_band_and_smoothing_of_the_sign() -> None:
    robot = load_robot("two_mass_axis")
    v = np.array([[-2.0], [-0.1], [0.0], [0.05], [3.0]])
    zero = np.zeros_like(v)

    def coulomb(**settings: float) -> Array:
        terms = DriveTerms(coulomb="joint", **settings)
        h = torque_regressor(robot, zero, v, zero, terms=terms)
        return h.sel(parameter="axis1.joint_coulomb_friction").values[:, 0]

    np.testing.assert_array_equal(coulomb(), [-1, -1, 0, 1, 1])
    np.testing.assert_array_equal(coulomb(dead_band_rad_s=0.07), [-1, -1, 0, 0, 1])
    np.testing.assert_allclose(coulomb(smoothing_rad_s=0.5), np.tanh(v[:, 0] / 0.5), atol=1e-15)


def test_springs_balance_elastic_joints() -> None:
    robot = load_robot("irb6600_like")
    q, v, a = motion(robot, 20)
    terms = DriveTerms(springs=True)
    h = torque_regressor(robot, q, v, a, terms=terms)
    stiffness, damping = 8689000.0, 2305.0
    elastic = robot.joint_names.index("axis2_roll")
    want = robot.inverse_dynamics(q, v, a)[:, elastic]
    want += stiffness * q[:, elastic] + damping * v[:, elastic]
    got = h.sel(joint="axis2_roll").values @ h.nominal.values
    np.testing.assert_allclose(got, want, rtol=1e-11)


def test_threads_and_number_of_samples_change_no_bit() -> None:
    robot = robot_of(wrist_arm())
    q, v, a = motion(robot, 1003)
    one = torque_regressor(robot, q, v, a, terms=ALL_TERMS, threads=1)
    two = torque_regressor(robot, q, v, a, terms=ALL_TERMS, threads=2)
    np.testing.assert_array_equal(one, two)
    alone = torque_regressor(robot, q[700:701], v[700:701], a[700:701], terms=ALL_TERMS)
    np.testing.assert_array_equal(alone[0], one[700])


def test_misuse_names_the_field() -> None:
    robot = robot_of(wrist_arm())
    q, v, a = motion(robot, 5)
    bad = v.copy()
    bad[3, 1] = np.nan
    for arguments, message in [
        ((q[:, :5], v, a), r"q: expected shape \(n, 6\)"),
        ((q, v[:4], a), "v: expected 5 rows as q, got 4"),
        ((q, bad, a), "v: expected finite numbers, got 1 rows .* row 3"),
        ((q, v, a * np.inf), "a: expected finite"),
        ((q[:0], v[:0], a[:0]), "q: expected shape .* at least 1"),
        ((q, v + 1j, a), "v: expected real numbers"),
        ((q, [["x"] * 6] * 5, a), "v: expected real numbers"),
    ]:
        with pytest.raises(InputError, match=message):
            torque_regressor(robot, *arguments)
    for options, message in [
        ({"side": "link"}, "side: expected"),
        ({"coupling": MotorCoupling(np.eye(5))}, "coupling: expected matrices for 6 axes, got 5"),
    ]:
        with pytest.raises(InputError, match=message):
            torque_regressor(robot, q, v, a, **options)
    for choice, message in [
        ({"viscous": "gear"}, "viscous: expected"),
        ({"coulomb": ("motor", "motor")}, "coulomb: expected"),
        ({"dead_band_rad_s": -1.0}, "dead_band_rad_s: expected a number not below zero"),
        ({"smoothing_rad_s": np.nan}, "smoothing_rad_s: expected a number not below zero"),
    ]:
        with pytest.raises(InputError, match=message):
            DriveTerms(**choice)
    for matrix, message in [
        (np.ones((2, 3)), "position: expected a square matrix"),
        (np.ones((2, 2)), "position: expected an invertible matrix"),
        ([[np.nan]], "position: expected finite"),
        ([["a"]], "position: expected a square matrix of numbers"),
    ]:
        with pytest.raises(InputError, match=message):
            MotorCoupling(matrix)
    with pytest.raises(InputError, match="torque: expected shape"):
        MotorCoupling(np.eye(2), np.eye(3))
    with pytest.raises(InputError, match="motor: expected shape"):
        MotorCoupling(np.eye(2)).joint_motion(np.zeros((4, 3)))
