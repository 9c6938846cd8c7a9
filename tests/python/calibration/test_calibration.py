"""Calibration: Jacobians against the robot and Pinocchio, recovery, intervals, misuse."""

import dataclasses

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from axisight.calibration import (
    Distances,
    Poses,
    Positions,
    SamePoint,
    calibrate,
    identify,
    nominal_geometry,
)
from axisight.calibration.geometry import GROUPS
from axisight.calibration.measurements import check, load_torque
from axisight.errors import InputError
from axisight.statistics.evaluation import last_value
from calibration_data import LOADS, arm, configurations, measured, nominal, truth

NOISE_M = 5e-5
PARTS = ("offset", "tilt", "origin", "tool", "base")


@pytest.fixture(scope="module")
def robot():
    return arm()


def noisy(robot, seed, n=60, groups=GROUPS, payload=0.0):
    errors, theta = truth(robot, groups=groups, rotation=False)
    q = configurations(n, 3)
    _, p = measured(robot, errors.geometry(theta), q, payload)
    noise = np.random.default_rng((seed, 7)).normal(0, NOISE_M, p.shape)
    return errors, theta, Positions(q, p + noise, std_m=NOISE_M, payload_kg=payload)


def test_nominal_tool_is_where_the_robot_says(robot):
    start = nominal_geometry(robot, tool_position_m=(0.2, 0.05, 0.1))
    for q in configurations(10, 0):
        rotations, positions = start.tool_location([q])
        rotation, origin = robot.pose(q)
        assert np.abs(rotations[0] - rotation).max() < 1e-14
        assert np.abs(positions[0] - origin - rotation @ [0.2, 0.05, 0.1]).max() < 1e-14


def test_offset_columns_are_the_jacobian_of_the_robot(robot):
    errors, theta = truth(robot)
    q = configurations(10, 0)
    _, derivative = errors.jacobian(np.zeros_like(theta), q, np.zeros((10, 6)))
    columns = [k for k, (group, _, _) in enumerate(errors.kinds) if group == "offset"]
    for row, angles in enumerate(q):
        want = robot.jacobian(angles, -1, (0.2, 0.05, 0.1))
        assert np.abs(derivative[row][:, columns] - want).max() < 1e-13


def test_deflected_arm_is_where_its_springs_are_in_balance(robot):
    # The angle ahead of the spring is r phi: the robot's own equilibrium, gravity and springs.
    start = nominal(robot)
    for q in configurations(5, 4):
        rest = robot.equilibrium(q)
        ahead = rest["motor_angle_rad"].values * robot.gear_ratio
        torque = load_torque(robot, ahead[None], np.zeros(1), LOADS)
        _, position = start.tool_location(ahead[None], torque)
        rotation, origin = robot.pose(rest["joint_angle_rad"].values)
        deflection = np.abs(ahead - q).max()
        # Torque is taken before deflection: second order, times 2.5 m of reach.
        off = start.base_position_m + origin + rotation @ start.tool_position_m - position[0]
        assert np.abs(off).max() < 10 * deflection**2
        assert deflection > 1e-4


def test_payload_is_a_weight(robot):
    q = configurations(5, 1)
    extra = load_torque(robot, q, np.full(5, 20.0), LOADS) - robot.gravity(q)
    for row, angles in enumerate(q):
        step = 1e-6

        def height(at):
            rotation, origin = robot.pose(at)
            return (origin + rotation @ LOADS.payload_com_m)[2]

        slope = [
            (height(angles + step * e) - height(angles - step * e)) / (2 * step) for e in np.eye(6)
        ]
        # Rounding of heights near 2 m over the step, times the weight.
        assert np.abs(extra[row] - 20 * 9.81 * np.array(slope)).max() < 1e-7


def test_wrong_geometry_is_placed_as_pinocchio_places_it(robot):
    errors, theta = truth(robot)
    wrong = errors.geometry(20 * theta)
    model = pin.Model()
    parent = 0
    base = pin.SE3(wrong.base_rotation, wrong.base_position_m)
    for j in range(6):
        placement = pin.SE3(np.eye(3), wrong.origin_m[j])
        kind = pin.JointModelRevoluteUnaligned(wrong.axis[j])
        parent = model.addJoint(parent, kind, placement, f"{j}")
    data = model.createData()
    q = configurations(20, 2)
    torque = np.random.default_rng(0).normal(0, 500, (20, 6))
    rotations, positions = wrong.tool_location(q, torque)
    for i in range(20):
        angle = q[i] + wrong.offset_rad - wrong.compliance_rad_nm * torque[i]
        pin.forwardKinematics(model, data, angle)
        tool = base * data.oMi[6] * pin.SE3(wrong.tool_rotation, wrong.tool_position_m)
        assert np.abs(positions[i] - tool.translation).max() < 1e-13
        assert np.abs(rotations[i] - tool.rotation).max() < 1e-13


def test_every_derivative_against_differences(robot):
    errors, theta = truth(robot)
    theta = 30 * theta  # where the derivatives of finite rotations matter
    q = configurations(6, 5)
    torque = np.random.default_rng(1).normal(0, 500, (6, 6))
    _, derivative = errors.jacobian(theta, q, torque)
    for k, (group, _, _) in enumerate(errors.kinds):
        step = np.zeros_like(theta)
        step[k] = 1e-9 if group == "compliance" else 1e-5
        one, _ = errors.jacobian(theta + step, q, torque)
        two, _ = errors.jacobian(theta - step, q, torque)
        moved = one.tool_position - two.tool_position
        turned = Rotation.from_matrix(
            one.tool_rotation @ np.swapaxes(two.tool_rotation, 1, 2)
        ).as_rotvec()
        found = np.concatenate([moved, turned], axis=1) / (2 * step[k])
        # Central differences: rounding 1e-16 / 1e-5 and curvature 1e-10, of columns near one;
        # a compliance acts through 500 Nm and its step is 500 times smaller than 5e-7.
        size = max(1.0, np.abs(derivative[:, :, k]).max())
        assert np.abs(found - derivative[:, :, k]).max() < 1e-8 * size, errors.names[k]


def test_sliding_joint(robot):
    text = robot.toml.replace(
        'kind = "driven"\norigin = [0, 0, 1.0]',
        'kind = "driven"\nmotion = "prismatic"\norigin = [0, 0, 1.0]',
    )
    slider = type(robot).from_toml(text)
    assert slider.axis_is_prismatic[2]
    test_nominal_tool_is_where_the_robot_says(slider)
    test_offset_columns_are_the_jacobian_of_the_robot(slider)
    test_every_derivative_against_differences(slider)


def test_everything_identifiable_comes_back_without_noise(robot):
    errors, theta, _ = noisy(robot, 0)
    payload = np.where(np.arange(120) % 2, 100.0, 0.0)
    q = configurations(120, 3)
    rotation, p = measured(robot, errors.geometry(theta), q, payload)
    data = Poses(q, p, rotation, std_m=1e-7, std_rad=1e-7, payload_kg=payload)
    # Poses: the tool's rotation is a parameter too, its truth is zero.
    found = calibrate(robot, data, nominal=nominal(robot), loads=LOADS, folds=0)
    assert found.status == "converged" and found.iterations < 8
    full = dict(zip(errors.names, theta, strict=True))
    for c in found.combinations:
        true = sum(w * full.get(name, 0.0) for name, w in c.weights.items())
        # The combination is linear and the model is not: products of errors, 1e-6 of them,
        # are left over in directions that cannot be seen at the nominal geometry.
        typical = 3e-8 if c.unit == "rad/Nm" else 1e-3
        assert abs(c.value - true) < 0.02 * typical, c.name
    # What can be seen is exact: poses elsewhere.
    q = configurations(50, 9)
    rotation, p = measured(robot, errors.geometry(theta), q, 50.0)
    torque = load_torque(robot, q, np.full(50, 50.0), LOADS)
    r2, p2 = found.geometry.tool_location(q, torque)
    # Directions known worse than a typical error are dropped: std over the least singular
    # value that counts is a typical error, so a few times 1e-7.
    assert np.abs(p2 - p).max() < 1e-6
    assert np.abs(r2 - rotation).max() < 1e-6


def test_number_of_combinations_is_that_of_theory(robot):
    errors, theta = truth(robot, groups=PARTS)
    q = configurations(80, 3)
    rotation, p = measured(robot, errors.geometry(theta), q)
    start = nominal(robot)
    pose = calibrate(
        robot, Poses(q, p, rotation), nominal=start, identify=PARTS, loads=LOADS, folds=0
    )
    # Everett and Hsu (1988): 4 R + 2 P + 6 for poses; a point loses the rotation of its frame,
    # and its last axis tells a circle from nothing but its centre and radius.
    assert pose.rank == 4 * 6 + 6
    point = calibrate(robot, Positions(q, p), nominal=start, identify=PARTS, folds=0)
    assert point.rank == 4 * 6 + 6 - 3
    assert all(c.standard_error > 0 for c in pose.combinations)


def test_intervals_hold_the_truth(robot):
    errors, theta, _ = noisy(robot, 0, groups=PARTS)
    full = dict(zip(errors.names, theta, strict=True))
    inside = total = 0
    for seed in range(12):
        _, _, data = noisy(robot, seed, groups=PARTS)
        found = calibrate(robot, data, nominal=nominal(robot), identify=PARTS, loads=LOADS, folds=0)
        assert found.residual_scale == pytest.approx(1.0, abs=0.2)  # 150 degrees of freedom
        for c in found.combinations:
            true = sum(w * full[name] for name, w in c.weights.items())
            inside += abs(c.value - true) < 1.96 * c.standard_error
            total += 1
    # 12 realizations of 27 that are correlated: 0.95 +- 3 sqrt(0.95 0.05 / 120).
    assert 0.89 < inside / total < 0.99


def test_held_out_error_is_the_noise(robot):
    errors, theta, data = noisy(robot, 0)
    q = configurations(40, 11)
    _, p = measured(robot, errors.geometry(theta), q)
    check = Positions(q, p + np.random.default_rng(5).normal(0, NOISE_M, p.shape))
    found = calibrate(robot, data, nominal=nominal(robot), loads=LOADS, validation=[check], seed=2)
    table = found.errors["rms"].sel(kind="position_m")
    floor = np.sqrt(3) * NOISE_M
    assert float(table.sel(when="nominal", of="validation")) > 1.5e-3
    # Fitting 30 numbers to 180 takes a share 30 / 180 off the fit and adds it elsewhere.
    assert float(table.sel(when="calibrated", of="fit")) < floor
    for of in ("cross_validation", "validation"):
        assert floor < float(table.sel(when="calibrated", of=of)) < 1.6 * floor


def test_compliances_come_from_payloads(robot):
    payload = np.where(np.arange(90) % 3, 150.0, 0.0)
    errors, theta, data = noisy(robot, 1, n=90, groups=("compliance", "offset"), payload=payload)
    found = calibrate(
        robot, data, nominal=nominal(robot), identify=("compliance", "offset"), loads=LOADS
    )
    true = errors.geometry(theta).compliance_rad_nm
    table = found.table.where(found.table["unit"] == "rad/Nm", drop=True)
    assert bool((table["identifiable"] == 1).sel(parameter="axis2.compliance"))
    error = found.geometry.compliance_rad_nm - true
    assert np.all(np.abs(error) < 4 * table["standard_error"].values)
    # Axis 1 stands upright and holds nothing: it stays as it was.
    assert error[0] == pytest.approx(-0.2 * nominal(robot).compliance_rad_nm[0], rel=1e-9)
    # Off by a fifth at the start; one in a thousand of the deflection of axis 2 afterwards.
    assert np.abs(error / true)[1:3].max() < 0.03
    assert found.geometry.stiffness_nm_rad[1] == pytest.approx(1 / true[1], rel=0.03)


def test_relative_measurements_find_the_arm_and_not_the_base(robot):
    errors, theta = truth(robot, groups=PARTS, rotation=False)
    true = errors.geometry(theta)
    q = configurations(240, 6)
    _, p = measured(robot, true, q)
    noise = np.random.default_rng(3).normal(0, NOISE_M, 120)
    bars = Distances(
        q.reshape(120, 2, 6), np.linalg.norm(p[::2] - p[1::2], axis=1) + noise, std_m=NOISE_M
    )
    found = calibrate(robot, bars, nominal=nominal(robot), identify=PARTS, loads=LOADS)
    assert found.status == "converged"
    named = {name for c in found.combinations for name in c.weights}
    assert not any(name.startswith("base") for name in named)
    assert found.rank == 27 - 6
    table = found.errors["rms"].sel(kind="distance_m")
    assert float(table.sel(when="nominal", of="fit")) > 1e-3
    assert float(table.sel(when="calibrated", of="cross_validation")) < 1.6 * NOISE_M
    full = dict(zip(errors.names, theta, strict=True))
    for c in found.combinations:
        value = sum(w * full[name] for name, w in c.weights.items())
        assert abs(c.value - value) < 5 * c.standard_error, c.name


def same_point(robot, geometry, seed):
    """Angles that bring the target of ``geometry`` to a few points, from several sides."""
    rng = np.random.default_rng(seed)
    q, point = [], []
    for k, start in enumerate(configurations(12, seed)):
        goal = measured(robot, geometry, start[None])[1][0]
        for _ in range(8):
            angle = start + rng.normal(0, 0.4, 6)
            for _ in range(60):
                off = goal - measured(robot, geometry, angle[None])[1][0]
                step = 1e-6
                slope = np.array(
                    [
                        measured(robot, geometry, angle[None] + step * e)[1][0]
                        - measured(robot, geometry, angle[None] - step * e)[1][0]
                        for e in np.eye(6)
                    ]
                ).T / (2 * step)
                angle = angle + np.clip(np.linalg.pinv(slope, rcond=1e-3) @ off, -0.2, 0.2)
                if np.abs(off).max() < 1e-12:
                    q.append(angle)
                    point.append(k)
                    break
    return np.array(q), np.array(point)


def test_same_point_from_several_sides(robot):
    errors, theta = truth(robot, groups=("offset", "tool"), rotation=False)
    q, point = same_point(robot, errors.geometry(theta), 8)
    assert len(q) > 60
    data = SamePoint(q, point, std_m=1e-6)
    found = calibrate(robot, data, nominal=nominal(robot), identify=("offset", "tool"), loads=LOADS)
    assert found.status == "converged"
    # Without the true points the first axis may start anywhere.
    assert not bool(found.table["identifiable"].sel(parameter="axis1.offset"))
    names = found.table["parameter"].values
    known = found.table["identifiable"].values
    full = dict(zip(errors.names, theta, strict=True))
    assert {"axis2.offset", "axis3.offset", "axis5.offset"} <= set(names[known])
    for name, value in zip(names[known], found.table["deviation"].values[known], strict=True):
        assert value == pytest.approx(full[name], abs=1e-8), name
    table = found.errors["rms"].sel(kind="same_point_m", of="cross_validation")
    assert float(table.sel(when="calibrated")) < 1e-8 < 1e-4 < float(table.sel(when="nominal"))


def test_an_iteration_that_is_cut_short_says_so(robot):
    _, _, data = noisy(robot, 0, groups=PARTS)
    found = calibrate(robot, data, nominal=nominal(robot), loads=LOADS, max_iterations=1, folds=0)
    assert found.status == "max_iterations"
    assert "more iterations" in found.advice


def test_a_search_that_finds_no_way_down_says_so(robot, monkeypatch):
    """With derivatives of the wrong sign every step goes uphill."""
    errors, theta, data = noisy(robot, 0, groups=PARTS)
    checked = check(data, robot, LOADS, "data")
    problem = identify._Problem(errors, [checked], identify._scales(errors, [checked]), 200)
    assert problem._search(0.1 * theta, 200).status == "converged"
    true = problem.residual
    monkeypatch.setattr(problem, "residual", lambda at: (true(at)[0], -true(at)[1]))
    found = problem._search(0.1 * theta, 200)
    assert found.status == "stalled" and 0 < found.iterations < 200
    np.testing.assert_array_equal(found.theta, problem._search(0.1 * theta, 1).theta)


def test_a_model_is_evaluated_once_at_a_place():
    calls = []
    square = last_value(lambda x: calls.append(x.copy()) or x @ x)
    one, two = np.array([1.0, 2.0]), np.array([3.0, 0.0])
    assert [square(x) for x in (one, one.copy(), two, two, one)] == [5.0, 5.0, 9.0, 9.0, 5.0]
    assert [c.tolist() for c in calls] == [[1, 2], [3, 0], [1, 2]]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"joint_angle_rad": np.zeros((9, 5))}, r"joint_angle_rad: expected shape \(n, 6\)"),
        ({"joint_angle_rad": np.full((9, 6), np.nan)}, "joint_angle_rad: expected finite"),
        ({"joint_angle_rad": np.zeros((0, 6))}, "joint_angle_rad: expected shape"),
        ({"position_m": np.zeros((9, 2))}, r"position_m: expected shape \(9, 3\)"),
        ({"position_m": np.full((9, 3), np.inf)}, "position_m: expected finite"),
        ({"position_m": np.full((9, 3), 1j)}, "position_m: expected real"),
        ({"std_m": 0.0}, "std_m: expected a positive"),
        ({"std_m": np.nan}, "std_m: expected a positive"),
        ({"payload_kg": -1.0}, "payload_kg: expected"),
        ({"payload_kg": np.ones(4)}, "payload_kg: expected"),
    ],
)
def test_measurements_that_cannot_be_used(robot, change, message):
    given = {"joint_angle_rad": configurations(9, 0), "position_m": np.zeros((9, 3))} | change
    with pytest.raises(InputError, match=rf"measurements\[0\]\.{message}"):
        calibrate(robot, Positions(**given))


def test_other_measurements_that_cannot_be_used(robot):
    q, p = configurations(9, 0), np.zeros((9, 3))
    mirror = np.broadcast_to(np.diag([1.0, 1.0, -1.0]), (9, 3, 3))
    for data, message in (
        (Poses(q, p, mirror), "rotation: expected rotation matrices"),
        (Poses(q, p, np.eye(3)), "rotation: expected shape"),
        (Poses(q, p, mirror * 0 + np.eye(3), std_rad=-1), "std_rad: expected a positive"),
        (Distances(q, np.ones(9)), r"joint_angle_rad: expected shape \(n, 2, 6\)"),
        (Distances(q[:8].reshape(4, 2, 6), -np.ones(4)), "distance_m: expected positive"),
        (SamePoint(q, np.arange(9)), "point: expected every point at least twice"),
        (SamePoint(q, np.full(9, 0.5)), "point: expected whole numbers"),
        (q, "expected Positions"),
    ):
        with pytest.raises(InputError, match=message):
            calibrate(robot, [data])


def test_requests_that_make_no_sense(robot):
    q = configurations(9, 0)
    data = Positions(q, np.zeros((9, 3)))
    other = dataclasses.replace(nominal(robot), joint_names=("a",) * 6)
    for given, options, message in (
        ([], {}, "measurements: expected at least one"),
        (data, {"identify": ("offset", "length")}, "identify: expected some of .* got length"),
        (data, {"identify": ()}, "identify: expected some of .* got none"),
        (data, {"max_iterations": 0}, "max_iterations: expected a whole number"),
        (data, {"folds": 1}, "folds: expected 0 or at least 2"),
        (data, {"folds": 2.5}, "folds: expected a whole number"),
        (data, {"nominal": other}, "nominal: expected joints axis1"),
        (
            Positions(q[:4], np.zeros((4, 3))),
            {},
            "measurements: expected more than the 12 combinations",
        ),
        (Positions(q, np.zeros((9, 3)), std_m=1e3), {}, "expected some that see an error"),
        (data, {"validation": [Positions(q, q)]}, r"validation\[0\]\.position_m: expected"),
    ):
        with pytest.raises(InputError, match=message):
            calibrate(robot, given, **options)
    for given, message in (
        ((q[:, :5],), r"joint_angle_rad: expected shape \(n, 6\)"),
        ((q, np.ones(4)), "payload_kg: expected one number"),
        ((q, np.nan), "payload_kg: expected finite"),
        ((q, 1.0, dataclasses.replace(LOADS, payload_com_m=(1.0, 2.0))), "payload_com_m: expected"),
    ):
        with pytest.raises(InputError, match=message):
            load_torque(robot, *given)
    with pytest.raises(InputError, match="base_rotation: expected rotation"):
        nominal_geometry(robot, base_rotation=2 * np.eye(3))
    with pytest.raises(InputError, match="tool_position_m: expected shape"):
        nominal_geometry(robot, tool_position_m=(1, 2))
    with pytest.raises(InputError, match=r"torque_nm: expected 9 rows, got 3"):
        nominal(robot).tool_location(q, np.zeros((3, 6)))
