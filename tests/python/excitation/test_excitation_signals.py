"""Chirp, triangle, square, binary sequences, stepped sine; directions and references."""

import numpy as np
import pytest
from scipy.linalg import hadamard
from scipy.signal import chirp as scipy_chirp

from axisight.errors import InputError
from axisight.excitation import (
    chirp,
    dft_matrix,
    direction_matrix,
    discrete_interval_binary,
    line_set,
    multisine,
    prbs,
    references,
    square,
    stepped_sine,
    triangle,
)

T = 5e-4


@pytest.mark.parametrize("band", [(1.0, 40.0), (40.0, 1.0)])
def test_chirp_is_scipys(band: tuple[float, float]) -> None:
    signal = chirp(5.0, T, band_hz=band, amplitude=12.0, phase_rad=0.4)
    t = np.arange(10_000) * T
    # SciPy's is a cosine; a sine lags it by 90 degrees.
    expected = 12 * scipy_chirp(t, f0=band[0], t1=5.0, f1=band[1], phi=np.degrees(0.4) - 90)
    np.testing.assert_allclose(signal.period, expected, atol=1e-8)
    assert signal.peak == pytest.approx(12.0, rel=1e-3)
    # The thesis: usually 1.45; effective rms, lines of the band only.
    assert signal.crest_factor == pytest.approx(1.45, abs=0.03)


def test_chirp_closes_without_a_jump() -> None:
    signal = chirp(5.0, T, band_hz=(1.0, 40.0))
    # The next sample after the last is the first: a step of at most 2 pi 40 T, as inside.
    assert abs(signal.period[0] - signal.period[-1]) <= 2 * np.pi * 40 * T


def test_triangle() -> None:
    signal = triangle(0.01, T, amplitude=5.0)
    np.testing.assert_allclose(
        signal.period, [0, 1, 2, 3, 4, 5, 4, 3, 2, 1, 0, -1, -2, -3, -4, -5, -4, -3, -2, -1]
    )
    assert signal.crest_factor == pytest.approx(np.sqrt(3), rel=0.02)


def test_square_is_the_filtered_one() -> None:
    signal = square(5.0, T, amplitude=14.0)
    x = np.where(np.arange(10_000) < 5000, 14.0, -14.0)
    k = np.arange(-40, 41)
    weights = (41 - np.abs(k)) / 41**2
    expected = sum(w * np.roll(x, -shift) for shift, w in zip(k, weights, strict=True))
    np.testing.assert_allclose(signal.period, expected, atol=1e-12)


@pytest.mark.parametrize("bits", [5, 10])
def test_prbs_has_the_autocorrelation_of_maximum_length(bits: int) -> None:
    signal = prbs(T, bits=bits, amplitude=3.0)
    n = 2**bits - 1
    assert signal.n_samples == n
    correlation = np.fft.irfft(np.abs(np.fft.rfft(signal.period)) ** 2, n) / n
    np.testing.assert_allclose(correlation[0], 9.0)
    np.testing.assert_allclose(correlation[1:], -9.0 / n, atol=1e-9)
    assert signal.crest_factor == pytest.approx(1.0)
    np.testing.assert_array_equal(
        prbs(T, bits=bits, amplitude=3.0, hold=4).period[::4], signal.period
    )


def test_discrete_interval_binary_puts_its_power_on_the_lines() -> None:
    lines = [1, 2, 4, 8, 16, 32]
    signal = discrete_interval_binary(0.256, T, lines=lines, starts=20, seed=1)
    assert set(np.unique(signal.period)) == {-1.0, 1.0}
    share = signal.settings["power_share"]
    spectrum = np.abs(np.fft.rfft(signal.period)) / signal.n_samples
    assert share == pytest.approx(2 * np.sum(spectrum[lines] ** 2))
    # Random signs would put 6 / 256 of their power there.
    assert share > 0.6
    # Settled: the multisine with the phases found has these signs.
    found = np.fft.rfft(signal.period)[lines]
    settled = np.zeros(257, complex)
    settled[lines] = found / np.abs(found)
    np.testing.assert_array_equal(np.sign(np.fft.irfft(settled, 512)), signal.period)
    held = discrete_interval_binary(0.256, T, lines=lines, hold=2, starts=5)
    np.testing.assert_array_equal(held.period[::2], held.period[1::2])


def test_stepped_sine() -> None:
    steps = stepped_sine(
        0.1, T, frequency_hz=[10.0, 30.0], amplitude=[1.0, 2.0], waiting_periods=2, periods=3
    )
    assert steps.signal.n_samples == 2 * 5 * 200
    # Two periods of 200 samples are waited for in each step of five.
    np.testing.assert_array_equal(steps.first_sample, [400, 1400])
    for line, first, amplitude in zip(steps.lines, steps.first_sample, [1.0, 2.0], strict=True):
        part = steps.signal.period[first : first + steps.n_samples]
        spectrum = 2 * np.abs(np.fft.rfft(part)) / len(part)
        expected = np.zeros(len(spectrum))
        expected[3 * line] = amplitude
        np.testing.assert_allclose(spectrum, expected, atol=1e-12)


def test_directions() -> None:
    np.testing.assert_array_equal(direction_matrix("t1", 4), np.eye(4))
    t2 = direction_matrix("t2", 3)
    np.testing.assert_array_equal(t2, [[1, 1, 1], [1, -1, 1], [1, 1, -1]])
    np.testing.assert_array_equal(direction_matrix("hadamard", 8), hadamard(8))
    w = dft_matrix(5)
    np.testing.assert_allclose(w @ w.conj().T, 5 * np.eye(5), atol=1e-12)


def test_references_are_sums() -> None:
    signal = multisine(5.0, T, band_hz=(1.0, 40.0)).scaled(peak=8.0)
    wave = square(2.5, T, amplitude=9.6)
    made = references(signal, 3, directions="t2", square=wave, dc_level=[0.1, 0.2, 0.3])
    assert made.period.shape == (3, 10_000, 3)
    # Experiment 2 of T2: axes (1, -1, 1).
    expected = signal.period[:, None] * [1, -1, 1] + np.tile(wave.period, 2)[:, None]
    np.testing.assert_allclose(made.period[1], expected + np.array([0.1, 0.2, 0.3]), atol=1e-12)
    assert made.repeated(2).shape == (3, 20_000, 3)
    np.testing.assert_array_equal(made.lines, signal.lines)


@pytest.mark.parametrize("n", [2, 3, 5])
def test_dft_references_are_orthogonal_at_every_line(n: int) -> None:
    signal = multisine(1.0, 1e-3, band_hz=(1.0, 40.0), seed=5).scaled(peak=8.0)
    made = references(signal, n, directions="dft", seed=5)
    u = np.fft.rfft(made.period, axis=1)[:, made.lines, :].transpose(1, 2, 0)
    gram = u @ u.conj().transpose(0, 2, 1)
    power = np.einsum("kii->ki", gram).real
    off = gram - np.einsum("ki,ij->kij", power, np.eye(n))
    assert np.abs(off).max() < 1e-10 * power.max()
    assert np.abs(made.period).max() <= 8.0 * (1 + 1e-5)


def test_dc_level_moves_the_motor_a_quarter_turn_per_period() -> None:
    signal = multisine(5.0, T, band_hz=(1.0, 40.0))
    made = references(signal, 1, dc_level=np.pi / 2 / 5.0)
    assert made.period[0, :, 0].sum() * T == pytest.approx(np.pi / 2)


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (lambda: chirp(5.0, T, band_hz=(1.05, 40.0)), "band_hz: expected two different multiples"),
        (lambda: chirp(5.0, T, band_hz=(1.0, 1000.0)), "Nyquist"),
        (lambda: triangle(0.0105, T), "multiple of four"),
        (lambda: square(0.0105, T), "even"),
        (lambda: square(1.0, T, smoothing_samples=600), "smoothing"),
        (lambda: prbs(T, bits=1), "bits: expected a whole number 2 to 24"),
        (lambda: discrete_interval_binary(0.1, T, lines=[]), "lines: expected at least one"),
        (lambda: discrete_interval_binary(0.1, T, lines=[1], hold=3), "hold: expected a divisor"),
        (lambda: discrete_interval_binary(0.1, T, lines=[1], weight=-1.0), "weight"),
        (lambda: stepped_sine(0.1, T, frequency_hz=[11.0]), "frequency_hz: expected multiples"),
        (lambda: stepped_sine(0.1, T, frequency_hz=[0.0]), "above 0"),
        (lambda: direction_matrix("t2", 4), "three axes"),
        (lambda: direction_matrix("hadamard", 3), "power of two"),
        (lambda: direction_matrix("t9", 3), "directions: expected one of"),
        (lambda: direction_matrix([[1, 1], [2, 2]], 2), "rank 2, one per input, got rank 1"),
        (lambda: direction_matrix([[1, 1]], 2), "shape"),
        (lambda: references(triangle(1.0, T), 2, directions="dft"), "multisine without snow"),
        (lambda: references(triangle(1.0, T), 2, square=square(0.3, T)), "square: expected"),
        (lambda: references(triangle(1.0, T), 2, dc_level=[1, 2, 3]), "dc_level"),
        (lambda: line_set(1.0, T, band_hz=(1.0, 2.0), grid="odd_random", group=1), "group"),
    ],
)
def test_misuse(action: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        action()  # type: ignore[operator]
