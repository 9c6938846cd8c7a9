"""Delays between experiments: found to a fraction of a sample, and taken out."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from axisight.errors import InputError
from axisight.records import PeriodicRecords, estimate_delay, reference_delays, synchronise
from axisight.records.delays import advance
from records_data import late, multisine

N, LINES = 600, np.arange(3, 120)


@given(delay=st.floats(-299, 299), sign=st.sampled_from([-1, 1]), seed=st.integers(0, 50))
def test_a_delay_is_recovered_exactly_without_noise(delay, sign, seed):
    x = multisine(N, LINES, seed)
    found = estimate_delay(2.5 * sign * late(x, delay, LINES), x, LINES)
    assert found.samples == pytest.approx(delay, abs=1e-9)
    assert found.sign == sign


def test_the_standard_error_tells_the_scatter():
    x, delay, level = multisine(N, LINES), 17.37, 0.2
    generator = np.random.default_rng(2)
    runs = [
        estimate_delay(late(x, delay, LINES) + level * generator.standard_normal(N), x, LINES)
        for _ in range(300)
    ]
    values = np.array([r.samples for r in runs])
    stated = np.sqrt(np.mean([r.standard_error**2 for r in runs]))
    # A standard deviation from 300 runs is known to 1 / sqrt(600) = 4 %; three of these.
    assert values.std() == pytest.approx(stated, rel=0.15)
    assert abs(values.mean() - delay) < 4 * stated / np.sqrt(300)
    # The bound of Cramer and Rao: 1 / var = sum_k w_k^2 |X_k|^2 / (noise of a line)
    omega = 2 * np.pi * LINES / N
    bound = 1 / np.sqrt(2 * np.sum(omega**2) * (N / 2) ** 2 / (N * level**2))
    assert stated == pytest.approx(bound, rel=0.1)


def test_odd_lines_take_the_nearer_of_two_delays():
    odd = np.arange(1, 120, 2)
    x = multisine(N, odd)
    found = estimate_delay(late(x, 290, odd), x, odd)
    assert (found.sign, found.samples) == (-1, pytest.approx(-10, abs=1e-9))
    fixed = estimate_delay(late(x, 290, odd), x, odd, free_sign=False)
    assert (fixed.sign, fixed.samples) == (1, pytest.approx(290, abs=1e-9))


def test_what_is_no_copy_is_refused():
    with pytest.raises(InputError, match="fit no delay"):
        estimate_delay(multisine(N, LINES, 1), multisine(N, LINES, 2), LINES)
    with pytest.raises(InputError, match="expected amplitude"):
        estimate_delay(multisine(N, [2]), multisine(N, [1]), np.array([5]))
    with pytest.raises(InputError, match="expected shape"):
        estimate_delay(np.zeros(10), np.zeros(12), np.array([1]))


@pytest.mark.parametrize("samples", [0.0, 3.0, -0.4, 11.71, -250.5])
def test_advancing_undoes_a_delay(samples):
    x = multisine(N, LINES)
    delayed = np.tile(late(x, samples, LINES), 3).reshape(3, N, 1)
    np.testing.assert_allclose(advance(delayed, samples)[:, :, 0], np.tile(x, (3, 1)), atol=1e-11)


def unsynchronised(delays, sign_matrix):
    """Reference r = T r_0, u = 2 r late by 3 samples, y = -0.5 u; each experiment late."""
    base = multisine(N, LINES)
    n = len(delays)
    r = np.zeros((n, 4, N, n))
    for e, delay in enumerate(delays):
        for c in range(n):
            r[e, :, :, c] = sign_matrix[c, e] * late(base, delay, LINES)
    u = np.roll(2 * r, 3, axis=2)
    return base, PeriodicRecords(1e-3, u, -0.5 * u, LINES, reference=r)


def test_experiments_are_aligned_with_the_known_excitation():
    matrix = np.array([[1, 1, 1], [1, -1, 1], [1, 1, -1]])
    base, records = unsynchronised([0.0, 12.345, -7.5], matrix)
    aligned, delays = synchronise(records, base)
    np.testing.assert_allclose([d.samples for d in delays], [0, 12.345, -7.5], atol=1e-9)
    expected = matrix.T[:, None, None, :] * base[None, None, :, None]
    np.testing.assert_allclose(aligned.reference, np.tile(expected, (1, 4, 1, 1)), atol=1e-10)
    np.testing.assert_allclose(aligned.input, np.roll(2 * aligned.reference, 3, 2), atol=1e-10)
    np.testing.assert_allclose(aligned.output, -0.5 * aligned.input, atol=1e-10)
    # As designed, with its signs, gives the same; so does the first experiment as the measure.
    designed = reference_delays(records, matrix.T[:, None, :] * base[None, :, None])
    np.testing.assert_allclose([d.samples for d in designed], [0, 12.345, -7.5], atol=1e-9)
    first = reference_delays(records)
    np.testing.assert_allclose([d.samples for d in first], [0, 12.345, -7.5], atol=1e-9)


def test_the_response_per_line_does_not_depend_on_the_delays():
    """A delay turns a column of U and of Y alike."""
    _, records = unsynchronised([0.0, 12.345, -7.5], np.array([[1, 1, 1], [1, -1, 1], [1, 1, -1]]))
    aligned, _ = synchronise(records)

    def response(x):
        u, y = (np.fft.rfft(s.mean(1), axis=1)[:, LINES] for s in (x.input, x.output))
        u, y = (np.moveaxis(s, 0, 2) for s in (u, y))
        return y @ np.linalg.inv(u)

    np.testing.assert_allclose(response(records), response(aligned), atol=1e-10)


def test_misuse_is_named():
    base, records = unsynchronised([0.0, 5.0], np.eye(2))
    with pytest.raises(InputError, match="reference: expected one"):
        reference_delays(replace(records, reference=None))
    with pytest.raises(InputError, match=r"excitation: expected shape \(600,\) or \(2, 600, 2\)"):
        reference_delays(records, base[:-1])
    with pytest.raises(InputError, match=r"experiment 1, reference 1: .*fit no delay"):
        reference_delays(records, multisine(N, LINES, 9))
