"""Misuse of the frequency-domain fit is refused by name; trouble is a status with advice."""

from typing import Any

import numpy as np
import pytest
import xarray as xr

from axisight import Effect, InputError, Parameter, frf, load_robot
from axisight.frequency_fit import (
    FrequencyFitOptions,
    MeasuredResponse,
    fit_responses,
    model_response,
    planned_information,
)
from axisight.identifiability import identifiability
from frequency_fit_data import LINES_HZ, POSES, ROBOT, TRUTH, response, responses, starts

NAMES = ("axis1.stiffness", "axis2.stiffness")
CLEAN = response(POSES[0], 0.0, np.random.default_rng(0))


def array(**changes: Any) -> xr.DataArray:
    found = model_response(ROBOT, LINES_HZ, POSES[0])
    return found.assign_attrs(changes)


def made(**changes: Any) -> MeasuredResponse:
    fields: dict[str, Any] = {
        "joint_angle_rad": POSES[0],
        "frequency_hz": LINES_HZ,
        "response": CLEAN.response,
        "quantity": "acceleration",
        "variance": CLEAN.variance,
    }
    return MeasuredResponse(**(fields | changes))


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        (["axis9.stiffness"], "axis9.stiffness.*expected one of.*axis1.stiffness"),
        ([], "parameters: expected at least one"),
        ("axis1.stiffness", "expected a list"),
        (["axis1.stiffness"] * 2, "each name once"),
        ({"axis1.stiffness": -1.0}, "axis1.stiffness: expected a start above zero"),
        ({"axis1.stiffness": float("nan")}, "axis1.stiffness: expected a finite start"),
        ({"axis1.stiffness": "stiff"}, "axis1.stiffness: expected a finite start"),
        ([Parameter("axis1.stiffness", 1e6, 2e6, 3e6, 1e5)], "start between the bounds 2000000"),
        ([Parameter("axis1.stiffness", 1e6, 0, 3e6, 1e5, frozen=True)], "not frozen"),
        ([Parameter("coulomb_nm", 1.0, 0, 2, 1, effect=0)], "expected a robot parameter"),
        ([Parameter("axis1.stiffness", 1e6, 0, 3e6, 1, prior=(1e6, 0.0))], "positive deviation"),
    ],
)
def test_parameters_that_make_no_fit(parameters: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        fit_responses(ROBOT, [CLEAN], parameters)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"quantity": "torque"}, "quantity: expected one of position"),
        ({"joint_angle_rad": (0.0, np.nan, 0.0)}, "joint_angle_rad: expected finite"),
        ({"joint_angle_rad": (0.0, 0.0)}, r"response: expected shape \(40, 2, 2\)"),
        ({"frequency_hz": LINES_HZ[1:]}, "response: expected shape"),
        ({"response": CLEAN.response * np.nan}, "response: expected finite"),
        ({"response": "abc"}, "response: expected complex"),
        ({"variance": -CLEAN.variance}, "variance: expected positive"),
        ({"variance": CLEAN.variance * np.nan}, "variance.*NaN in 360 elements; average"),
        ({"variance": np.ones(3)}, "variance: expected shape"),
        ({"covariance": np.ones((40, 9, 9))}, "variance or a covariance, got both"),
        ({"variance": None, "covariance": np.ones((40, 2, 2))}, "covariance: expected shape"),
        ({"variance": None, "covariance": np.ones((40, 9, 9)) * 1j}, "Hermitian"),
    ],
)
def test_responses_that_are_none(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        made(**changes)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ([], "responses: expected at least one"),
        (CLEAN, "responses: expected a list"),
        ([3], "expected MeasuredResponse or pairs"),
        ([(POSES[0], array(units="m/N"))], "units.*got 'm/N'"),
        ([((0.0, 0.0), array(units="rad/Nm"))], "response: expected shape"),
        ([(POSES[0], array(units="rad/Nm"))], "response 1: expected a variance"),
        ([(POSES[0], array(units="rad/Nm", sample_time_s=1e-3))], "sample time of the robot"),
        ([(POSES[0], array(units="rad/Nm").rename(output="out"))], "expected dimensions"),
        ([made(frequency_hz=LINES_HZ + 990)], "frequencies above zero and below 1000 Hz"),
        ([made(frequency_hz=LINES_HZ - 1)], "frequencies above zero"),
        ([made(variance=None, covariance=np.ones((40, 9, 9)))], "positive definite.*line 1"),
    ],
)
def test_data_that_cannot_be_fitted(data: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        fit_responses(ROBOT, data, NAMES)


@pytest.mark.parametrize(
    "changes",
    [
        {"criterion": "best"},
        {"sampling": "none"},
        {"loss": "cauchy"},
        {"loss_scale": 0.0},
        {"starts": 0},
        {"starts": 1.5},
        {"seed": -1},
        {"gain_tolerance": float("nan")},
        {"uncertainty": "none"},
    ],
)
def test_options_out_of_range(changes: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=next(iter(changes))):
        FrequencyFitOptions(**changes)


def test_effects_that_are_not_linear() -> None:
    friction = [Effect("coulomb_friction", 1, {"coulomb_nm": 1.0, "smoothing_rad_s": 0.1})]
    with pytest.raises(InputError, match=r"expected only .*payload.*got coulomb_friction"):
        fit_responses(ROBOT, [CLEAN], NAMES, effects=friction)
    with pytest.raises(InputError, match="got nonlinear_stiffness"):
        model_response(load_robot("two_mass_axis"), LINES_HZ)


@pytest.mark.parametrize("freedom", [0, -1.0, np.nan, np.inf, "many"])
def test_degrees_of_freedom_are_positive(freedom: Any) -> None:
    with pytest.raises(InputError, match="degrees_of_freedom: expected"):
        made(degrees_of_freedom=freedom)


def test_a_quantity_without_unit_will_do() -> None:
    found = array(units=None, quantity="velocity")
    assert MeasuredResponse.of(POSES[0], found).quantity == "velocity"
    with pytest.raises(InputError, match="that agree"):
        MeasuredResponse.of(POSES[0], array(units="rad/Nm", quantity="velocity"))
    with pytest.raises(InputError, match="units to be one of"):
        MeasuredResponse.of(POSES[0], array(units="dB", quantity="velocity"))


def test_an_element_is_left_out_of_a_dataset() -> None:
    assert CLEAN.variance is not None
    variance = CLEAN.variance.copy()
    variance[:, 0, 1] = np.inf
    data = frf.frequency_response(
        LINES_HZ, CLEAN.response, estimator="t", variance=variance, output_unit="rad/s^2"
    )
    fit = fit_responses(ROBOT, [(POSES[0], data)], starts(NAMES))
    assert fit.n_residuals == 2 * 40 * 8


@pytest.mark.parametrize("freedom", [0.0, -2.0, np.nan])
def test_degrees_of_freedom_of_a_dataset_are_positive(freedom: float) -> None:
    data = frf.frequency_response(
        LINES_HZ,
        CLEAN.response,
        estimator="t",
        variance=CLEAN.variance,
        output_unit="rad/s^2",
        attrs={"degrees_of_freedom": freedom},
    )
    with pytest.raises(InputError, match="degrees_of_freedom: expected positive"):
        fit_responses(ROBOT, [(POSES[0], data)], NAMES)


def test_a_zero_element_has_no_logarithm() -> None:
    g = CLEAN.response.copy()
    g[:, 0, 1] = 0
    with pytest.raises(InputError, match="other than zero for a logarithm"):
        fit_responses(ROBOT, [made(response=g)], NAMES)
    assert CLEAN.variance is not None
    variance = CLEAN.variance.copy()
    variance[:, 0, 1] = np.inf
    fit = fit_responses(ROBOT, [made(response=g, variance=variance)], starts(NAMES))
    assert fit.n_residuals == 2 * 40 * 8
    np.testing.assert_allclose(fit.values, [TRUTH[n] for n in NAMES], rtol=1e-7)


def test_what_low_lines_do_not_show_is_named_with_advice() -> None:
    """At 1 Hz the arm moves as one body: no line shows the damping of a joint at 20 Hz."""
    names = ("axis1.motor_inertia", "axis1.viscous_friction", "axis1.damping", "axis3_yaw.damping")
    data = [response(POSES[0], 0.05, np.random.default_rng(1), lines_hz=np.array([1.0, 1.1]))]
    fit = fit_responses(ROBOT, data, names)
    assert not fit.identifiability.identifiable
    text = " ".join(fit.warnings)
    assert "known" in text and "freeze" in text and "axis3_yaw.damping" in text


def test_too_few_lines_leave_combinations_unknown() -> None:
    """One element at one line: two real numbers cannot tell three parameters."""
    variance = np.full((1, 3, 3), np.inf)
    variance[0, 0, 0] = 1e-6
    g = model_response(ROBOT, [2.0], POSES[0], quantity="acceleration").values
    data = [MeasuredResponse(POSES[0], np.array([2.0]), g, "acceleration", variance)]
    names = ("axis1.motor_inertia", "axis3_yaw.mass", "axis1.viscous_friction")
    fit = fit_responses(ROBOT, data, names)
    (combination,) = fit.identifiability.combinations
    # Rotor and arm turn as one: a heavier rotor passes for a lighter arm.
    assert {"axis1.motor_inertia", "axis3_yaw.mass"} <= set(combination.parameters)
    assert combination.kind == "unidentifiable" and "not each of" in str(combination)
    assert np.isinf(fit.std).all()
    assert fit.identifiability.condition == np.inf
    # The combination is right: along it the response does not change.
    (direction,) = combination.directions
    moved = {
        name: value * np.exp(1e-4 * share)
        for name, value, share in zip(fit.names, fit.values, direction, strict=True)
    }
    first = fit.names[0]
    other = ROBOT.with_parameters(moved).zoh_response([2.0], POSES[0])
    alone = ROBOT.with_parameters({first: moved[first]}).zoh_response([2.0], POSES[0])
    base = ROBOT.zoh_response([2.0], POSES[0])
    change, single = (abs((x / base).values[0, 0, 0] - 1) for x in (other, alone))
    assert change < 1e-3 * single


def test_identifiability_before_any_data() -> None:
    names = ("axis1.stiffness", "axis1.damping")
    found = identifiability(planned_information(ROBOT, names, POSES, LINES_HZ))
    assert found.identifiable
    data = responses(0.1, 3)
    fit = fit_responses(ROBOT, data, names)
    np.testing.assert_allclose(found.relative_std, fit.std_response / fit.values, rtol=0.2)
    with pytest.raises(InputError, match="relative_std"):
        planned_information(ROBOT, NAMES, POSES, LINES_HZ, relative_std=-1.0)
    with pytest.raises(InputError, match="operating_points_rad"):
        planned_information(ROBOT, NAMES, [0.0, 0.0, 0.0], LINES_HZ)


def test_parameters_on_a_bound_and_out_of_iterations_are_told() -> None:
    bounded = [Parameter("axis1.stiffness", 1e6, 5e5, 1.2e6, 1e5)]
    fit = fit_responses(ROBOT, [CLEAN], bounded)
    assert fit.at_bound == ("axis1.stiffness",)
    assert any("on a bound: axis1.stiffness" in warning for warning in fit.warnings)
    options = FrequencyFitOptions(max_iterations=1, reweightings=0)
    fit = fit_responses(ROBOT, [CLEAN], starts(NAMES), options=options)
    assert fit.status == "max_iterations"
    assert "allow more iterations" in fit.warnings[0]
