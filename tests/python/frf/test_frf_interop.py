"""To and from python-control, SciPy and NetCDF: values, axis order, sign, units, refusals."""

import importlib

import control
import numpy as np
import pytest
import xarray as xr
from scipy import signal

from axisight.errors import InputError, MissingExtraError
from axisight.frf import Flag, frequency_response
from axisight.frf.interop import (
    evaluate,
    from_control,
    from_scipy,
    load_netcdf,
    save_netcdf,
    to_control,
    to_scipy,
)

F = np.array([0.5, 1.0, 3.0, 10.0])
W = 2 * np.pi * F


def two_by_three():
    """Elements that cannot be mistaken for one another: a lag of (10 o + i) rad/s each."""
    data = np.array(
        [[[1 / (1 + 1j * w / (10 * o + i)) for i in (1, 2, 3)] for o in (1, 2)] for w in W]
    )
    return frequency_response(F, data, estimator="truth", variance=np.abs(data) ** 2)


def control_model():
    rows = [[control.tf([1], [1 / (10 * o + i), 1]) for i in (1, 2, 3)] for o in (1, 2)]
    return control.append(*[g for row in rows for g in row]), rows


def test_axis_order_and_sign_are_those_of_python_control():
    """Both directions against models that python-control evaluates itself."""
    ours = two_by_three()
    _, rows = control_model()
    frd = to_control(ours)
    assert frd.frdata.shape == (2, 3, 4)
    for o in range(2):
        for i in range(3):
            np.testing.assert_allclose(frd.frdata[o, i], rows[o][i](1j * W), rtol=1e-13)
    np.testing.assert_allclose(frd.omega, W)
    assert (np.angle(frd.frdata) < 0).all()  # lags
    # A product of two models is that of the matrices.
    both = frd * control.frd(np.ones((3, 1, 4)), W)
    np.testing.assert_allclose(both.frdata[0, 0], ours.response.values[:, 0].sum(1))


def test_control_round_trip():
    ours = two_by_three()
    back = from_control(to_control(ours))
    xr.testing.assert_allclose(back.response, ours.response)
    np.testing.assert_allclose(back.frequency_hz, F, rtol=1e-14)
    assert np.isnan(back.variance).all()


def test_from_control_sorts_the_lines():
    frd = control.frd(np.array([1.0, 2.0, 3.0]) + 0j, [30.0, 10.0, 20.0])
    got = from_control(frd, input_unit="A", output_unit="m")
    np.testing.assert_allclose(got.frequency_hz.values * 2 * np.pi, [10, 20, 30])
    np.testing.assert_allclose(got.response.values[:, 0, 0], [2, 3, 1])
    assert got.response.units == "m/A"


def test_flagged_lines_do_not_reach_python_control():
    ours = two_by_three()
    ours.response[1] = np.nan
    ours.flag[1] = Flag.RANK_DEFICIENT
    frd = to_control(ours)
    np.testing.assert_allclose(frd.omega, W[[0, 2, 3]])
    with pytest.raises(InputError, match="NaN at all"):
        to_control(ours.isel(frequency_hz=[1]))


def test_models_are_not_taken_for_responses():
    with pytest.raises(InputError, match="a model is evaluated at chosen lines"):
        from_control(control.tf([1], [1, 1]))


def test_without_python_control_the_extra_is_named(monkeypatch):
    def absent(name):
        raise ModuleNotFoundError(name)

    monkeypatch.setattr(importlib, "import_module", absent)
    with pytest.raises(MissingExtraError, match=r"axisight\[control\]"):
        to_control(two_by_three())
    assert issubclass(MissingExtraError, ImportError)


def test_scipy_continuous_both_ways():
    system = signal.lti([2.0], [1.0, 3.0, 40.0])
    w, h = signal.freqresp(system, W)
    ours = from_scipy(w, h)
    exact = evaluate(system, F)
    np.testing.assert_allclose(ours.response, exact.response, rtol=1e-13)
    assert (exact.variance == 0).all()
    back_w, back_h = to_scipy(ours)
    np.testing.assert_allclose(back_w, w, rtol=1e-14)
    np.testing.assert_array_equal(back_h, h)
    np.testing.assert_allclose(
        to_scipy(two_by_three(), output=2, input=3)[1], 1 / (1 + 1j * W / 23)
    )


def test_scipy_discrete_is_in_radians_per_sample():
    t = 0.02
    system = signal.dlti([0.5], [1.0, -0.5], dt=t)
    w, h = signal.dfreqresp(system, W * t)
    ours = from_scipy(w, h, sample_time_s=t)
    np.testing.assert_allclose(ours.frequency_hz, F, rtol=1e-14)
    np.testing.assert_allclose(ours.response, evaluate(system, F).response, rtol=1e-13)
    np.testing.assert_allclose(to_scipy(ours, sample_time_s=t)[0], w, rtol=1e-14)


A, B = np.array([[0.0, 1], [-400, -2]]), np.array([[0.0, 0], [1, 2]])
C, D = np.array([[1.0, 0], [0, 1], [1, 1]]), np.array([[0.0, 0], [0, 1], [0, 0]])


def test_state_space_with_several_channels_against_python_control():
    exact = evaluate(signal.StateSpace(A, B, C, D), F)
    assert exact.response.shape == (4, 3, 2)
    theirs = control.ss(A, B, C, D)(1j * W)
    np.testing.assert_allclose(exact.response.values, np.moveaxis(theirs, 2, 0), rtol=1e-12)
    discrete = evaluate(signal.dlti(0.01 * A + np.eye(2), 0.01 * B, C, D, dt=0.01), F)
    theirs = control.ss(0.01 * A + np.eye(2), 0.01 * B, C, D, 0.01)(np.exp(1j * W * 0.01))
    np.testing.assert_allclose(discrete.response.values, np.moveaxis(theirs, 2, 0), rtol=1e-12)


def test_zeros_and_poles_are_the_same_system():
    zpk = signal.ZerosPolesGain([-2.0], [-1 + 5j, -1 - 5j], 3.0)
    np.testing.assert_allclose(
        evaluate(zpk, F).response, evaluate(zpk.to_tf(), F).response, rtol=1e-12
    )


@pytest.mark.parametrize(
    "system",
    [
        signal.lti([1.0], [1.0, 0.0]),
        signal.ZerosPolesGain([], [0.0], 1.0),
        signal.StateSpace([[0.0]], [[1.0]], [[1.0]], [[0.0]]),
    ],
    ids=["tf", "zpk", "ss"],
)
def test_a_line_on_a_pole_is_nan_not_infinite(system):
    got = evaluate(system, np.array([0.0, 1.0]))
    assert np.isnan(got.response.values[0, 0, 0])
    assert got.response.values[1, 0, 0] == pytest.approx(1 / (2j * np.pi))
    assert np.isnan(got.variance.values[0, 0, 0])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: evaluate(control.tf([1], [1, 1]), F), "expected a scipy.signal lti"),
        (lambda: evaluate(signal.dlti([1.0], [1.0, 0.5]), F), "dt=True"),
        (lambda: evaluate(signal.dlti([1.0], [1.0, 0.5], dt=0.1), F), "Nyquist"),
        (lambda: evaluate(signal.lti([1.0], [1.0, 1]), F[::-1]), "ascending"),
        (lambda: from_scipy(W, np.ones((4, 2))), "h: expected shape"),
        (lambda: from_scipy(W[::-1], np.ones(4)), "w: expected ascending"),
        (lambda: from_scipy(W, np.ones(4), sample_time_s=0.0), "sample_time_s"),
        (lambda: to_scipy(two_by_three(), output=3), r"output: expected one of \[1 2\], got 3"),
        (lambda: to_scipy(xr.Dataset()), "expected a Dataset with a variable response"),
    ],
)
def test_misuse_is_named(call, message):
    with pytest.raises(InputError, match=message):
        call()


def test_netcdf_round_trip(tmp_path):
    ours = two_by_three()
    ours.response[2] = np.nan
    ours.flag[2] = Flag.NO_EXCITATION
    ours.attrs["n_periods"] = 8
    save_netcdf(ours, tmp_path / "response.nc")
    back = load_netcdf(tmp_path / "response.nc")
    xr.testing.assert_identical(back.drop_attrs(), ours.drop_attrs())
    assert back.response.dtype == complex
    assert {k: back.attrs[k] for k in ours.attrs} == ours.attrs
    assert back.response.units == "rad/Nm"
    assert back.frequency_hz.units == "Hz"
    with xr.open_dataset(tmp_path / "response.nc", engine="scipy") as plain:
        np.testing.assert_array_equal(plain.response_imag, ours.response.values.imag)


def test_netcdf_misuse_is_named(tmp_path):
    ours = two_by_three()
    ours.attrs["settings"] = {"a": 1}
    with pytest.raises(InputError, match=r"attributes NetCDF can hold.*settings"):
        save_netcdf(ours, tmp_path / "response.nc")
    xr.Dataset({"x": ("t", np.zeros(3))}).to_netcdf(tmp_path / "other.nc", engine="scipy")
    with pytest.raises(InputError, match="over frequency_hz"):
        load_netcdf(tmp_path / "other.nc")
