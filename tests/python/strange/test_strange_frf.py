"""Every argument of the frequency response package, fed with what it was not made for."""

from dataclasses import replace

import control
import numpy as np
import pytest
import scipy.signal

from axisight import frf, load_robot
from axisight.frf import errors, interop, plots
from axisight.frf.leakage import noise_leakage_power
from axisight.records import ArbitraryRecords
from frf_data import loop_records
from strange_values import feed

RECORDS = loop_records(2, 3, n_samples=40, noise=1e-3, lines=np.array([2, 5, 8]))[0]
ONE = replace(RECORDS, input=RECORDS.input[..., :1], output=RECORDS.output[..., :1], reference=None)
SET = loop_records(1, 2, n_samples=40, noise=1e-3, lines=np.array([1, 3, 5, 7, 11, 13]))[0]
ROWS = np.random.default_rng(1).normal(size=(2, 80, 1))
ARBITRARY = ArbitraryRecords(1e-3, ROWS, np.roll(ROWS, 1, axis=1))
DENSE = loop_records(1, 2, n_samples=80, noise=1e-3, lines=np.arange(1, 30))[0]
ESTIMATE = frf.mfrf(RECORDS)
OPTIONS = {"quantity": "velocity", "remove_drift": True, "threads": 1}
G = np.array([[[1.0, 0.2], [0.1, 2.0]]] * 3) * (1 + 0.5j)
V = 1e-3 * G[:, ::-1]
ROBOT = load_robot("irb6600_like")
REFERENCES = np.random.default_rng(2).normal(size=(2, 3, 20, 3))
PREDICTED = frf.predict_errors(ROBOT, REFERENCES, [1, 2])

LOCAL = {"order": 1, "half_width": None, "lines": None, **OPTIONS}
CASES = {
    "mfrf": (frf.mfrf, {"records": RECORDS, "covariance": "full", **OPTIONS}),
    "h1": (frf.h1, {"records": RECORDS, **OPTIONS}),
    "h2": (frf.h2, {"records": RECORDS, **OPTIONS}),
    "joint_input_output": (frf.joint_input_output, {"records": RECORDS, **OPTIONS}),
    "arithmetic_mean": (frf.arithmetic_mean, {"data": RECORDS, **OPTIONS}),
    "arithmetic_mean of a list": (frf.arithmetic_mean, {"data": [ESTIMATE, ESTIMATE]}),
    "logarithmic_mean": (frf.logarithmic_mean, {"data": RECORDS, "phase": "angle", **OPTIONS}),
    "logarithmic_mean, (7.9)": (
        frf.logarithmic_mean,
        {"data": ONE, "phase": "cross_spectrum", **OPTIONS},
    ),
    "harmonic_mean": (frf.harmonic_mean, {"data": RECORDS, **OPTIONS}),
    "robust_method": (frf.robust_method, {"records": RECORDS, **OPTIONS}),
    "fast_method": (frf.fast_method, {"records": SET, **OPTIONS}),
    "etfe": (frf.etfe, {"records": ONE, "bandwidth_hz": 200.0, "weighting": "flat", **OPTIONS}),
    "spectral_analysis": (
        frf.spectral_analysis,
        {"records": RECORDS, "bandwidth_hz": 200.0, "taper": "none", **OPTIONS},
    ),
    "local_polynomial": (frf.local_polynomial, {"records": ARBITRARY, **LOCAL}),
    "local_polynomial, periods": (frf.local_polynomial, {"records": RECORDS, **LOCAL}),
    "local_rational": (
        frf.local_rational,
        {"records": ARBITRARY, "denominator_order": 1, **LOCAL},
    ),
    "local_joint_input_output": (
        frf.local_joint_input_output,
        {
            "records": DENSE,
            "order": 1,
            "denominator_order": 1,
            "half_width": None,
            "lines": None,
            "quantity": "velocity",
            "remove_drift": True,
        },
    ),
    "with_input_covariance": (
        frf.with_input_covariance,
        {"dataset": ESTIMATE, "records": RECORDS, "half_width": 1},
    ),
    "smooth": (
        frf.smooth,
        {"dataset": ESTIMATE, "bandwidth_hz": 100.0, "weight": np.ones(3)},
    ),
    "confidence_radius": (frf.confidence_radius, {"dataset": ESTIMATE, "probability": 0.9}),
    "explain_flags": (frf.explain_flags, {"dataset": ESTIMATE, "records": RECORDS}),
    "frequency_response": (
        frf.frequency_response,
        {
            "frequency_hz": np.array([1.0, 2.0, 3.0]),
            "response": G,
            "estimator": "x",
            "variance": np.abs(G),
            "noise_variance": np.abs(G),
            "condition": np.ones(3),
            "flag": np.zeros(3, np.int8),
            "coherence": np.ones((3, 2)),
            "degrees_of_freedom": np.ones((3, 2, 2)),
            "input_unit": "Nm",
            "output_unit": "rad",
            "attrs": {},
        },
    ),
    "invert": (frf.invert, {"matrices": G, "out": np.empty_like(G), "threads": 1}),
    "right_divide": (frf.right_divide, {"y": V, "u": G, "threads": 1}),
    "robot_loop": (
        lambda **a: frf.robot_loop(**a).response,
        {"robot": ROBOT, "frequency_hz": np.array([1.0, 2.0])},
    ),
    "noise_leakage_power": (
        noise_leakage_power,
        {"robot": ROBOT, "frequency_hz": np.array([1.0, 2.0]), "n_samples": 50},
    ),
    "predict_errors": (
        frf.predict_errors,
        {
            "robot": ROBOT,
            "references_rad_s": REFERENCES,
            "lines": [1, 2],
            "effects": (),
            "waiting_periods": 1,
            "n_periods": 1,
            "model": "linear",
            "threads": 1,
        },
    ),
    "averaged_relative_error": (
        frf.averaged_relative_error,
        {"prediction": PREDICTED, "n_realizations": 4},
    ),
    "compare_designs": (frf.compare_designs, {"predictions": {"a": PREDICTED}}),
    "errors.sensitivity": (errors.sensitivity, {"response": G, "controller": G}),
    "errors.reference_to_input": (errors.reference_to_input, {"response": G, "controller": G}),
    "errors.reference_to_output": (errors.reference_to_output, {"response": G, "controller": G}),
    "errors.total_disturbance": (
        errors.total_disturbance,
        {"response": G, "input_disturbance": V, "output_disturbance": V},
    ),
    "errors.closed_loop_spectra": (
        errors.closed_loop_spectra,
        {"reference": G, "disturbance": V, "response": G, "controller": G},
    ),
    "errors.estimation_error": (errors.estimation_error, {"disturbance": V, "input_": G}),
    "errors.error_from_reference": (
        errors.error_from_reference,
        {"disturbance": V, "reference": G, "response": G, "controller": G},
    ),
    "errors.approximate_error": (
        errors.approximate_error,
        {"disturbance": V, "reference": G, "response": G, "controller": G},
    ),
    "errors.approximate_error_directions": (
        errors.approximate_error_directions,
        {
            "disturbance": V,
            "scalar_reference": np.ones(3),
            "directions": np.eye(2),
            "response": G,
            "controller": G,
        },
    ),
    "errors.error_variance": (
        errors.error_variance,
        {"disturbance_power": np.ones((3, 2)), "input_": G},
    ),
    "errors.directions_gain": (errors.directions_gain, {"directions": np.eye(2)}),
    "errors.relative_error": (errors.relative_error, {"estimate": G, "true": G}),
    "errors.mean_relative_error": (errors.mean_relative_error, {"estimate": G, "true": G}),
    "errors.signal_to_noise_ratio": (
        errors.signal_to_noise_ratio,
        {"signal": G, "disturbance": V},
    ),
    "errors.spectral_analysis_limit": (
        errors.spectral_analysis_limit,
        {
            "response": G,
            "controller": G,
            "reference_spectrum": G,
            "disturbance_spectrum": G,
        },
    ),
    "interop.to_control": (
        lambda **a: interop.to_control(**a).frdata,
        {"response": ESTIMATE},
    ),
    "interop.from_control": (
        interop.from_control,
        {
            "frd": control.frd(np.ones((1, 1, 2)), [1.0, 2.0]),
            "input_unit": "Nm",
            "output_unit": "rad",
        },
    ),
    "interop.to_scipy": (
        interop.to_scipy,
        {"response": ESTIMATE, "output": 1, "input": 2, "sample_time_s": 1e-3},
    ),
    "interop.from_scipy": (
        interop.from_scipy,
        {
            "w": np.array([1.0, 2.0]),
            "h": np.ones(2),
            "sample_time_s": 1e-3,
            "input_unit": "Nm",
            "output_unit": "rad",
        },
    ),
    "interop.evaluate": (
        interop.evaluate,
        {
            "system": scipy.signal.lti([1.0], [1.0, 1.0]),
            "frequency_hz": np.array([1.0, 2.0]),
            "input_unit": "Nm",
            "output_unit": "rad",
        },
    ),
    "interop.save_netcdf": (interop.save_netcdf, {"response": ESTIMATE, "path": "x.nc"}),
    "interop.load_netcdf": (interop.load_netcdf, {"path": "given.nc"}),
    "plots.plot_bode": (
        plots.plot_bode,
        {"responses": ESTIMATE, "output": 1, "input": 1, "unwrap": False, "width_in": 3.0},
    ),
}
# Functions of frequency that are unknown where a matrix is singular or a number is.
NAN_IS_SAID = frozenset({"result"})
NAN_IN = frozenset({f"predictions.{n}" for n in ("relative_error",)} | {"input_snr"})


@pytest.mark.parametrize("name", CASES)
def test_only_errors_of_ours_come_out(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    interop.save_netcdf(ESTIMATE, "given.nc")
    function, good = CASES[name]
    by_line = name.startswith("errors.") or name in ("invert", "right_divide")
    allowed = NAN_IS_SAID if by_line or name.startswith("interop.to_") else frozenset()
    assert not (wrong := feed(function, good, allowed | NAN_IN)), "\n".join(wrong)


def test_every_public_name_is_fed():
    fed = {name.split(",")[0].split(" ")[0].split(".")[0] for name in CASES}
    assert set(frf.__all__) <= fed | {"FastMethod", "Flag", "Loop"}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"order": float("nan")}, "order"),
        ({"half_width": float("inf")}, "half_width"),
        ({"threads": -1}, "threads"),
        ({"lines": np.ones((2, 2))}, "lines"),
    ],
)
def test_what_used_to_raise_something_else(options, message):
    for method in (frf.local_polynomial, frf.local_rational):
        with pytest.raises(ValueError, match=message):
            method(ARBITRARY, **options)


def test_files_that_are_not_there_or_not_netcdf(tmp_path):
    with pytest.raises(ValueError, match="path: expected a NetCDF file"):
        interop.load_netcdf(tmp_path / "none.nc")
    (tmp_path / "text.nc").write_text("hello")
    with pytest.raises(ValueError, match="path: expected a NetCDF file"):
        interop.load_netcdf(tmp_path / "text.nc")


def test_levels_of_distortion_come_back_from_a_file(tmp_path):
    levels = frf.fast_method(SET).distortion
    interop.save_netcdf(levels, tmp_path / "levels.nc")
    back = interop.load_netcdf(tmp_path / "levels.nc")
    for name in levels.variables:
        np.testing.assert_array_equal(back[name].values, levels[name].values, err_msg=name)
    assert back.attrs == levels.attrs and back["distortion"].dtype == complex
    full = frf.mfrf(RECORDS, covariance="full")
    interop.save_netcdf(full, tmp_path / "full.nc")
    again = interop.load_netcdf(tmp_path / "full.nc")
    np.testing.assert_array_equal(again["covariance"].values, full["covariance"].values)
    assert list(again["element"].values) == ["1,1", "1,2", "2,1", "2,2"]
