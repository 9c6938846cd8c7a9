"""Local polynomial and rational methods."""

import control
import numpy as np
import pytest

from axisight.errors import InputError
from axisight.frf import Flag, local_polynomial, local_rational
from axisight.records import ArbitraryRecords, PeriodicRecords
from local_models_data import System, band, plain_local_model

SAMPLE_TIME = 5e-4


def arbitrary(u, y):
    return ArbitraryRecords(SAMPLE_TIME, u, y)


def periodic(u, y, n_periods, lines):
    def cut(a):
        return a.reshape(a.shape[0], n_periods, -1, a.shape[2])

    return PeriodicRecords(SAMPLE_TIME, cut(u), cut(y), lines)


@pytest.mark.parametrize("experiments, inputs", [(1, 1), (1, 2), (2, 3)])
@pytest.mark.parametrize("denominator_order", [0, 2])
def test_same_as_plain_least_squares(experiments, inputs, denominator_order):
    rng = np.random.default_rng(1)
    n = 20_001  # odd length; windows short enough for tan(pi r / N) to be r
    u = rng.normal(size=(experiments, n, inputs))
    y = System(1, inputs).run(u, rng) + 0.1 * rng.normal(size=(experiments, n, 1))
    lines = np.array([1, 3, 40, 2546, 7000, (n - 1) // 2])  # both ends, resonance, flanks
    orders = {"order": 2, "denominator_order": denominator_order, "half_width": 20}
    got = local_rational(arbitrary(u, y), lines=lines, **orders)
    for at, line in enumerate(lines):
        response, variance = plain_local_model(u, y, line, **orders)
        # Row weights of tan against r: (pi 40 / N)^2 = 4e-5 of the residuals' effect.
        error = np.abs(got.response.values[at, 0] - response)
        assert np.all(error < 1e-4 * np.sqrt(variance))
        if not denominator_order:
            assert got.variance.values[at, 0] == pytest.approx(variance, rel=1e-4)
    if not denominator_order:
        same = local_polynomial(arbitrary(u, y), lines=lines, order=2, half_width=20)
        assert np.array_equal(same.response, got.response)
    assert np.all(got.flag == Flag.GOOD)


def test_rational_method_is_exact_without_noise():
    rng = np.random.default_rng(2)
    for experiments, order in [(1, 2), (2, 2), (1, 3)]:  # 3: one pole too many
        system = System(3, 3)
        u = rng.normal(size=(experiments, 400, 3))
        y = system.run(u, rng, transient=10.0)
        got = local_rational(arbitrary(u, y), order=order, half_width=25)
        truth = system.response(np.arange(1, 200), 400)
        # Rounding, amplified by the condition of denominators over a short window.
        assert np.abs(got.response.values - truth).max() < 1e-12 * np.abs(truth).max()


def test_sign_scale_and_frequency_against_python_control():
    system = System(1, 1)
    rng = np.random.default_rng(3)
    u = rng.normal(size=(1, 2000, 1))
    got = local_rational(arbitrary(u, system.run(u, rng)))
    # lfilter counts from z^0, control from the highest power: equal orders, same numbers.
    plant = control.tf(system.numerators[0, 0], system.denominator, SAMPLE_TIME)
    truth = plant(np.exp(2j * np.pi * got.frequency_hz.values * SAMPLE_TIME))
    assert np.abs(got.response.values[:, 0, 0] - truth).max() < 1e-12 * np.abs(truth).max()
    assert got.frequency_hz.values[0] == pytest.approx(1 / (2000 * SAMPLE_TIME))


def test_polynomial_method_removes_a_transient_at_the_expected_order():
    """ETFE's leakage falls as N^-1/2; cubes of the window's width, N^-3, for order 2."""
    errors = []
    lengths = np.array([2000, 4000, 8000, 16000])
    for n in lengths:
        rng = np.random.default_rng(4)
        system = System(1, 1)
        u = rng.normal(size=(40, n, 1))
        y = system.run(u, rng, transient=5.0)
        lines = n // 20 + np.arange(0, n // 10, n // 1000)
        truth = system.response(lines, n)[:, 0, 0]
        etfe = np.fft.rfft(y, axis=1)[:, lines, 0] / np.fft.rfft(u, axis=1)[:, lines, 0]
        local = [
            local_polynomial(arbitrary(u[e], y[e]), half_width=10, lines=lines) for e in range(40)
        ]
        local = np.array([ds.response.values[:, 0, 0] for ds in local])
        # Medians: the ETFE of a random input has no finite variance.
        errors.append([np.median(np.abs(g - truth)) for g in (etfe, local)])
    slope = np.polyfit(np.log(lengths), np.log(errors), 1)[0]
    assert slope[0] == pytest.approx(-0.5, abs=0.1)
    assert slope[1] == pytest.approx(-3.0, abs=0.25)
    assert errors[-1][1] < 1e-5 * errors[-1][0]


def test_periodic_transient_removed_and_nothing_smoothed():
    """Noise-free periods: error falls with the width of the window; MFRF keeps its own."""
    rng = np.random.default_rng(5)
    n, periods, system = 1000, 4, System(2, 2)
    u = np.tile(rng.normal(size=(2, n, 2)), (1, periods, 1))
    y = system.run(u, rng, transient=20.0)
    lines = np.arange(20, 400, 7)
    records = periodic(u, y, periods, lines)
    truth = system.response(lines, n)
    spectra = [np.fft.rfft(a, axis=1)[:, lines * periods].transpose(1, 2, 0) for a in (u, y)]
    plain = np.abs(spectra[1] @ np.linalg.inv(spectra[0]) - truth)
    error = [np.abs(local_polynomial(records, order=r).response - truth) for r in (0, 2, 4)]
    assert error[0].max() > 10 * error[1].max() > 100 * error[2].max()
    assert np.median(error[1]) < 1e-4 * np.median(plain)
    exact = local_rational(records)
    assert np.abs(exact.response.values - truth).max() < 1e-12 * np.abs(truth).max()


def coverage(estimate, truth, records, runs):
    """Share inside the exact 95 % band, and squared error over variance, median of elements."""
    inside, squared, variance = [], [], []
    for run in range(runs):
        got = estimate(records(np.random.default_rng([6, run])))
        error = np.abs(got.response.values - truth) ** 2
        squared.append(error)
        variance.append(got.variance.values)
        inside.append(error < band(got.variance.values, got.attrs["degrees_of_freedom"]))
    ratio = np.mean(squared, axis=0) / np.mean(variance, axis=0)
    return np.mean(inside), np.median(ratio)


@pytest.mark.parametrize("estimate", [local_polynomial, local_rational])
def test_bands_of_arbitrary_records_cover(estimate):
    n, system = 2048, System(2, 2)
    lines = np.arange(20, 1000, 100)
    truth = system.response(lines, n)

    def records(rng):
        u = rng.normal(size=(1, n, 2))
        y = system.run(u, rng)
        return arbitrary(u, y + 0.3 * rng.normal(size=y.shape))

    share, ratio = coverage(lambda r: estimate(r, lines=lines, threads=1), truth, records, 500)
    # 20,000 bands, some 5,000 of them independent: standard deviation 0.3 %.
    assert 0.93 < share < 0.97
    assert ratio == pytest.approx(1.0, abs=0.08)


@pytest.mark.parametrize("experiments", [2, 4])
def test_bands_of_periodic_records_cover(experiments):
    n, periods, system = 512, 3, System(2, 2)
    lines = np.arange(5, 250, 20)
    truth = system.response(lines, n)
    drive = np.random.default_rng(7).normal(size=(experiments, n, 2))

    def records(rng):
        u = np.tile(drive, (1, periods, 1))
        y = system.run(u, rng)
        # Noise at the input as well, a part of it common, as in closed loop.
        common = 0.1 * rng.normal(size=u.shape)
        u_noise = common + 0.1 * rng.normal(size=u.shape)
        return periodic(u + u_noise, y + 2 * common, periods, lines)

    share, ratio = coverage(lambda r: local_polynomial(r, threads=1), truth, records, 500)
    assert 0.93 < share < 0.97
    assert ratio == pytest.approx(1.0, abs=0.08)


def test_threads_and_order_of_experiments_change_nothing():
    rng = np.random.default_rng(8)
    u = rng.normal(size=(3, 600, 2))
    y = System(2, 2).run(u, rng) + 0.1 * rng.normal(size=u.shape)
    for estimate in (local_polynomial, local_rational):
        one = estimate(arbitrary(u, y), threads=1)
        assert one.identical(estimate(arbitrary(u, y), threads=3))
        turned = estimate(arbitrary(u[::-1], y[::-1]))
        assert np.allclose(one.response, turned.response, rtol=1e-10, atol=0)
        assert np.allclose(one.variance, turned.variance, rtol=1e-9, atol=0)


def test_channels_of_very_different_scale_do_not_disturb_each_other():
    rng = np.random.default_rng(9)
    system = System(1, 1)
    u = 1e3 * rng.normal(size=(1, 500, 1))
    y = 1e-9 * system.run(u, rng)
    got = local_rational(arbitrary(u, y)).response.values
    truth = 1e-9 * system.response(np.arange(1, 250), 500)
    assert np.abs(got - truth).max() < 1e-12 * np.abs(truth).max()


@pytest.mark.parametrize("estimate", [local_polynomial, local_rational])
def test_lines_that_cannot_be_estimated_are_flagged(estimate):
    rng = np.random.default_rng(10)
    u = rng.normal(size=(1, 400, 2))
    y = rng.normal(size=(1, 400, 1))
    for second, flag in [(0.0, Flag.NO_EXCITATION), (3 * u[..., 0], Flag.RANK_DEFICIENT)]:
        u[..., 1] = second
        got = estimate(arbitrary(u, y))
        assert np.all(got.flag == flag)
        assert np.all(np.isnan(got.response)) and np.all(np.isnan(got.variance))
    u[..., 1] = 3 * u[..., 0] + 1e-4 * rng.normal(size=(1, 400))
    got = estimate(arbitrary(u, y))
    assert np.all(got.flag == Flag.ILL_CONDITIONED) and np.all(np.isfinite(got.response))
    # An impulse excites all lines alike: no polynomial tells it from a transient.
    impulse = np.zeros((1, 400, 1))
    impulse[0, 0] = 1.0
    assert np.all(estimate(arbitrary(impulse, y)).flag == Flag.RANK_DEFICIENT)
    still = estimate(arbitrary(np.zeros((1, 400, 1)), y))
    assert np.all(still.flag == Flag.NO_EXCITATION)


def test_periodic_lines_are_flagged():
    rng = np.random.default_rng(11)
    u = np.tile(rng.normal(size=(2, 200, 2)), (1, 3, 1))
    u[1] = 2 * u[0]
    y = rng.normal(size=(2, 600, 1))
    assert np.all(local_polynomial(periodic(u, y, 3, [9, 10])).flag == Flag.RANK_DEFICIENT)
    u[..., 1] = 0.0
    assert np.all(local_polynomial(periodic(u, y, 3, [9, 10])).flag == Flag.NO_EXCITATION)


def test_single_period_is_an_arbitrary_record():
    rng = np.random.default_rng(12)
    u = rng.normal(size=(1, 600, 1))
    y = System(1, 1).run(u, rng)
    lines = np.arange(1, 300)
    one = local_polynomial(periodic(u, y, 1, lines), half_width=9)
    other = local_polynomial(arbitrary(u, y), half_width=9)
    assert np.array_equal(one.response, other.response)


def test_misuse_is_named():
    rng = np.random.default_rng(13)
    u, y = rng.normal(size=(1, 100, 1)), rng.normal(size=(1, 100, 2))
    good = arbitrary(u, y)
    two = periodic(np.tile(u, (1, 2, 1)), np.tile(y, (1, 2, 1)), 2, [3, 4, 5])
    cases = [
        (lambda: local_polynomial(good, half_width=2), "half_width: expected more than 6 eq"),
        (lambda: local_rational(good, half_width=25), "half_width: expected a window"),
        (lambda: local_polynomial(good, half_width=10**20), "half_width"),
        (lambda: local_rational(good, half_width=2**62), "half_width"),
        (lambda: local_rational(good, order=-1), "order"),
        (lambda: local_rational(good, order=9), "order: expected a whole number 0 to 8, got 9"),
        (lambda: local_rational(good, denominator_order=9), "denominator_order"),
        (lambda: local_rational(good, lines=[50]), "lines: expected lines from 1 to below 50"),
        (lambda: local_rational(good, lines=[4, 3]), "lines: expected ascending"),
        (lambda: local_rational(good, lines=[]), "lines"),
        (lambda: local_polynomial(two, lines=[7]), "lines: expected excited"),
        (lambda: local_polynomial(two, half_width=26), "half_width"),
        (lambda: local_polynomial(two, half_width=1), "half_width"),
        (lambda: local_rational(two), "lines: expected at least"),
        (lambda: local_polynomial(u), "records"),
        (lambda: arbitrary(u, y[:, :99]), "output: expected"),
        (lambda: arbitrary(u[0, :, 0], y), "input: expected axes"),
        (lambda: ArbitraryRecords(0.0, u, y), "sample_time_s"),
        (lambda: arbitrary(np.where(u == u[0, 7, 0], np.nan, u), y), "experiment 1, sample 8"),
    ]
    for call, words in cases:
        with pytest.raises(InputError, match=words):
            call()
    wide = arbitrary(rng.normal(size=(1, 100, 3)), y)
    three = periodic(np.tile(wide.input, (1, 2, 1)), np.tile(y, (1, 2, 1)), 2, [3, 4])
    with pytest.raises(InputError, match="n_experiments: expected at least 3"):
        local_polynomial(three)


def test_dataset_tells_what_it_is():
    rng = np.random.default_rng(14)
    u = rng.normal(size=(300, 2))
    got = local_rational(ArbitraryRecords(SAMPLE_TIME, u, u[:, :1], output_unit="m"))
    assert got.attrs["estimator"] == "local_rational" and got.attrs["order"] == 2
    assert got.response.units == "m/Nm" and got.response.shape == (149, 1, 2)
    assert got.attrs["degrees_of_freedom"] >= 12
