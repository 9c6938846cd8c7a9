"""Results written into robot files: the robot is that of the result, covariance carried along."""

import dataclasses
import pickle
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from axis_data import RATIO, SAMPLE_S, TRUTH, record
from axisight import (
    Effect,
    InputError,
    Parameter,
    Robot,
    _core,
    load_robot,
    robot_parameters,
    simulate,
)
from axisight.calibration import Positions, calibrate, identified_geometry, load_torque
from axisight.calibration.geometry import errors_about, nominal_geometry
from axisight.frequency_fit import FrequencyFitOptions, fit_responses, identified_responses
from axisight.graybox import AxisModel, FitSettings, fit_axis, identified_axis
from axisight.robot_file import Provenance, identified, load_identified, write_identified
from axisight.robot_file.effect_tables import stated
from calibration_data import LOADS, arm, configurations, nominal
from frequency_fit_data import ROBOT, responses

SOURCE = Provenance("test", notes="mine", settings={"a": 1})


def differences(function, at, steps):
    """Central differences (n_out, n_in)."""
    columns = []
    for k, step in enumerate(steps):
        up, down = np.array(at, float), np.array(at, float)
        up[k] += step
        down[k] -= step
        columns.append((function(up) - function(down)) / (2 * step))
    return np.array(columns).T


# Frequency responses.


@pytest.fixture(scope="module")
def frequency_fit():
    start = {"axis1.stiffness": 1.3e6, "axis2.motor_inertia": 0.014, "axis3_yaw.com_x": 0.8}
    start |= {"axis3_yaw.inertia_scale": 1.05, "axis3.damping": 500.0}
    names = [*(Parameter(n, v, -1e9, 1e9, 1.0) for n, v in start.items())]
    names.append(Parameter("axis2.stiffness", 3.9e6, 1.0, 1e9, 1.0, frozen=True))
    return fit_responses(ROBOT, responses(0.05, 1), names)


def test_a_frequency_fit_written_is_its_robot(frequency_fit, tmp_path: Path) -> None:
    found = identified_responses(frequency_fit, SOURCE)
    write_identified("irb6600_like", tmp_path / "r.toml", found)
    back = load_identified(tmp_path / "r.toml")
    wanted = robot_parameters(frequency_fit.robot)
    assert robot_parameters(back.robot) == wanted
    # The factor on an inertia is in the inertia then.
    links = _core.inertial_parameters(back.robot.core)[1]
    exact = _core.inertial_parameters(frequency_fit.robot.core)[1]
    np.testing.assert_allclose(links, exact, rtol=1e-12, atol=1e-12)
    assert np.abs(exact - _core.inertial_parameters(ROBOT.core)[1]).max() > 1
    n = len(frequency_fit.names)
    np.testing.assert_allclose(back.covariance[:n, :n], frequency_fit.covariance, rtol=1e-12)
    np.testing.assert_allclose(back.standard_errors[:n], frequency_fit.std, rtol=1e-9)
    # What was frozen away from the file is written too, or the robot were another.
    assert back.names[n:] == ("axis2.stiffness",) and back.standard_errors[n] == 0
    assert back.provenance.notes.startswith("mine\nheld in the fit: axis2.stiffness")
    assert "search: " in back.provenance.notes and back.provenance.settings == {"a": 1}


def test_frequency_fits_that_cannot_be_written_are_refused(frequency_fit) -> None:
    changed = ROBOT.with_parameters({"axis2_yaw.inertia_scale": 1.2})
    fit = fit_responses(changed, responses(0.05, 1), {"axis1.stiffness": 1.7e6})
    with pytest.raises(InputError, match="fit: expected a robot with the inertias of its file"):
        identified_responses(fit, SOURCE)
    with pytest.raises(InputError, match="fit: expected a FrequencyFit, got dict"):
        identified_responses({}, SOURCE)
    with pytest.raises(InputError, match="provenance: expected a Provenance, got str"):
        identified_responses(frequency_fit, "me")


def test_what_data_do_not_tell_has_no_standard_error(frequency_fit) -> None:
    blind = frequency_fit.covariance.copy()
    blind[0], blind[:, 0] = np.inf, np.inf
    found = identified_responses(dataclasses.replace(frequency_fit, covariance=blind), SOURCE)
    assert found.covariance is None and np.isnan(found.standard_errors[0])
    np.testing.assert_allclose(found.standard_errors[1:5], frequency_fit.std[1:], rtol=1e-9)


def test_effects_of_a_frequency_fit_go_along(tmp_path: Path) -> None:
    payload = Effect("payload", None, {"mass_kg": 20.0})
    options = FrequencyFitOptions(max_iterations=1)
    fit = fit_responses(
        ROBOT, responses(0.05, 2), {"axis1.stiffness": 1.0e6}, effects=[payload], options=options
    )
    found = identified_responses(fit, SOURCE, effects=[payload])
    write_identified("irb6600_like", tmp_path / "r.toml", found)
    back = load_identified(tmp_path / "r.toml")
    assert back.effects == (payload,)
    # A search that did not end by itself is told.
    assert "max_iterations" in back.provenance.notes and "iteration limit" in back.provenance.notes


# One axis.


def axis_fit(model: AxisModel, truth: dict[str, float], **options):
    """A fit that starts at the truth and stays near it."""
    data = record(model, truth, n=3000, noise=1e-4 * np.random.default_rng(0).normal(size=3000))
    # Short blocks: records of 1.5 s have enough of them for a sandwich.
    settings = FitSettings(block_s=0.03)
    return fit_axis(model, [data], truth, settings=settings, **options)


RICH = {"b": 2e-4, "F_s": 0.3, "v_s": 3.0, "u_0": 0.2, "a_1": 0.1, "b_1": -0.2, "a_4": 0.05}
RICH |= {"b_4": 0.07}
RICH_MODEL = AxisModel(
    gear_ratio=RATIO,
    friction_smoothing_rad_s=0.1,
    stribeck=True,
    torque_offset=True,
    backlash=True,
    ripple_orders=(1.0, 4.0),
    substeps=4,
)


def motor_side(truth: dict[str, float]) -> dict[str, float]:
    """The same axis as a model with gear ratio one: angles, springs, inertias of the motor."""
    powers = {"J_a": 2, "k1": 2, "d": 2, "k3": 4, "b": -1}
    return {n: v * RATIO ** powers.get(n, 0) for n, v in truth.items()}


def test_an_axis_fit_written_moves_as_the_fit(tmp_path: Path) -> None:
    """The oracle is the whole robot's simulator: signs, sides and effects of every parameter."""
    truth = TRUTH | RICH
    model = dataclasses.replace(RICH_MODEL, gear_ratio=1.0)
    own = motor_side(truth)
    data = record(model, own, n=200)
    fit = fit_axis(model, [data], own, fixed=[n for n in own if n != "J_m"])
    fit = dataclasses.replace(fit, parameters=fit.parameters | own)
    robot = load_robot("two_mass_axis")
    write_identified(robot, tmp_path / "r.toml", identified_axis(fit, robot, SOURCE))
    back = load_identified(tmp_path / "r.toml").robot
    torque = np.asarray(record(model, own, n=2000).torque_nm)
    want = model.simulate(own, torque, SAMPLE_S)["states"].sel(state="angle_m").values
    got = simulate(back, torque_nm=torque[:, None], tolerance=1e-9)["position_rad"].values[:, 0]
    # Runge-Kutta of order 4 in the model, four steps a sample.
    assert np.abs(got - want).max() < 1e-5 * np.ptp(want)
    before = simulate(robot, torque_nm=torque[:, None])["position_rad"].values[:, 0]
    assert np.abs(before - want).max() > 1e-3 * np.ptp(want)


def test_values_of_an_axis_fit_stand_where_they_belong(tmp_path: Path) -> None:
    model = AxisModel(gear_ratio=RATIO)
    fit = axis_fit(model, TRUTH)
    robot = load_robot("two_mass_axis")
    found = identified_axis(fit, robot, SOURCE, covariance="sandwich")
    write_identified(robot, tmp_path / "r.toml", found)
    back = load_identified(tmp_path / "r.toml")
    values = robot_parameters(back.robot)
    for name, quantity in (
        ("J_m", "motor_inertia"),
        ("k1", "stiffness"),
        ("d", "damping"),
        ("F_v", "viscous_friction"),
    ):
        assert values[f"axis1.{quantity}"] == fit.parameters[name] != TRUTH[name]
    assert [e.label for e in back.effects] == ["nonlinear_stiffness@1", "coulomb_friction@1"]
    assert back.effects[0].parameters == {"cubic_nm_rad3": fit.parameters["k3"]}
    assert back.effects[1].parameters == {
        "coulomb_nm": fit.parameters["F_c"],
        "smoothing_rad_s": 0.01,
        "arm_share": 0.0,
        "lead_s": 0.0,
    }
    order = [fit.free.index(n) for n in ("J_m", "k1", "k3", "d", "F_v", "F_c")]
    np.testing.assert_allclose(back.covariance, fit.sandwich[np.ix_(order, order)], rtol=1e-9)
    arm = back.provenance.settings["no_place"]["J_a"]
    at = fit.free.index("J_a")
    assert arm["value"] == fit.parameters["J_a"] and arm["unit"] == "kg m^2"
    assert np.isclose(arm["standard_error"], np.sqrt(fit.sandwich[at, at]))
    notes = back.provenance.notes
    assert "not written: J_a" in notes and "has 1130 there" in notes
    assert "smoothed over 0.01 rad/s" in notes and "converted" not in notes
    white = identified_axis(fit, robot, SOURCE, covariance="white", smoothing_rad_s=0.2)
    np.testing.assert_allclose(white.covariance, fit.covariance[np.ix_(order, order)], rtol=1e-9)
    assert white.effects[1].parameters["smoothing_rad_s"] == 0.2


def test_covariance_goes_through_the_gear_ratio() -> None:
    """Against finite differences of the written values, ratio fitted."""
    model = AxisModel(gear_ratio=1 / 200.0, backlash=True)
    fit = axis_fit(
        model, TRUTH | {"b": 2e-4, "F_v": 0.02}, fixed=["J_a", "F_v"], free_gear_ratio=True
    )
    assert "r" in fit.free
    robot = load_robot("two_mass_axis")
    found = identified_axis(fit, robot, SOURCE, covariance="white")

    def written(free):
        values = fit.parameters | dict(zip(fit.free, free.tolist(), strict=True))
        one = dataclasses.replace(fit, parameters=values, values=free)
        return identified_axis(one, robot, SOURCE).values

    slopes = differences(written, fit.values, 1e-5 * np.abs(fit.values))
    want = slopes @ fit.covariance @ slopes.T
    size = np.sqrt(np.outer(np.diag(want), np.diag(want)))
    # F_v is held and has no error; the rest is third order in a step of 1e-5.
    held = found.names.index("axis1.viscous_friction")
    assert found.standard_errors[held] == 0
    known = np.arange(len(found.names)) != held
    both = np.ix_(known, known)
    np.testing.assert_allclose(
        found.covariance[both] / size[both], want[both] / size[both], atol=1e-7
    )
    assert "held in the fit: F_v" in found.provenance.notes
    assert "converted from the gear ratio" in found.provenance.notes
    left = found.provenance.settings["no_place"]
    assert left["r"]["value"] == fit.parameters["r"] and left["J_a"]["standard_error"] > 0


def test_a_longer_chain_and_what_has_no_place() -> None:
    model = AxisModel(
        gear_ratio=RATIO, n_masses=3, viscous_asymmetry=True, ripple_orders=(1, 2, 3, 5)
    )
    truth = TRUTH | {"J_a": 700.0, "J_a2": 430.0, "k1_2": 3e6, "d_2": 900.0, "F_a": 0.002}
    fit = axis_fit(model, truth, fixed=["a_5"])
    found = identified_axis(fit, load_robot("two_mass_axis"), SOURCE)
    assert list(found.provenance.settings["no_place"]) == [
        "J_a", "J_a2", "k1_2", "d_2", "F_a", "b_5",
    ]  # fmt: skip
    assert "not written, no place in a robot file: k1_2, d_2, F_a, b_5" in found.provenance.notes
    (ripple,) = (e for e in found.effects if e.name == "torque_ripple")
    assert ripple.parameters["order_3"] == 3 and "torque_ripple@1.sine_3_nm" in found.names


def test_effects_in_the_way_are_removed(tmp_path: Path) -> None:
    model = AxisModel(gear_ratio=RATIO, cubic=(False,))
    truth = {n: v for n, v in TRUTH.items() if n != "k3"}
    preset = load_robot("two_mass_axis")
    others = [
        Effect("presliding_friction", 1, {"coulomb_nm": 0.5}),
        Effect("quadratic_drag", 1, {"drag_nm_s2_rad2": 1e-3}),
        Effect("load_dependent_friction", 1, {"coefficient": 0.05}),
        Effect("backlash", 1, {"half_width_rad": 1e-4}),
    ]
    ripple = Effect("resolver_ripple", 1, {"cosine_1_rad": 1e-3})
    robot = preset.with_effects([*preset.effects, *others, ripple])
    found = identified_axis(axis_fit(model, truth), robot, SOURCE)
    write_identified(robot, tmp_path / "r.toml", found)
    friction, kept = load_robot(tmp_path / "r.toml").effects
    assert friction.label == "coulomb_friction@1" and friction.parameters["coulomb_nm"] != 0.644
    assert kept == ripple
    labels = ", ".join(["nonlinear_stiffness@1", *(effect.label for effect in others)])
    note = f"removed, what was identified stands in their place: {labels}"
    assert note in found.provenance.notes.splitlines()


def test_axis_fits_of_other_things_are_refused() -> None:
    fit = axis_fit(AxisModel(gear_ratio=RATIO), TRUTH)
    robot = load_robot("two_mass_axis")
    text = stated(robot.toml, []).replace("stiffness = 1.46e6\ndamping = 2.63e3\n", "")
    rigid = Robot(_core.Robot.from_toml(text))
    for call, words in (
        (lambda: identified_axis(fit.parameters, robot, SOURCE), "fit: expected an AxisFit"),
        (
            lambda: identified_axis(fit, robot, SOURCE, axis=2),
            r"axis: expected 1 or a joint name .*, got 2",
        ),
        (
            lambda: identified_axis(fit, robot, SOURCE, axis=True),
            r"axis: expected 1 or a joint name .*, got True",
        ),
        (lambda: identified_axis(fit, rigid, SOURCE), "axis: expected one with a gear spring"),
        (lambda: identified_axis(fit, robot, SOURCE, covariance="best"), "covariance: expected"),
        (
            lambda: identified_axis(fit, robot, SOURCE, smoothing_rad_s=0.0),
            "smoothing_rad_s: expected a positive number, got 0.0",
        ),
        (
            lambda: identified_axis(fit, robot, SOURCE, smoothing_rad_s=np.nan),
            "smoothing_rad_s: expected a positive number, got nan",
        ),
    ):
        with pytest.raises(InputError, match=words):
            call()
    lost = dataclasses.replace(fit, sandwich=np.full_like(fit.sandwich, np.nan))
    found = identified_axis(lost, robot, SOURCE, covariance="sandwich")
    assert np.isnan(found.standard_errors).all()
    assert "too few: unknown; the fit trusts the other kind (white)" in found.provenance.notes


@pytest.mark.parametrize(("block_s", "kind"), [(0.25, "white"), (0.03, "sandwich")])
def test_written_standard_errors_are_those_of_the_summary(tmp_path, block_s, kind) -> None:
    # Six blocks of a quarter of a second are too few for a sandwich of seven parameters.
    data = record(n=3000, noise=1e-4 * np.random.default_rng(0).normal(size=3000))
    settings = FitSettings(gradual=(), block_s=block_s)
    fit = fit_axis(AxisModel(gear_ratio=RATIO), data, TRUTH, settings=settings)
    assert fit.trusted == "white"
    fit = dataclasses.replace(fit, trusted=kind)
    robot = load_robot("two_mass_axis")
    write_identified(robot, tmp_path / "r.toml", identified_axis(fit, robot, SOURCE))
    back = load_identified(tmp_path / "r.toml")
    order = [fit.free.index(n) for n in ("J_m", "k1", "k3", "d", "F_v", "F_c")]
    np.testing.assert_allclose(back.standard_errors, fit.standard_error[order], rtol=1e-9)
    assert np.isfinite(back.standard_errors).all()
    words = {"white": "of white prediction errors", "sandwich": f"sandwich of {fit.blocks} blocks"}
    assert f"standard errors: {words[kind]}" in back.provenance.notes
    assert "the other kind" not in back.provenance.notes


def test_gear_ratios_that_differ_little_are_converted() -> None:
    fit = axis_fit(AxisModel(gear_ratio=RATIO), TRUTH)
    # Two parts in a million, 9e-9 in the ratio itself.
    other = dataclasses.replace(fit, parameters=fit.parameters | {"r": RATIO * (1 + 2e-6)})
    robot = load_robot("two_mass_axis")
    one, two = (identified_axis(f, robot, SOURCE) for f in (fit, other))
    change = two.value("axis1.stiffness") / one.value("axis1.stiffness") - 1
    # A square to first order; rounding of 1e-16 in a change of 4e-6.
    assert change == pytest.approx(4e-6, rel=1e-5)
    assert "converted from the gear ratio" in two.provenance.notes
    assert "converted" not in one.provenance.notes


# Calibration.


def calibration(groups, n=80, seed=1):
    robot = arm()
    start = nominal(robot)
    errors = errors_about(start, groups, rotation=False)
    theta = np.random.default_rng(seed).normal(0, 1e-3, len(errors.names))
    for k, (group, joint, _) in enumerate(errors.kinds):
        if group == "compliance":
            theta[k] = 0.2 * start.compliance_rad_nm[joint]
    q = configurations(n, seed)
    truth = errors.geometry(theta)
    load = load_torque(robot, q, np.zeros(n), LOADS)
    position = truth.tool_location(q, load)[1]
    position += np.random.default_rng(seed).normal(0, 1e-5, position.shape)
    data = Positions(q, position, std_m=1e-5)
    return robot, calibrate(robot, data, nominal=start, identify=groups, folds=0)


def test_a_calibrated_geometry_is_that_of_the_file(tmp_path: Path) -> None:
    groups = ("compliance", "offset", "tilt", "origin", "tool", "base")
    robot, found = calibration(groups)
    done = identified_geometry(found, SOURCE)
    write_identified(robot, tmp_path / "r.toml", done)
    back = load_identified(tmp_path / "r.toml")
    left = back.provenance.settings["no_place"]

    def three(name: str) -> list[float]:
        return [left[f"{name}{x}"]["value"] for x in "xyz"]

    again = nominal_geometry(
        back.robot,
        tool_position_m=three("tool."),
        # Positions alone do not show how the tool is turned.
        tool_rotation=found.geometry.tool_rotation,
        base_position_m=three("base."),
        base_rotation=Rotation.from_rotvec(three("base.rotation_")).as_matrix(),
    )
    assert "tool.rotation_x" not in left
    want = found.geometry
    np.testing.assert_array_equal(again.origin_m, want.origin_m)
    np.testing.assert_allclose(again.axis, want.axis, rtol=0, atol=1e-15)
    np.testing.assert_allclose(again.compliance_rad_nm, want.compliance_rad_nm, rtol=1e-9)
    assert np.abs(want.axis - found.nominal.axis).max() > 1e-4
    # With the offsets added by hand it is the calibrated machine.
    offset = np.array([left[f"{name}.offset"]["value"] for name in want.joint_names])
    q = configurations(5, 9)
    got = again.tool_location(q + offset)[1]
    np.testing.assert_allclose(got, want.tool_location(q)[1], rtol=0, atol=1e-12)
    assert np.abs(again.tool_location(q)[1] - got).max() > 1e-4
    errors = dict(zip(back.names, back.standard_errors, strict=True))
    table = found.table
    for name in ("axis2.origin_x", "axis4.origin_z"):
        se = float(table["standard_error"].sel(parameter=name))
        assert np.isnan(errors[name]) if np.isinf(se) else np.isclose(errors[name], se)
    for name in ("axis2.offset", "tool.y", "base.x"):
        se = float(table["standard_error"].sel(parameter=name))
        assert list(left[name]) == ["value", "standard_error", "unit", "meaning"]
        assert left[name]["standard_error"] == (None if np.isinf(se) else pytest.approx(se))
    assert (left["axis2.offset"]["unit"], left["tool.y"]["unit"]) == ("rad", "m")
    assert "not written, no place in a robot file: axis1.offset, axis2.offset" in (
        back.provenance.notes
    )
    # The vertical axis holds nothing.
    assert "axis1.stiffness" not in errors and "axis2.stiffness" in errors


def test_covariance_of_a_geometry_against_finite_differences() -> None:
    _, found = calibration(("compliance", "tilt"), n=200)
    seen = found.table["identifiable"].values
    done = identified_geometry(found, SOURCE)
    theta = found.table["deviation"].values
    errors = errors_about(found.nominal, ("compliance", "tilt"), rotation=False)

    def written(at):
        return identified_geometry(
            dataclasses.replace(
                found,
                geometry=errors.geometry(at),
                table=found.table.assign(deviation=("parameter", at)),
            ),
            SOURCE,
        )

    steps = np.where([n.endswith("compliance") for n in errors.names], 1e-9, 1e-4)
    steps[~seen] = 0.0
    used = np.flatnonzero(steps)
    slopes = np.zeros((len(done.names), len(theta)))
    for k in used:
        up, down = theta.copy(), theta.copy()
        up[k] += steps[k]
        down[k] -= steps[k]
        slopes[:, k] = (written(up).values - written(down).values) / (2 * steps[k])
    want = slopes[:, used] @ found.covariance[np.ix_(used, used)] @ slopes[:, used].T
    std = np.sqrt(np.diag(want))
    compared = np.isfinite(done.standard_errors)
    assert compared.sum() > 10
    # Second order of a step of 1e-9 in compliances of 1e-6.
    np.testing.assert_allclose(done.standard_errors[compared], std[compared], rtol=1e-5)
    joint = [i for i, n in enumerate(done.names) if n.startswith("axis3.axis")]
    assert np.isfinite(done.standard_errors[joint]).all()


def test_covariance_of_a_calibration_is_that_of_its_standard_errors() -> None:
    _, found = calibration(("offset", "tool"))
    se = found.table["standard_error"].values
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)), se, rtol=1e-12)
    known = np.isfinite(se)
    assert known.sum() > 4 and np.isnan(found.covariance[~known][:, known]).all()
    # A combination in a single parameter has the same error; of two, with the covariance.
    part = np.flatnonzero(known)
    matrix = found.covariance[np.ix_(part, part)]
    assert np.linalg.eigvalsh(matrix).min() > 0
    assert np.abs(matrix - np.diag(np.diag(matrix))).max() > 0.1 * np.diag(matrix).min()


def test_geometries_that_no_file_holds_are_refused(tmp_path: Path) -> None:
    robot, found = calibration(("compliance",))
    worse = found.geometry.compliance_rad_nm.copy()
    worse[2] = -1e-7
    soft = dataclasses.replace(
        found, geometry=dataclasses.replace(found.geometry, compliance_rad_nm=worse)
    )
    with pytest.raises(InputError, match="positive compliance of axis3, got -1e-07"):
        identified_geometry(soft, SOURCE)
    with pytest.raises(InputError, match="calibration: expected a Calibration, got Geometry"):
        identified_geometry(found.geometry, SOURCE)
    with pytest.raises(InputError, match="unit vector"):
        write_identified(robot, tmp_path / "r.toml", identified({"axis2.axis_x": 0.3}, SOURCE))
    assert not list(tmp_path.iterdir())


def test_a_compliance_without_a_spring_is_kept_beside_the_file() -> None:
    _, found = calibration(("compliance",))
    rigid = dataclasses.replace(
        found.nominal,
        compliance_rad_nm=np.where(np.arange(6) == 2, 0.0, found.nominal.compliance_rad_nm),
    )
    done = identified_geometry(dataclasses.replace(found, nominal=rigid), SOURCE)
    assert "axis3.stiffness" not in done.names
    left = done.provenance.settings["no_place"]
    assert list(left) == ["axis3.compliance"]
    se = float(found.table["standard_error"].sel(parameter="axis3.compliance"))
    assert left["axis3.compliance"] == {
        "value": found.geometry.compliance_rad_nm[2],
        "standard_error": pytest.approx(se),
        "unit": "rad/Nm",
        "meaning": "compliance of a rigid joint",
    }


def test_standard_errors_of_a_rotation_vector_against_finite_differences() -> None:
    """A base that is turned by a radian: its vector does not move as the deviation does."""
    _, found = calibration(("base",))
    turned = Rotation.from_rotvec([0.3, -0.8, 0.5]).as_matrix()
    start = dataclasses.replace(found.nominal, base_rotation=turned)
    errors = errors_about(start, ("base",), rotation=False)
    theta = np.array([0.0, 0.0, 0.0, 0.02, -0.05, 0.04])
    root = np.random.default_rng(3).normal(size=(6, 6))
    done = identified_geometry(
        dataclasses.replace(
            found,
            nominal=start,
            geometry=errors.geometry(theta),
            table=found.table.assign(deviation=("parameter", theta)),
            covariance=root @ root.T,
        ),
        SOURCE,
    )

    def vector(at):
        return Rotation.from_matrix(errors.geometry(at).base_rotation).as_rotvec()

    h = 1e-6
    slope = np.array([(vector(theta + h * e) - vector(theta - h * e)) / (2 * h) for e in np.eye(6)])
    want = np.sqrt(np.diag(slope.T @ root @ root.T @ slope))
    left = done.provenance.settings["no_place"]
    got = [left[f"base.rotation_{x}"] for x in "xyz"]
    np.testing.assert_allclose([g["value"] for g in got], vector(theta), rtol=1e-12)
    # Differences of h: errors of h^2 and of rounding over h.
    np.testing.assert_allclose([g["standard_error"] for g in got], want, rtol=1e-8)


@pytest.mark.parametrize("preset", ["two_mass_axis", "irb6600_like"])
def test_a_controller_for_a_slower_loop_has_its_stiffness_by_the_square(preset: str):
    robot = load_robot(preset)
    slow = robot.with_controller_speed(0.5)
    # Twice as slow once more is from what the description states, not from what it is now.
    for other in (slow, slow.with_controller_speed(0.5), pickle.loads(pickle.dumps(slow))):
        for name, power in (("kp", 1), ("ki", 2), ("kv", 1)):
            if name in robot.controller_gains:
                stated = robot.controller_gains[name]
                np.testing.assert_array_equal(other.controller_gains[name], 0.5**power * stated)
    assert slow.parameters() == robot.parameters()
    assert slow.with_controller_speed(1.0).controller_gains["kp"] == pytest.approx(
        robot.controller_gains["kp"], rel=0
    )
    with pytest.raises(InputError, match="factor: expected a positive number, got 0"):
        robot.with_controller_speed(0.0)
