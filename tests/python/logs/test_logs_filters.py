"""Filters against the analytic response of the forward-backward Butterworth filter."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from axisight.errors import InputError
from axisight.logs import decimate_zero_phase, differentiate, lowpass

H = 1e-3


def gain(frequency_hz, cutoff_hz, order):
    """Gain of the filter run both ways, with the bilinear warping."""
    ratio = np.tan(np.pi * frequency_hz * H) / np.tan(np.pi * cutoff_hz * H)
    return 1.0 / (1.0 + ratio ** (2 * order))


@given(
    frequency_hz=st.floats(0.5, 8.0),
    cutoff_hz=st.floats(40.0, 200.0),
    phase=st.floats(0.0, 6.28),
    order=st.integers(2, 6),
)
def test_derivatives_of_sines_within_the_derived_error(frequency_hz, cutoff_hz, phase, order):
    # Zero phase: the filter scales the sine by its gain. Central differences of a sine are
    # sin(wh)/(wh) and (sin(wh/2)/(wh/2))^2 of the truth: relative errors (wh)^2/6 and (wh)^2/12.
    t = np.arange(4000) * H
    w = 2 * np.pi * frequency_hz
    velocity, acceleration = differentiate(np.sin(w * t + phase), H, cutoff_hz, order)
    lost = 1.0 - gain(frequency_hz, cutoff_hz, order)
    inner = slice(1000, -1000)  # ends hold the padding's transient, gone after 40 cutoff periods
    rounding = 1e-16 / H**2 * 50
    v_error = np.abs(velocity - w * np.cos(w * t + phase))[inner].max()
    a_error = np.abs(acceleration + w**2 * np.sin(w * t + phase))[inner].max()
    assert v_error <= w * (lost + (w * H) ** 2 / 6) * 1.001 + rounding * H
    assert a_error <= w**2 * (lost + (w * H) ** 2 / 12) * 1.001 + rounding


def test_differentiation_is_exact_on_lines_and_inner_parabolas():
    # Odd padding continues a line exactly, up to its ends; a parabola only in the interior
    t = np.arange(3000) * H
    velocity, acceleration = differentiate(3.0 * t - 1.0, H, 50.0)
    np.testing.assert_allclose(velocity, 3.0, rtol=1e-9)
    assert np.abs(acceleration).max() < 1e-5
    velocity, acceleration = differentiate(np.column_stack([t**2, -(t**2)]), H, 50.0)
    inner = slice(1000, -1000)
    np.testing.assert_allclose(velocity[inner], np.column_stack([2 * t, -2 * t])[inner], rtol=1e-8)
    np.testing.assert_allclose(acceleration[inner], [[2.0, -2.0]] * 1000, rtol=1e-4)


@pytest.mark.parametrize("order", [1, 2, 4])
@pytest.mark.parametrize("frequency_hz", [10.0, 50.0, 120.0])
def test_lowpass_has_the_documented_gain_and_no_phase(order, frequency_hz):
    t = np.arange(5000) * H
    x = np.sin(2 * np.pi * frequency_hz * t)
    expected = gain(frequency_hz, 50.0, order) * x
    inner = slice(1000, -1000)
    np.testing.assert_allclose(lowpass(x, H, 50.0, order)[inner], expected[inner], atol=1e-9)


def test_lowpass_works_per_column_and_keeps_constants():
    x = np.random.default_rng(0).standard_normal((400, 3))
    y = lowpass(x, H, 30.0)
    for column in range(3):
        np.testing.assert_array_equal(y[:, column], lowpass(x[:, column], H, 30.0))
    np.testing.assert_allclose(lowpass(np.full(200, 7.0), H, 5.0), 7.0, rtol=1e-10)


def test_decimation_keeps_low_and_removes_aliasing_frequencies():
    t = np.arange(20000) * H
    low, high = np.sin(2 * np.pi * 2.0 * t), np.sin(2 * np.pi * 98.0 * t)  # 98 Hz aliases to 2 Hz
    kept = decimate_zero_phase(low + high, 10)
    assert kept.shape == (2000,)
    np.testing.assert_allclose(kept[200:-200], low[::10][200:-200], atol=2e-3)
    np.testing.assert_array_equal(decimate_zero_phase(low, 1), low)


@pytest.mark.parametrize("cutoff_hz", [500.0, 501.0, 0.0, -1.0, np.nan])
def test_cutoff_outside_the_band(cutoff_hz):
    with pytest.raises(InputError, match=r"cutoff_hz: expected .* Nyquist frequency 500 Hz, got"):
        differentiate(np.zeros(100), H, cutoff_hz)


def test_bad_filter_inputs():
    with pytest.raises(InputError, match="x: expected more than 15 samples for order 4, got 15"):
        lowpass(np.zeros(15), H, 50.0)
    assert lowpass(np.zeros(16), H, 50.0).shape == (16,)
    with pytest.raises(InputError, match="got 2 NaN/inf"):
        lowpass(np.array([np.nan, np.inf] + [0.0] * 50), H, 50.0)
    with pytest.raises(InputError, match=r"expected shape \(n,\) or \(n, k\), got \(2, 2, 2\)"):
        lowpass(np.zeros((2, 2, 2)), H, 50.0)
    with pytest.raises(InputError, match="sample_time_s: expected a positive time"):
        lowpass(np.zeros(50), 0.0, 50.0)
    with pytest.raises(InputError, match="order: expected at least 1, got 0"):
        lowpass(np.zeros(50), H, 50.0, order=0)
    for factor in (0, -2, 2.5, True):
        with pytest.raises(InputError, match="factor: expected a positive integer"):
            decimate_zero_phase(np.zeros(50), factor)
    with pytest.raises(InputError, match="x: expected more than"):
        decimate_zero_phase(np.zeros(10), 2)
