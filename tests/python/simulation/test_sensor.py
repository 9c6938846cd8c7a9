"""Sensor noise and resolution: distribution, spectrum, and what they are functions of.

Statistics of N seeded samples scatter by a known standard deviation; five of them are
allowed. The seed is fixed, so a test passes or fails the same way every time.
"""

import numpy as np
import pytest
from numpy.typing import NDArray

import axisight
from axisight import InputError, load_robot
from axisight.simulation import sensor_noise, white_noise

Array = NDArray[np.float64]
N = 1 << 17
SIGMAS = 5
ROBOT = load_robot("irb6600_like")
STD = ROBOT.position_noise_std
T = ROBOT.sample_time_s


def correlation(x: Array, lag: int) -> float:
    return float(np.mean(x[lag:] * x[: len(x) - lag]) / np.mean(x**2))


def test_white_noise_is_unit_gaussian() -> None:
    x = white_noise(3, 0, N, 2)
    assert x.shape == (N, 2)
    # Moments of a Gaussian: the standard deviations of their estimates are in the books.
    for column in x.T:
        assert abs(column.mean()) < SIGMAS * np.sqrt(1 / N)
        assert abs(column.var() - 1) < SIGMAS * np.sqrt(2 / N)
        assert abs((column**3).mean()) < SIGMAS * np.sqrt(15 / N)
        assert abs((column**4).mean() - 3) < SIGMAS * np.sqrt(96 / N)


def test_white_noise_is_white() -> None:
    x = white_noise(3, 0, N, 1)[:, 0]
    for lag in range(1, 50):
        assert abs(correlation(x, lag)) < SIGMAS / np.sqrt(N)
    # No whiter than white: the correlations scatter as they should.
    scatter = np.std([correlation(x, lag) for lag in range(1, 200)]) * np.sqrt(N)
    assert 0.7 < scatter < 1.3


def test_sensor_noise_has_the_deviation_of_the_robot() -> None:
    x = sensor_noise(ROBOT, 3, 0, N)
    assert np.array_equal(x, white_noise(3, 0, N, 3) * STD)
    assert np.all(np.abs(x.var(axis=0) / STD**2 - 1) < SIGMAS * np.sqrt(2 / N))


@pytest.mark.parametrize("cutoff_hz", [20.0, 150.0])
def test_coloured_noise_is_of_first_order(cutoff_hz: float) -> None:
    keep = np.exp(-2 * np.pi * cutoff_hz * T)
    x = sensor_noise(ROBOT, 3, 0, N, cutoff_hz)[:, 1]
    # Neighbours repeat each other: (1 + a^2) / (1 - a^2) samples count as one.
    independent = N * (1 - keep**2) / (1 + keep**2)
    assert abs(x.var() / STD**2 - 1) < SIGMAS * np.sqrt(2 / independent)
    for lag in (1, 2, 5, 20):
        assert abs(correlation(x, lag) - keep**lag) < SIGMAS / np.sqrt(independent)
    # Its innovations are the white noise it was made of, and give it away.
    fresh = (x[1:] - keep * x[:-1]) / (STD * np.sqrt(1 - keep**2))
    assert np.allclose(fresh, white_noise(3, 0, N, 3)[1:, 1], rtol=0, atol=1e-10)
    assert abs(correlation(fresh, 1)) < SIGMAS / np.sqrt(N)


@pytest.mark.parametrize("cutoff_hz", [20.0, 150.0])
def test_spectrum_of_coloured_noise(cutoff_hz: float) -> None:
    """Averaged periodogram against std^2 (1 - a^2) / |1 - a e^{-iwT}|^2."""
    segment, keep = 1024, np.exp(-2 * np.pi * cutoff_hz * T)
    x = sensor_noise(ROBOT, 5, 1, N, cutoff_hz)[:, 0].reshape(-1, segment)
    # A window: without one, the steep low end would leak over the high one.
    window = np.hanning(segment)
    lines = np.fft.rfft(x * window)[:, 4:-4]
    power = (np.abs(lines) ** 2).mean(axis=0) / (window**2).sum()
    turn = np.exp(-2j * np.pi * np.arange(segment // 2 + 1)[4:-4] / segment)
    want = STD**2 * (1 - keep**2) / np.abs(1 - keep * turn) ** 2
    # Each line is an average of exponential variables, its bias below a hundredth.
    assert np.abs(power / want - 1).max() < SIGMAS / np.sqrt(len(x)) + 0.01
    assert abs(np.mean(power / want) - 1) < SIGMAS / np.sqrt(N / 3) + 0.01
    corner = np.abs(np.arange(segment // 2 + 1)[4:-4] / segment / T - cutoff_hz).argmin()
    assert power[:3].mean() / power[corner - 2 : corner + 3].mean() == pytest.approx(2, rel=0.4)


@pytest.mark.parametrize("cutoff_hz", [None, 50.0])
def test_noise_is_a_function_of_seed_and_run_only(cutoff_hz: float | None) -> None:
    x = sensor_noise(ROBOT, 3, 7, 500, cutoff_hz)
    assert np.array_equal(x, sensor_noise(ROBOT, 3, 7, 500, cutoff_hz))
    # Neither of the length nor of the other axes.
    assert np.array_equal(x[:200], sensor_noise(ROBOT, 3, 7, 200, cutoff_hz))
    assert np.array_equal(white_noise(3, 7, 500, 3)[:, :1], white_noise(3, 7, 500, 1))
    others = [sensor_noise(ROBOT, *key, 500, cutoff_hz) for key in [(3, 8), (4, 7), (7, 3)]]
    columns = np.hstack([x, *others]) / STD
    between = columns.T @ columns / len(columns) - np.diag((columns**2).mean(axis=0))
    independent = 500 if cutoff_hz is None else 500 * (1 - np.exp(-4 * np.pi * cutoff_hz * T)) / 2
    assert np.abs(between).max() < SIGMAS / np.sqrt(independent)


def test_noise_acts_on_the_measurement_and_through_the_loop() -> None:
    rest = np.zeros((300, 3))
    quiet = axisight.simulate(ROBOT, rest)
    noisy = axisight.simulate(ROBOT, rest, noise_seed=3, run=7)
    noise = sensor_noise(ROBOT, 3, 7, 300)
    assert np.array_equal(noisy["position_disturbance_rad"], noise)
    measured = noisy["motor_position_rad"] + noisy["position_disturbance_rad"]
    assert np.array_equal(noisy["position_rad"], measured)
    # First command: u_ff - ki e_0; the speed starts at zero.
    gains = ROBOT.controller_gains
    first = quiet["torque_cmd_nm"].values[0] - gains["ki"] * noise[0]
    assert np.allclose(noisy["torque_cmd_nm"].values[0], first, rtol=1e-12)
    assert np.abs(noisy["motor_position_rad"] - quiet["motor_position_rad"]).max() > STD / 10
    given = axisight.simulate(ROBOT, rest, noise=noise)
    assert np.array_equal(given["torque_cmd_nm"], noisy["torque_cmd_nm"])


def sweep() -> Array:
    """References that drive every axis through thousands of sensor steps."""
    t = np.arange(4000) * T
    return 6 * np.sin(2 * np.pi * np.array([0.7, 1.1, 0.9]) * t[:, None])


@pytest.mark.parametrize("model", ["nonlinear", "linear"])
@pytest.mark.parametrize("noise_seed", [None, 11])
def test_resolution_rounds_to_its_multiples(model: str, noise_seed: int | None) -> None:
    step = 2e-3
    out = axisight.simulate(
        ROBOT, sweep(), position_resolution_rad=step, noise_seed=noise_seed, model=model
    )
    counts = out["position_rad"].values / step
    # Positions of 100 rad are 5e4 steps, known to 1e-11 of a step.
    assert np.abs(counts - np.round(counts)).max() < 1e-10
    noise = 0 if noise_seed is None else sensor_noise(ROBOT, noise_seed, 0, len(counts))
    error = (out["position_rad"] - out["motor_position_rad"]).values - noise
    assert np.abs(error).max() <= step / 2 * (1 + 1e-9)
    late = np.sort(error[200:].ravel()) / step + 0.5
    # Kolmogorov's distance of so many samples from the uniform distribution, at 1e-6.
    distance = np.abs(late - (np.arange(len(late)) + 0.5) / len(late)).max()
    assert distance < 2.7 / np.sqrt(len(late))
    assert late.var() == pytest.approx(1 / 12, rel=SIGMAS * np.sqrt(0.8 / len(late)))


def test_resolution_that_vanishes_changes_nothing_and_a_coarse_one_matters() -> None:
    exact = axisight.simulate(ROBOT, sweep()[:500])
    none = axisight.simulate(ROBOT, sweep()[:500], position_resolution_rad=0.0)
    assert exact.identical(none)
    torques = []
    for step in (1e-5, 1e-9):
        run = axisight.simulate(ROBOT, sweep()[:500], position_resolution_rad=step)
        torques.append(float(np.abs(run["torque_cmd_nm"] - exact["torque_cmd_nm"]).max()))
    # The difference quotient makes step / T of speed, kp of that torque, and the loop answers.
    kp = ROBOT.controller_gains["kp"].max()
    assert kp * 1e-5 / T / 10 < torques[0] < 10 * kp * 1e-5 / T
    assert 1e3 < torques[0] / torques[1] < 1e5


@pytest.mark.parametrize("cutoff_hz", [0.0, -1.0, float("nan")])
def test_cutoff_must_be_positive(cutoff_hz: float) -> None:
    with pytest.raises(InputError, match="cutoff_hz"):
        sensor_noise(ROBOT, 3, 0, 10, cutoff_hz)
