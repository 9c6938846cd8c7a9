"""The bias that the documentation of the averages states, in closed form and by simulation."""

import numpy as np
import pytest
import xarray as xr
from scipy.special import exp1

from axisight import frf
from axisight.records import PeriodicRecords
from frf_data import T, loop_records, plant

LINES = 400


def complex_normal(rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    """Circular, of mean square one."""
    return (rng.normal(size=shape) + 1j * rng.normal(size=shape)) / np.sqrt(2)


def realizations(values: np.ndarray) -> xr.Dataset:
    """Responses (realization, line) of one input and output as one Dataset."""
    one = frf.frequency_response(
        np.arange(1.0, values.shape[1] + 1), values[0][:, None, None], estimator="given"
    )
    stack = ("realization", *one["response"].dims)
    return one.assign(response=(stack, values[:, :, None, None], one["response"].attrs))


@pytest.mark.parametrize("count", [10, 40])
def test_logarithmic_mean_stays_too_large_where_the_error_is_as_large_as_g(count):
    """E ln|g + e|^2 = ln g^2 + E_1(g^2 / s^2) for a circular normal error of mean square s^2."""
    g, rng = 0.5, np.random.default_rng(count)
    given = realizations(g + complex_normal(rng, (count, LINES)))
    found = np.abs(frf.logarithmic_mean(given)["response"].values[:, 0, 0])
    expected = np.log(g) + 0.5 * exp1(g**2)
    # ln|.| scatters by 0.64 (pi / sqrt(24)) at most: standard error over 400 lines, five of it.
    tolerance = 5 * 0.64 / np.sqrt(count * LINES)
    assert abs(np.mean(np.log(found)) - expected) < tolerance
    assert expected > np.log(g) + 0.4  # too large by half and more, whatever the number
    # The arithmetic mean has no such bias.
    mean = frf.arithmetic_mean(given)["response"].values.mean()
    assert abs(mean - g) < 5 / np.sqrt(count * LINES)


def test_logarithmic_mean_is_zero_where_one_realization_is():
    values = np.ones((3, 4), complex)
    values[1, 2] = 0
    found = frf.logarithmic_mean(realizations(values))["response"].values[:, 0, 0]
    np.testing.assert_array_equal(found, [1, 1, 0, 1])


def test_arithmetic_mean_is_biased_by_noise_on_u_and_harmonic_mean_by_noise_on_y():
    """E 1 / (1 + n) = 1 - exp(-1 / s^2): zero outside the unit circle, one inside of it."""
    count, power = 50, 0.4
    rng = np.random.default_rng(8)
    noisy = 1 + np.sqrt(power) * complex_normal(rng, (count, LINES))
    shrunk = 1 - np.exp(-1 / power)
    on_input, on_output = realizations(1 / noisy), realizations(noisy)
    found = {
        name: (
            getattr(frf, f"{name}_mean")(on_input)["response"].values.mean(),
            getattr(frf, f"{name}_mean")(on_output)["response"].values.mean(),
        )
        for name in ("arithmetic", "harmonic")
    }
    # 1 / (1 + n) has no variance (a pole inside the noise), so its mean converges slowly: the
    # 20,000 largest are about 140, and one of them moves the mean by 0.7 %.
    assert abs(found["arithmetic"][0] - shrunk) < 0.03
    assert abs(found["arithmetic"][1] - 1) < 5 * np.sqrt(power / (count * LINES))
    # The mean of 50 is 1 + m with m of power 0.008: E 1 / (1 + m) = 1 - exp(-125).
    assert abs(found["harmonic"][0] - 1) < 5 * np.sqrt(power / (count * LINES))
    # Of one line: (1 / shrunk) (1 + d + d^2 ...), d scattering by about a fifth.
    assert 1 / shrunk - 0.05 < found["harmonic"][1].real < 1.15 / shrunk
    assert 1 / shrunk > 1.08


def test_joint_input_output_is_unbiased_in_closed_loop_and_others_are_not():
    """Noise fed back, signal-to-noise ratios of U down to about two, 500 realizations."""
    records = loop_records(500, 2, noise=1.0, seed=5)[0]
    truth = plant(records.frequency_hz)

    def excess(found: xr.Dataset) -> float:
        square = np.abs(found["response"].values - truth) ** 2
        return float(np.mean(square / found["variance"].values))

    # 52 elements at 13 lines, correlated in pairs: one, standard deviation under 0.3.
    assert excess(frf.joint_input_output(records)) < 2.0
    assert excess(frf.h1(records)) > 5
    assert excess(frf.mfrf(records)) > 5


def test_joint_input_output_of_a_nonlinear_system_is_a_quotient_of_two_approximations():
    """u = r + b r^3, y = u^3, r Gaussian: moments E r^2k = (2k - 1)!! s^2k give both."""
    rng, b = np.random.default_rng(9), 0.2
    r = rng.normal(size=(60, 1, 512, 1))
    u = r + b * r**3
    records = PeriodicRecords(T, u, u**3, np.arange(1, 256), reference=r)
    # E y r with y = r^3 + 3 b r^5 + 3 b^2 r^7 + b^3 r^9; E u r = 1 + 3 b.
    joint = (3 + 3 * b * 15 + 3 * b**2 * 105 + b**3 * 945) / (1 + 3 * b)
    # E y u = E u^4, E u^2 = 1 + 6 b + 15 b^2.
    fourth = 3 + 4 * b * 15 + 6 * b**2 * 105 + 4 * b**3 * 945 + b**4 * 10395
    direct = fourth / (1 + 6 * b + 15 * b**2)
    found = frf.joint_input_output(records)["response"].values.mean()
    plain = frf.h1(records)["response"].values.mean()
    # 30,720 samples of heavy tails: some percent.
    assert abs(found / joint - 1) < 0.15
    assert abs(plain / direct - 1) < 0.35
    assert direct > 1.3 * joint and abs(plain) > 1.2 * abs(found)
