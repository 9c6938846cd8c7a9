"""Without noise every estimator returns the response of a known loop; conventions; order."""

from collections.abc import Callable
from dataclasses import replace

import control
import numpy as np
import pytest
import scipy.signal
import xarray as xr

from axisight import frf
from axisight.records.periodic import PeriodicRecords
from frf_data import GAIN, A, B, C, T, loop_records, plant, reordered

ESTIMATORS: dict[str, Callable[[PeriodicRecords], xr.Dataset]] = {
    "mfrf": frf.mfrf,
    "h1": frf.h1,
    "h2": frf.h2,
    "joint_input_output": frf.joint_input_output,
    "arithmetic_mean": frf.arithmetic_mean,
    "logarithmic_mean": frf.logarithmic_mean,
    "logarithmic_mean, phase of the mean": lambda r: frf.logarithmic_mean(r, phase="arithmetic"),
    "harmonic_mean": frf.harmonic_mean,
}
# Rounding of the DFT (1e-15 of the largest line) through U of condition 10 or so.
EXACT = 1e-10


@pytest.mark.parametrize("name", ESTIMATORS)
@pytest.mark.parametrize("n_realizations", [1, 3])
@pytest.mark.parametrize("n_periods", [1, 4])
def test_exact_without_noise(name: str, n_realizations: int, n_periods: int) -> None:
    records = loop_records(n_realizations, n_periods)[0]
    assert np.abs(np.linalg.eigvals(A - B @ (GAIN * C))).max() < 1  # the loop is stable
    found = ESTIMATORS[name](records)
    truth = plant(records.frequency_hz)
    assert np.abs(found["response"].values - truth).max() < EXACT * np.abs(truth).max()
    assert (found["flag"] == frf.Flag.GOOD).all()
    assert found.attrs["estimator"] == name.split(",", maxsplit=1)[0]
    uncertain = found["variance"].values
    known = n_periods > 1 or n_realizations > 1
    assert (np.isnan(uncertain) != known).all() and not (uncertain > EXACT**2).any()


@pytest.mark.parametrize("name", ESTIMATORS)
def test_order_of_experiments_does_not_matter(name: str) -> None:
    records = loop_records(3, 3, noise=0.01)[0]
    # Whole realizations change places, and experiments inside them.
    order = np.array([5, 4, 0, 1, 3, 2])
    one, two = ESTIMATORS[name](records), ESTIMATORS[name](reordered(records, order))
    for variable in ("response", "variance", "noise_variance", "condition"):
        np.testing.assert_allclose(
            one[variable].values, two[variable].values, rtol=1e-8, atol=0, err_msg=variable
        )


def test_one_set_of_experiments_needs_no_reference() -> None:
    """R cancels: with as many experiments as inputs, noise or not, JIO is Y U^-1."""
    records = loop_records(1, 3, noise=0.05)[0]
    one, two = frf.mfrf(records), frf.joint_input_output(records)
    for variable in ("response", "variance"):
        np.testing.assert_allclose(one[variable].values, two[variable].values, rtol=1e-9)
    # With more they agree without noise only.
    records = loop_records(3, 3, noise=0.05)[0]
    one, two = frf.mfrf(records), frf.joint_input_output(records)
    assert np.abs(one["response"].values - two["response"].values).max() > 1e-6


def test_sign_scale_and_axis_order_are_those_of_python_control() -> None:
    records = loop_records()[0]
    found = frf.mfrf(records)["response"]
    system = control.ss(A, B, C, np.zeros((2, 2)), T)
    peer = system(np.exp(2j * np.pi * records.frequency_hz * T))
    truth = np.moveaxis(peer, -1, 0)  # python-control: output, input, frequency
    np.testing.assert_allclose(found.values, truth, rtol=1e-8)
    assert np.abs(truth - truth.swapaxes(1, 2)).max() > 0.1  # else the order is not seen
    data = control.frd(np.moveaxis(found.values, 0, -1), 2 * np.pi * records.frequency_hz)
    assert data.noutputs == 2 and data.ninputs == 2


def test_etfe_and_delay() -> None:
    """A pure delay of d samples: exp(-i w d T), phase falling."""
    rng = np.random.default_rng(3)
    u = rng.normal(size=(1, 1, 200, 1)).repeat(2, axis=1)
    lines = np.arange(1, 100)
    records = PeriodicRecords(T, u, np.roll(u, 3, axis=2), lines)
    w = 2 * np.pi * records.frequency_hz
    found = frf.etfe(records)["response"].values[:, 0, 0]
    np.testing.assert_allclose(found, np.exp(-1j * w * 3 * T), rtol=0, atol=1e-11)


@pytest.mark.parametrize("quantity", ["velocity", "acceleration"])
@pytest.mark.parametrize("name", ["mfrf", "h1", "joint_input_output", "logarithmic_mean"])
def test_derivatives_and_drift(name: str, quantity: str) -> None:
    """The position drifts by the same amount every period; the spectrum is that of the rest."""
    records = loop_records(2, 3)[0]
    shape = records.output.shape
    time = np.arange(shape[1] * shape[2]).reshape(1, shape[1], shape[2], 1) * T
    slope = np.array([0.7, -2.0]) * np.arange(1, 5)[:, None, None, None]
    drifting = replace(records, output=records.output + slope * time)
    function = getattr(frf, name)
    power = {"velocity": 1, "acceleration": 2}[quantity]
    truth = plant(records.frequency_hz) * (
        (2j * np.pi * records.frequency_hz[:, None, None]) ** power
    )
    found = function(drifting, quantity=quantity)
    # The drift is a thousand times the rest at most.
    assert np.abs(found["response"].values / truth - 1).max() < 1e-8
    unit = {"velocity": "rad/s/Nm", "acceleration": "rad/s^2/Nm"}[quantity]
    assert found["response"].attrs["units"] == unit
    left = function(drifting, quantity=quantity, remove_drift=False)
    assert np.abs(left["response"].values / truth - 1).max() > 1e-3


def test_threads_change_no_bit() -> None:
    records = loop_records(2, 3, noise=0.1)[0]
    xr.testing.assert_identical(frf.mfrf(records), frf.mfrf(records, threads=2))


def test_spectral_analysis_of_any_data() -> None:
    """White noise through a short filter: within a few standard deviations, not exact."""
    rng = np.random.default_rng(5)
    u = rng.normal(size=(8_000, 2))
    y = np.stack(
        [
            scipy.signal.lfilter([0.5, 0.3], [1.0], u[:, 0]) + 0.2 * u[:, 1],
            scipy.signal.lfilter([1.0], [1.0, -0.5], u[:, 1]),
        ],
        axis=1,
    )
    y += 0.1 * rng.normal(size=y.shape)
    records = PeriodicRecords(T, u[None, None], y[None, None], np.arange(1, 4_000))
    found = frf.spectral_analysis(records, bandwidth_hz=5.0, taper="hann").isel(
        frequency_hz=slice(100, -100, 160)
    )
    z = np.exp(2j * np.pi * found["frequency_hz"].values * T)
    zero = np.zeros_like(z)
    rows = [[0.5 + 0.3 / z, zero + 0.2], [zero, 1 / (1 - 0.5 / z)]]
    truth = np.moveaxis(np.array(rows), -1, 0)
    error = np.abs(found["response"].values - truth) ** 2 / found["variance"].values
    # 24 lines, 96 elements, mean of |error|^2 / variance one: standard error 0.1.
    assert 0.7 < error.mean() < 1.3
    # Least at high frequency: signal 0.2^2 + 0.2^2, noise 0.1^2.
    assert (found["coherence"].values > 0.8).all()


def test_smoothing_keeps_a_straight_line_and_flattens_a_curve() -> None:
    frequency = np.arange(1.0, 50.0)
    line = (2.0 + 0.1j * frequency)[:, None, None]
    flat = frf.frequency_response(frequency, line, estimator="given", variance=np.ones(line.shape))
    found = frf.smooth(flat, 5.0)
    np.testing.assert_allclose(found["response"].values, line, rtol=1e-12)
    # Half width h of h lines: sum alpha^2 = 3 / (4 h) for a Hann window.
    middle = found["variance"].values[20, 0, 0]
    assert abs(middle - 0.75 / 5) < 1e-9  # the window ends 1e-9 early
    curve = ((frequency - 25.0) ** 2 + 0j)[:, None, None]
    bent = frf.smooth(frf.frequency_response(frequency, curve, estimator="given"), 5.0)
    # h^2 (1/3 - 2/pi^2) times half the second derivative, less for the sum over lines.
    expected = 25 * (1 / 3 - 2 / np.pi**2)
    assert abs(bent["response"].values[24, 0, 0] - expected) < 0.1 * expected
