"""Motions from noisy positions: known sinusoids, SciPy and the promised band."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.signal import butter, filtfilt

from axisight.errors import InputError
from axisight.rigid_body.motion import amplitude_gain, estimate_motion

STEP = 1e-3
CUTOFF = 20.0


def sinusoid(frequency_hz, n=5000, phase=0.4):
    """Position, velocity and acceleration of 0.7 + sin, axis 2 of twice the size."""
    w = 2 * np.pi * frequency_hz
    t = np.arange(n) * STEP
    size = np.array([1.0, 2.0])
    x = np.sin(w * t + phase)[:, None] * size
    v = w * np.cos(w * t + phase)[:, None] * size
    return 0.7 + x, v, -(w**2) * x


def test_sinusoid_has_the_gain_that_is_said_and_no_phase():
    for f in (1.0, 8.0, 14.0):
        x, v, a = sinusoid(f)
        found = estimate_motion(x, x, sample_time_s=STEP, cutoff_hz=CUTOFF)
        keep = np.round(found.time_s / STEP).astype(int)
        gain = [
            float(amplitude_gain(f, sample_time_s=STEP, cutoff_hz=CUTOFF, derivative=k))
            for k in range(3)
        ]
        # What the ends leave over: a thousandth of the error made there, at most the
        # amplitude of each derivative.
        for got, true, g in (
            (found.position_rad - 0.7, x - 0.7, gain[0]),
            (found.velocity_rad_s, v, gain[1]),
            (found.acceleration_rad_s2, a, gain[2]),
            (found.torque_nm - 0.7, x - 0.7, gain[0]),
        ):
            assert np.abs(got - g * true[keep]).max() < 2e-3 * np.abs(true).max()


def test_band_edge_has_the_promised_error():
    for error in (0.001, 0.01, 0.1):
        edge = estimate_motion(
            np.zeros(3000), sample_time_s=STEP, cutoff_hz=CUTOFF, amplitude_error=error
        ).band_hz[1]
        losses = [
            1 - float(amplitude_gain(edge, sample_time_s=STEP, cutoff_hz=CUTOFF, derivative=k))
            for k in range(3)
        ]
        assert max(losses) == pytest.approx(error, rel=1e-6)
        # Measured, not only computed: ten seconds of a sine at the edge.
        _, v, a = sinusoid(edge, n=10_000)
        x = sinusoid(edge, n=10_000)[0]
        found = estimate_motion(x, sample_time_s=STEP, cutoff_hz=CUTOFF, amplitude_error=error)
        middle = slice(30, -30)  # where nothing of the ends is left
        keep = np.round(found.time_s / STEP).astype(int)[middle]
        worst = 0.0
        for got, true in (
            (found.velocity_rad_s[middle], v[keep]),
            (found.acceleration_rad_s2[middle], a[keep]),
        ):
            worst = max(worst, 1 - np.sum(got * true) / np.sum(true**2))
        assert worst == pytest.approx(error, rel=1e-3)


def test_agrees_with_scipy():
    rng = np.random.default_rng(3)
    t = np.arange(4000) * STEP
    x = np.sin(2 * np.pi * t)[:, None] + rng.normal(0, 1e-3, (4000, 2))
    found = estimate_motion(x, x, sample_time_s=STEP, cutoff_hz=CUTOFF, decimation=1)
    b, a = butter(4, CUTOFF * 2 * STEP)
    smooth = filtfilt(b, a, x, axis=0, padlen=500)
    speed = np.gradient(smooth, STEP, axis=0)
    force = np.diff(smooth, 2, axis=0) / STEP**2
    first, last = found.dropped
    cut = slice(first, 4000 - last)
    assert found.n_samples == 4000 - first - last
    # The direct form of SciPy's filter is worse by its rounding, about 1e-16 / (wT)^4 of the
    # position, and the second difference divides by T^2.
    assert np.abs(found.position_rad - smooth[cut]).max() < 1e-9
    assert np.abs(found.velocity_rad_s - speed[cut]).max() < 1e-6
    assert np.abs(found.acceleration_rad_s2 - force[first - 1 : 4000 - last - 1]).max() < 1e-3
    assert np.abs(found.torque_nm - smooth[cut]).max() < 1e-9


def test_dropped_ends_are_long_enough_and_not_needlessly_long():
    # A ramp that breaks: constant acceleration to the end, which odd padding turns round.
    t = np.arange(4000) * STEP
    found = estimate_motion(0.5 * t**2, sample_time_s=STEP, cutoff_hz=CUTOFF, decimation=1)
    assert np.abs(found.acceleration_rad_s2 - 1.0).max() < 5e-3
    # The slowest pole of order 4 has the real part -sin(pi / 8) of the cutoff.
    expected = np.log(1e3) / (np.sin(np.pi / 8) * 2 * np.pi * CUTOFF * STEP)
    assert found.dropped[0] == pytest.approx(expected, rel=0.02)
    assert found.dropped[0] == found.dropped[1]


def test_fourier_is_exact_and_averages_periods():
    n, periods = 1200, 5
    base = 2 * np.pi / (n * STEP)
    t = np.arange(n * periods) * STEP
    rng = np.random.default_rng(8)
    x = v = a = 0.0
    for k in range(1, 20):
        amplitude, phase = rng.normal() / k**2, rng.uniform(0, 6)
        x += amplitude * np.sin(k * base * t + phase)
        v += k * base * amplitude * np.cos(k * base * t + phase)
        a -= (k * base) ** 2 * amplitude * np.sin(k * base * t + phase)
    found = estimate_motion(
        x, v, sample_time_s=STEP, cutoff_hz=CUTOFF, method="fourier", period_samples=n
    )
    keep = np.arange(0, n, found.decimation)
    assert found.decimation > 1
    # Sums of sinusoids: rounding only, times omega^2.
    assert np.abs(found.position_rad[:, 0] - x[keep]).max() < 1e-12
    assert np.abs(found.velocity_rad_s[:, 0] - v[keep]).max() < 1e-10
    assert np.abs(found.acceleration_rad_s2[:, 0] - a[keep]).max() < 1e-8
    assert np.abs(found.torque_nm[:, 0] - v[keep]).max() < 1e-10
    assert found.n_periods == periods and found.dropped == (0, 0)
    assert found.periodicity < 1e-12
    noisy = x + rng.normal(0, 1e-3, x.shape)
    again = estimate_motion(
        noisy, sample_time_s=STEP, cutoff_hz=CUTOFF, method="fourier", period_samples=n
    )
    spread = np.std(noisy.reshape(periods, n) - noisy.reshape(periods, n).mean(0))
    assert again.periodicity == pytest.approx(spread / np.std(x[:n]), rel=0.02)


def test_both_methods_agree_on_a_periodic_motion():
    n = 3000
    knots = np.array([0.0, 1.0, -0.5, 0.8, 0.0])
    spline = CubicSpline(np.arange(5) * n * STEP / 4, knots, bc_type="periodic")
    x = np.tile(spline(np.arange(n) * STEP), 3)
    ours = estimate_motion(x, sample_time_s=STEP, cutoff_hz=CUTOFF, decimation=1)
    exact = estimate_motion(
        x, sample_time_s=STEP, cutoff_hz=8.0, method="fourier", period_samples=n, decimation=1
    )
    at = np.round(ours.time_s / STEP).astype(int) % n
    # A spline's lines fall like 1/k^4: what lies between 8 and 20 Hz is small.
    difference = np.abs(ours.velocity_rad_s - exact.velocity_rad_s[at]).max()
    assert difference < 0.01 * np.abs(exact.velocity_rad_s).max()


def test_noise_goes_down_as_the_band_says():
    rng = np.random.default_rng(1)
    noise = rng.normal(0, 1.0, (200_000, 1))
    found = estimate_motion(noise, sample_time_s=STEP, cutoff_hz=CUTOFF, decimation=1)
    # White noise keeps the integral of the squared gain over Nyquist.
    f = np.linspace(0, 499, 50_000)
    share = np.mean(amplitude_gain(f, sample_time_s=STEP, cutoff_hz=CUTOFF) ** 2)
    # 200 s of 20 Hz are 8000 independent values: 1.6 % twice.
    assert found.position_rad.var() == pytest.approx(share, rel=0.04)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"position_rad": np.full((500, 2), np.nan)}, "position_rad: expected finite"),
        ({"position_rad": np.zeros((5, 2, 2))}, "position_rad: expected shape"),
        ({"position_rad": []}, "position_rad: expected shape"),
        ({"position_rad": np.zeros((500, 2)) + 1j}, "position_rad: expected real"),
        ({"position_rad": [["a", "b"]]}, "position_rad: expected real"),
        ({"position_rad": np.zeros((60, 2))}, "position_rad: expected more than"),
        ({"torque_nm": np.zeros((500, 3))}, r"torque_nm: expected shape \(500, 2\)"),
        ({"torque_nm": np.full((500, 2), np.inf)}, "torque_nm: expected finite"),
        ({"sample_time_s": -1.0}, "sample_time_s: expected a positive"),
        ({"sample_time_s": np.nan}, "sample_time_s: expected a positive"),
        ({"cutoff_hz": 500.0}, "cutoff_hz: expected between 0 and the Nyquist"),
        ({"cutoff_hz": np.nan}, "cutoff_hz: expected"),
        ({"order": 2.5}, "order: expected a positive integer"),
        ({"order": 0}, "order: expected a positive integer"),
        ({"decimation": -2}, "decimation: expected a positive integer"),
        ({"decimation": True}, "decimation: expected a positive integer"),
        ({"amplitude_error": 0.7}, "amplitude_error: expected between"),
        ({"period_samples": 100}, "period_samples: expected none"),
        ({"method": "spline"}, "method: expected"),
        ({"method": "fourier", "period_samples": 300}, "period_samples: expected a divisor"),
        ({"method": "fourier", "period_samples": 1.5}, "period_samples: expected a positive"),
        ({"method": "fourier", "cutoff_hz": 1.0}, "cutoff_hz: expected at least the first"),
        ({"method": "fourier", "decimation": 25}, "decimation: expected a divisor"),
        (
            {"method": "fourier", "position_rad": np.linspace(0, 1, 1000)[:500].reshape(500, 1)},
            "axis 1 jumps",
        ),
    ],
)
def test_misuse_is_named(change, message):
    given = {
        "position_rad": np.zeros((500, 2)),
        "sample_time_s": STEP,
        "cutoff_hz": CUTOFF,
    } | change
    with pytest.raises(InputError, match=message):
        estimate_motion(**given)
