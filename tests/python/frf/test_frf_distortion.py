"""Robust and fast methods: noise and nonlinear distortion told apart."""

import numpy as np
import pytest
from scipy import stats

from axisight.errors import InputError
from axisight.frf import Flag, fast_method, robust_method
from axisight.records import PeriodicRecords

N = 512
SAMPLE_TIME = 1e-3


def multisine(lines, rng, count=1):
    """Random-phase multisines of RMS one, (count, sample)."""
    phase = rng.uniform(0, 2 * np.pi, size=(count, len(lines), 1))
    angle = 2 * np.pi * lines[:, None] * np.arange(N) / N
    return np.sqrt(2 / len(lines)) * np.cos(angle + phase).sum(axis=1)


def odd_random_lines(rng, highest=200):
    """Odd lines, one of four consecutive ones left free; with all free lines to detect at."""
    odd = np.arange(1, highest, 2).reshape(-1, 4)
    free = odd[np.arange(len(odd)), rng.integers(4, size=len(odd))]
    lines = np.setdiff1d(odd, free)
    return lines, np.setdiff1d(np.arange(1, highest), lines)


def records(u, y, lines, periods, rng, noise=0.0, reference=None, detection=()):
    """Repeat (experiment, sample, channel) over periods and add noise to the output."""

    def repeated(a):
        return np.repeat(a[:, None], periods, axis=1)

    y = repeated(y)
    y = y + noise * rng.normal(size=y.shape)
    reference = None if reference is None else repeated(reference)
    return PeriodicRecords(
        SAMPLE_TIME,
        repeated(u),
        y,
        lines,
        reference=reference,
        detection_lines=np.asarray(detection, dtype=np.int64),
    )


def filtered(u, pole=0.8):
    """Steady-state response of a first-order lag, by DFT; the same for any axis order."""
    gain = 1 / (1 - pole * np.exp(-2j * np.pi * np.arange(N // 2 + 1) / N))
    return np.fft.irfft(gain * np.fft.rfft(u, axis=-1), n=N, axis=-1), gain


def test_levels_of_a_polynomial_in_closed_form():
    """A cos: a u^2 gives a A^2 / 2 at twice the line, b u^3 gives b A^3 / 4 at three times."""
    a, b, k = 0.3, 0.2, 7
    u = 1.5 * np.cos(2 * np.pi * k * np.arange(N) / N)[None, :, None]
    y = 2 * u + a * u**2 + b * u**3
    rng = np.random.default_rng(0)
    levels = fast_method(records(u, y, [k], 3, rng, detection=[14, 15, 21])).distortion
    assert list(levels.kind.values) == ["even", "odd", "odd"]
    expected = [a * 1.5**2 / 2, 0.0, b * 1.5**3 / 4]
    assert np.allclose(levels.distortion[:, 0, 0], expected, atol=1e-14)
    assert np.allclose(levels.noise_variance, 0.0, atol=1e-28)
    assert np.allclose(levels.frequency_hz, np.array([14, 15, 21]) / (N * SAMPLE_TIME))


def test_levels_of_a_static_nonlinearity_behind_dynamics():
    rng = np.random.default_rng(1)
    lines, detection = odd_random_lines(rng)
    u = multisine(lines, rng)
    x, _ = filtered(u)
    even, odd = 0.02 * x**2, 0.01 * x**3
    y = (x + even + odd)[..., None]
    levels = fast_method(records(u[..., None], y, lines, 4, rng, 1e-3, detection=detection))
    levels = levels.distortion
    expected = 2 / N * np.fft.rfft((even + odd)[0])[levels.line.values]
    assert np.median(np.abs(expected)) > 20 * 1e-3 / np.sqrt(N)
    z = np.abs(levels.distortion.values[:, 0, 0] - expected) ** 2
    # Only noise is left: F with 2 and 6 degrees of freedom, here of some 120 lines.
    ratio = z / levels.noise_variance.values[:, 0, 0]
    assert ratio.max() < stats.f.isf(1e-6, 2, 6)
    assert np.median(ratio) == pytest.approx(stats.f.median(2, 6), rel=0.4)


def test_noise_alone_makes_no_distortion():
    rng = np.random.default_rng(2)
    lines, detection = odd_random_lines(rng)
    u = multisine(lines, rng)
    y, gain = filtered(u)
    ratios, inside = [], []
    for _ in range(60):
        run = records(u[..., None], y[..., None], lines, 6, rng, 0.1, detection=detection)
        response, levels = fast_method(run)
        ratios.append(np.abs(levels.distortion) ** 2 / levels.noise_variance)
        noise = response.noise_variance.values[:, 0, 0]
        error = np.abs(response.response.values[:, 0, 0] - gain[lines]) ** 2
        inside.append(error < stats.f.isf(0.05, 2, 10) * noise)
        # What the detection lines add is the positive part of a mean around zero.
        extra = (response.variance / response.noise_variance).values - 1
        assert np.median(extra) < 0.6
    ratios = np.ravel(ratios)
    assert np.mean(ratios > stats.f.isf(0.05, 2, 10)) == pytest.approx(0.05, abs=0.01)
    assert np.mean(ratios) == pytest.approx(stats.f.mean(2, 10), rel=0.05)
    assert 0.93 < np.mean(inside) < 0.97


def closed_loop(r, cubic=0.0, square=0.0, feedback=0.5):
    """Steady state of u = r - k y, y = x + square x^2 + cubic x^3, x = lag of u delayed."""
    u = r.copy()
    delay = np.exp(-2j * np.pi * np.arange(N // 2 + 1) / N)
    gain = 0.3 * delay * filtered(r)[1]
    for _ in range(300):  # contraction: the loop gain stays below one
        x = np.fft.irfft(gain * np.fft.rfft(u, axis=-1), n=N, axis=-1)
        y = x + square * x**2 + cubic * x**3
        u = r - feedback * y
    return u, y, x, gain


def test_distortion_of_the_input_is_corrected():
    rng = np.random.default_rng(3)
    lines, detection = odd_random_lines(rng)
    r = multisine(lines, rng)
    u, y, x, _ = closed_loop(r, square=0.02, cubic=0.004)
    levels = fast_method(
        records(u[..., None], y[..., None], lines, 2, rng, detection=detection)
    ).distortion
    # x holds even harmonics by the feedback, so that x^2 has a share at odd lines.
    term = 2 / N * np.fft.rfft(0.02 * x[0] ** 2 + 0.004 * x[0] ** 3)
    for kind in ("even", "odd"):
        here = levels.sel(frequency_hz=levels.frequency_hz[levels.kind == kind])
        expected = term[here.line.values]
        scale = np.linalg.norm(expected)
        corrected = np.linalg.norm(here.distortion.values[:, 0, 0] - expected) / scale
        raw = np.linalg.norm(here.uncorrected.values[:, 0, 0] - expected) / scale
        # G is interpolated and holds a percent of distortion itself: so much of G U_d.
        assert corrected < 0.01
        assert raw > 0.2


def test_fast_method_with_several_inputs():
    """Two inputs, orthogonal experiments, distortion in one output of one experiment."""
    rng = np.random.default_rng(4)
    lines, detection = odd_random_lines(rng)
    s = multisine(lines, rng)[0]
    u = np.array([[s, s], [s, -s]]).transpose(0, 2, 1)
    gain = np.array([[1.0, 0.5], [-0.3, 2.0]])
    y = u @ gain.T
    y[1, :, 0] += 0.05 * s**2
    response, levels = fast_method(records(u, y, lines, 2, rng, detection=detection))
    assert np.allclose(response.response, gain, atol=1e-12)
    expected = 2 / N * np.fft.rfft(0.05 * s**2)[detection]
    assert np.allclose(levels.distortion[:, 0, 1], expected, atol=1e-12)
    for output, experiment in [(0, 0), (1, 0), (1, 1)]:
        assert np.abs(levels.distortion[:, output, experiment]).max() < 1e-12


def test_fast_variance_is_that_of_the_distortion():
    """Scatter of G over realizations against the variance told by single ones."""
    rng = np.random.default_rng(5)
    lines, detection = odd_random_lines(rng)
    estimates, variances = [], []
    for _ in range(150):
        u = multisine(lines, rng)
        x, _ = filtered(u)
        y = x + 0.02 * x**2 + 0.01 * x**3
        run = records(u[..., None], y[..., None], lines, 3, rng, 0.01, detection=detection)
        got = fast_method(run).response
        estimates.append(got.response.values[:, 0, 0])
        variances.append(got.variance.values[:, 0, 0])
    ratio = np.var(estimates, axis=0, ddof=1) / np.mean(variances, axis=0)
    # Distortion is as large at detection lines as between them, only about: no exact claim.
    assert 0.7 < np.median(ratio) < 1.4


def realizations(count, rng, lines, cubic, noise, periods=3):
    u = multisine(lines, rng, count)
    x, gain = filtered(u)
    y = x + cubic * x**3
    return records(u[..., None], y[..., None], lines, periods, rng, noise), gain


def test_robust_method_separates_noise_from_distortion():
    rng = np.random.default_rng(6)
    lines = np.arange(1, 120, 2)
    # Brute force: scatter of noise-free responses over many realizations.
    free, _ = realizations(600, rng, lines, 0.01, 0.0, periods=2)
    exact = robust_method(free)
    assert np.allclose(exact.noise_variance, 0.0, atol=1e-25)
    spectra = [np.fft.rfft(a[:, 0, :, 0])[:, lines] for a in (free.input, free.output)]
    each = spectra[1] / spectra[0]
    assert np.allclose(exact.response[:, 0, 0], each.mean(axis=0))
    brute = np.var(each, axis=0, ddof=1)
    assert np.allclose(exact.distortion_variance[:, 0, 0], brute)
    # And from noisy records of a few.
    noise = 0.3
    ratios, noises = [], []
    for _ in range(40):
        got = robust_method(realizations(8, rng, lines, 0.01, noise)[0])
        ratios.append(got.distortion_variance.values[:, 0, 0] / brute)
        noises.append(got.noise_variance.values[:, 0, 0])
    # Noise of power N sigma^2 on |U|^2 = N^2 / (2 n), 3 periods, 8 realizations.
    expected = N * noise**2 / (N**2 / 2 / len(lines)) / 3 / 8
    assert np.mean(noises) == pytest.approx(expected, rel=0.03)
    # 2,400 estimates of 7 degrees of freedom, correlated over lines.
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.1)


def test_robust_method_finds_no_distortion_in_noise_and_covers():
    rng = np.random.default_rng(7)
    lines = np.arange(1, 120, 2)
    ratios, inside = [], []
    for _ in range(100):
        run, gain = realizations(6, rng, lines, 0.0, 0.2)
        got = robust_method(run)
        variance = got.variance.values[:, 0, 0]
        ratios.append(variance / got.noise_variance.values[:, 0, 0])
        error = np.abs(got.response.values[:, 0, 0] - gain[lines]) ** 2
        inside.append(error < stats.f.isf(0.05, 2, 2 * 5) * variance)
    # Scatter over realizations and over periods, 10 and 24 real degrees of freedom.
    ratios = np.ravel(ratios)
    assert np.mean(ratios) == pytest.approx(stats.f.mean(10, 24), rel=0.05)
    assert np.mean(ratios > stats.f.isf(0.05, 10, 24)) == pytest.approx(0.05, abs=0.01)
    assert 0.93 < np.mean(inside) < 0.97


def test_robust_method_in_closed_loop_uses_the_reference():
    """Noise at the input, a part of the loop: unbiased with the reference, not without."""
    rng = np.random.default_rng(8)
    lines = np.arange(1, 120, 2)
    r = multisine(lines, rng, 200)
    u, y, _, gain = closed_loop(r)
    periods = 2
    noise = 4.0 * rng.normal(size=(200, periods, N))
    # Output noise n enters the input as -k n / (1 + k G), the output as n / (1 + k G).
    sensitivity = 1 / (1 + 0.5 * gain)
    n_y = np.fft.irfft(sensitivity * np.fft.rfft(noise, axis=-1), n=N, axis=-1)
    u = (u[:, None] - 0.5 * n_y)[..., None]
    y = (y[:, None] + n_y)[..., None]
    reference = np.repeat(r[:, None], periods, axis=1)[..., None]
    truth = gain[lines]
    plain = robust_method(PeriodicRecords(SAMPLE_TIME, u, y, lines))
    joint = robust_method(PeriodicRecords(SAMPLE_TIME, u, y, lines, reference=reference))
    variance = joint.variance.values[:, 0, 0]
    with_reference, without = (
        np.mean(np.abs(got.response.values[:, 0, 0] - truth) ** 2 / variance)
        for got in (joint, plain)
    )
    # 60 lines of 2 real degrees of freedom: standard deviation 0.13.
    assert with_reference == pytest.approx(1.0, abs=0.4)
    assert without > 5


def test_robust_method_with_several_inputs_in_any_order():
    rng = np.random.default_rng(9)
    lines = np.arange(3, 100, 2)
    s = multisine(lines, rng, 6).reshape(3, 2, N)
    u = np.concatenate([[[a, b], [b, -a]] for a, b in s]).transpose(0, 2, 1)
    gain = np.array([[1.0, 0.5], [-0.3, 2.0], [0.2, 0.1]])
    run = records(u, u @ gain.T, lines, 3, rng, 0.1)
    got = robust_method(run)
    assert got.response.shape == (len(lines), 3, 2)
    error = np.abs(got.response.values - gain) ** 2
    assert np.median(error / got.variance.values) == pytest.approx(stats.f.median(2, 4), rel=0.3)
    order = [4, 5, 0, 1, 2, 3]
    other = robust_method(PeriodicRecords(SAMPLE_TIME, run.input[order], run.output[order], lines))
    assert np.allclose(got.response, other.response) and np.allclose(got.variance, other.variance)


def test_unusable_lines_are_flagged():
    rng = np.random.default_rng(10)
    lines = np.arange(3, 60, 2)
    s = multisine(lines, rng, 4).reshape(2, 2, N)
    u = np.concatenate([[[a, b], [b, -a]] for a, b in s]).transpose(0, 2, 1)
    wanted = np.append(lines, 80)  # nothing there
    got = robust_method(records(u, u, wanted, 2, rng))
    assert got.flag.values[-1] == Flag.NO_EXCITATION and np.all(got.flag[:-1] == Flag.GOOD)
    assert np.all(np.isnan(got.response[-1])) and np.all(np.isfinite(got.response[:-1]))
    same = u[..., [0, 0]]
    dependent = robust_method(records(same, u, lines, 2, rng))
    assert np.all(dependent.flag == Flag.RANK_DEFICIENT) and np.all(np.isnan(dependent.variance))
    fast = fast_method(records(same[:2], u[:2], lines, 2, rng))
    assert np.all(fast.response.flag == Flag.RANK_DEFICIENT)
    assert np.all(np.isnan(fast.response.response)) and np.all(np.isnan(fast.distortion.distortion))


def test_misuse_is_named():
    rng = np.random.default_rng(11)
    lines = np.arange(3, 60, 2)
    u = multisine(lines, rng, 4)[..., None]
    two = np.concatenate([u, u**2], axis=2)
    cases = [
        (lambda: robust_method(records(u[:1], u[:1], lines, 2, rng)), "at least 2 realizations"),
        (lambda: robust_method(records(two[:3], u[:3], lines, 2, rng)), "got 3 experiments"),
        (lambda: robust_method(records(u, u, lines, 1, rng)), "2 periods"),
        (lambda: fast_method(records(u, u, lines, 2, rng)), "one realization"),
        (lambda: fast_method(records(u[:1], u[:1], lines, 1, rng)), "2 periods"),
        (
            lambda: fast_method(records(u[:1], u[:1], lines, 2, rng, detection=[4, 5])),
            "without excitation, got 5",
        ),
        (lambda: fast_method(records(u[:1], u[:1], [3, 4, 5], 2, rng)), "got none"),
    ]
    for call, words in cases:
        with pytest.raises(InputError, match=words):
            call()
