"""What only shows with several inputs, unequal channels or directions that are not symmetric."""

import numpy as np
import pytest

from axisight import _core, frf, load_robot
from axisight import excitation as ex
from axisight.frf import errors
from axisight.frf.leakage import _sampled, noise_leakage_power
from axisight.frf.loop import velocity_gains
from axisight.records import ArbitraryRecords, PeriodicRecords
from axisight.records.checks import keep_steady

T = 1e-3
DIRECTIONS = np.array([[1.0, 0.5], [0.2, 2.0]])
"""Not symmetric, rows and columns of different size."""


def test_fast_variance_weighs_experiments_by_the_inverse_of_u():
    """Distortion in one experiment reaches input i through |U^-1[e, i]|^2."""
    n, rng = 256, np.random.default_rng(1)
    lines = np.array([k for k in range(3, 90, 2) if k % 8 != 5])
    phase = rng.uniform(0, 2 * np.pi, len(lines))
    angle = 2 * np.pi * lines[:, None] * np.arange(n) / n + phase[:, None]
    s = np.cos(angle).sum(axis=0)
    u = s[None, :, None] * DIRECTIONS.T[:, None, :]
    y = u.copy()
    y[1, :, 0] += 0.01 * s**3
    twice = [np.repeat(a[:, None], 2, axis=1) for a in (u, y)]
    found = frf.fast_method(PeriodicRecords(T, *twice, lines))
    # Over one line U = S T, so U^-1 = T^-1 / S; output 1 in experiment 2 alone is disturbed.
    inverse = np.abs(np.linalg.inv(DIRECTIONS)) ** 2
    share = found.response["variance"].values[:, 0, :]
    np.testing.assert_allclose(share[:, 0] / share[:, 1], inverse[1, 0] / inverse[1, 1], rtol=1e-9)
    assert abs(inverse[1, 0] / inverse[1, 1] - inverse[0, 1] / inverse[1, 1]) > 0.05
    assert np.abs(found.response["variance"].values[:, 1]).max() < 1e-20


def test_gain_of_directions_sums_over_experiments():
    # T^-1 = [[1, 0], [-1, 1]]: its columns have the powers 2 and 1, its rows 1 and 2.
    np.testing.assert_allclose(errors.directions_gain([[1, 0], [1, 1]]), [2.0, 1.0])


@pytest.mark.parametrize("directions", [DIRECTIONS, np.hstack([DIRECTIONS, [[3, 0], [7, -1]]])])
def test_columns_of_the_directions_are_experiments(directions):
    signal = ex.multisine(0.1, T, lines=[1, 3])
    made = ex.references(signal, 2, directions=directions)
    assert made.period.shape == (directions.shape[1], 100, 2)
    for e in range(directions.shape[1]):
        for i in range(2):
            expected = directions[i, e] * signal.period
            np.testing.assert_allclose(made.period[e, :, i], expected, rtol=0, atol=1e-12)


def test_leakage_of_noise_is_what_a_simulated_loop_shows():
    """``Y - G U`` of 300 runs of the sampled loop without excitation, two ends per record."""
    robot = load_robot("irb6600_like")
    a, b, c = _sampled(robot)
    kp, ki = velocity_gains(robot)
    step, std, n, runs = robot.sample_time_s, robot.position_noise_std, 400, 300
    rng = np.random.default_rng(2)
    x, before = np.zeros((runs, len(a))), np.zeros((runs, len(kp)))
    inputs, outputs = [], []
    warm = 4000  # 2 s, to the steady state of the noise
    for k in range(warm + n):
        y = x @ c.T
        measured = y + std * rng.normal(size=y.shape)
        u = -kp * (measured - before) / step - ki * measured
        if k >= warm:
            inputs.append(u)
            outputs.append(y)
        x, before = x @ a.T + u @ b.T, measured
    lines = np.arange(1, 40)
    frequency = lines / (n * step)
    spectra = [np.fft.rfft(np.array(s), axis=0)[lines] for s in (inputs, outputs)]
    true = robot.zoh_response(frequency).values
    left = spectra[1] - np.einsum("fij,frj->fri", true, spectra[0])
    ratio = np.mean(np.abs(left) ** 2, axis=1) / noise_leakage_power(robot, frequency, n)
    # Each is a mean of 300 squares (6 %); lines and axes share what is left at the ends.
    assert np.abs(ratio - 1).max() < 0.4
    assert abs(ratio.mean() - 1) < 0.15


def test_prediction_divides_leakage_by_the_square_of_the_number_of_periods():
    """A record of P periods has two ends only; the white part averages by P."""
    robot = load_robot("irb6600_like")
    n, lines, periods = 1000, np.array([1, 2, 40]), 5
    signal = ex.multisine(n * robot.sample_time_s, robot.sample_time_s, lines=lines)
    refs = ex.references(signal.scaled(peak=5.0), 3).period[None]
    one, many = (
        frf.predict_errors(robot, refs, lines, n_periods=p)["noise_variance"] for p in (1, periods)
    )
    frequency = lines / signal.period_s
    white = n * robot.position_noise_std**2
    ends = [noise_leakage_power(robot, frequency, p * n) for p in (1, periods)]
    expected = (white / periods + ends[1] / periods**2) / (white + ends[0])
    ratio = (many / one).transpose("frequency_hz", "output", "input").values
    np.testing.assert_allclose(ratio, expected[:, :, None] * np.ones(3), rtol=1e-9)
    # At 2 Hz the ends rule, so this differs from an average of independent periods.
    assert ratio[0].max() < 0.6 / periods


def test_significance_is_for_all_experiments_together():
    """Steady noise, 20 experiments: a period is dropped from one of them in 20 % of the sets."""
    rng = np.random.default_rng(3)
    dropped = 0
    for _ in range(60):
        cut = [
            dict(zip(("input", "output"), rng.normal(size=(2, 4, 64, 1)), strict=True))
            for _ in range(20)
        ]
        dropped += keep_steady(cut, 0, None, 31, 0.2, []) > 0
    # Binomial: 12 expected, standard deviation 3.1; without the division nearly all of them.
    assert dropped < 26


LARGE, SMALL = 1e6, 1e-6


def test_a_large_channel_does_not_drown_a_small_one():
    """Channels share a transform; the small one keeps its own relative accuracy."""
    rng = np.random.default_rng(4)
    n, lines = 360, np.arange(1, 180)
    signal = rng.normal(size=(2, 3, n, 3)) * [LARGE, SMALL, 1.0]
    found = _core.record_spectra(signal, lines.tolist(), remove_drift=False)
    exact = np.fft.rfft(signal, axis=2)[:, :, lines]
    size = np.sqrt(np.mean(np.abs(exact) ** 2, axis=(0, 1, 2)))
    assert (np.abs(found - exact).max(axis=(0, 1, 2)) / size).max() < 1e-12
    # The plain way of two real channels in one complex transform does drown it.
    both = np.fft.fft(signal[0, 0, :, 0] + 1j * signal[0, 0, :, 1])
    second = (both - np.roll(both[::-1], 1).conj())[lines] / 2j
    assert np.abs(second - exact[0, 0, :, 1]).max() / size[1] > 1e-8


@pytest.mark.parametrize("method", [frf.local_polynomial, frf.local_rational])
def test_local_methods_with_a_large_and_a_small_channel(method):
    rng = np.random.default_rng(5)
    u = rng.normal(size=(1, 300, 1))
    y = np.stack([np.roll(u, 1, axis=1), np.roll(u, 2, axis=1)], axis=-1)[:, :, 0]
    y = y + 0.01 * rng.normal(size=y.shape)
    plain = method(ArbitraryRecords(T, u, y))["response"].values
    scale = np.array([SMALL, 1.0])
    given = method(ArbitraryRecords(T, LARGE * u, y * scale))["response"].values
    expected = plain * scale[:, None] / LARGE
    # Rounding through regressors of condition 100 or so.
    error = np.abs(given - expected).max(axis=0) / np.abs(expected).max(axis=0)
    assert error.max() < 1e-11
