"""Periods and excited lines: found where they are, refused where they are not."""

import contextlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from axisight.errors import InputError
from axisight.records import excited_lines, find_period, repeating_lines
from axisight.records.lines import widest_gap
from records_data import multisine
from response_logs import periodic_logs


def noisy(x, level, seed):
    return x + level * np.std(x) * np.random.default_rng(seed).standard_normal(len(x))


@settings(max_examples=40)
@given(
    n=st.integers(200, 900),
    periods=st.floats(2.0, 9.0),
    level=st.sampled_from([0.0, 0.01, 0.1, 0.5]),
    seed=st.integers(0, 1000),
)
def test_the_period_is_recovered_under_noise(n, periods, level, seed):
    x = np.tile(multisine(n, np.arange(3, 60), seed), 10)[: int(periods * n)]
    found = find_period(noisy(x, level, seed))
    assert found.n_samples == n
    assert found.n_periods == len(x) // n
    # 5 standard errors, and what interpolating a peak by a parabola is off by
    assert abs(found.samples - n) < 5 * found.standard_error + 0.01
    # q times the power as noise lowers the autocorrelation to 1 / (1 + q); its scatter is
    # that of a mean over half the record
    assert found.repetition == pytest.approx(
        1 / (1 + level**2), abs=6 / np.sqrt(len(x)) * level + 1e-6
    )


def test_a_weak_odd_line_doubles_the_period():
    """Even lines alone repeat after half the period; the line that tells is 40 dB weaker."""
    n = 1000
    x = multisine(n, np.arange(2, 200, 2)) + multisine(n, [51], amplitude=0.01)
    assert find_period(noisy(np.tile(x, 8), 0.01, 1)).n_samples == n
    assert find_period(np.tile(multisine(n, np.arange(2, 200, 2)), 8)).n_samples == n // 2


def test_a_single_sine_and_a_binary_signal():
    assert find_period(np.tile(np.sin(2 * np.pi * np.arange(250) / 250), 6)).n_samples == 250
    bits = np.sign(np.random.default_rng(3).standard_normal(127))
    assert find_period(np.tile(np.repeat(bits, 4), 5)).n_samples == 508


def test_channels_at_rest_and_offsets_do_not_disturb():
    x = np.tile(multisine(400, np.arange(1, 50)), 5)
    two = np.column_stack([np.zeros_like(x), 100 + x, 1e-12 * x])
    assert find_period(two).n_samples == 400


def test_a_period_between_samples_is_refused_with_advice():
    t = np.arange(4000)
    x = sum(np.sin(2 * np.pi * k * t / 400.3 + k * k) for k in range(1, 30))
    with pytest.raises(InputError, match=r"got 400\.(29|3)\d*; excite at multiples"):
        find_period(x)


def test_noise_and_constants_have_no_period():
    with pytest.raises(InputError, match="none that repeats"):
        find_period(np.random.default_rng(0).standard_normal(3000))
    with pytest.raises(InputError, match="got a constant"):
        find_period(np.full(1000, 3.0))


def test_half_a_record_more_than_one_period_is_not_enough():
    with pytest.raises(InputError, match="at least two periods"):
        find_period(multisine(1500, np.arange(1, 90))[:1400])


def test_excited_lines_are_those_designed():
    n, lines = 2000, np.arange(1, 400, 2)
    x = np.tile(multisine(n, lines), (6, 1))
    x += 0.3 * np.random.default_rng(0).standard_normal(x.shape)
    found = excited_lines(x[None, :, :, None])
    np.testing.assert_array_equal(found.lines, lines)
    # Lines of amplitude 1 over the largest of 800 noise lines, of mean square 4 s^2 / (N P)
    expected = -20 * np.log10(np.sqrt(4 * 0.3**2 / (n * 6) * np.log(800)))
    assert found.margin_db == pytest.approx(expected, abs=3)


def test_lines_of_every_experiment_and_channel_count():
    n = 500
    signal = np.zeros((2, 3, n, 2))
    signal[0, :, :, 0] = multisine(n, [3, 5])
    signal[1, :, :, 1] = 1e-3 * multisine(n, [4, 249])
    found = excited_lines(signal)
    np.testing.assert_array_equal(found.lines, [3, 4, 5, 249])
    assert found.margin_db > 200


def test_harmonics_of_distortion_stay_below_the_floor():
    n = 1000
    x = multisine(n, np.arange(3, 100, 4))
    x = x + 1e-4 * x**2
    np.testing.assert_array_equal(excited_lines(x[None, None, :, None]).lines, np.arange(3, 100, 4))


def test_no_excitation_is_refused():
    with pytest.raises(InputError, match="no line above the noise"):
        excited_lines(np.zeros((1, 4, 100, 1)))
    with pytest.raises(InputError, match="at least two"):
        repeating_lines(np.zeros((1, 100)))


def test_false_lines_are_as_rare_as_stated():
    """At a significance of 0.05 for all lines together: 0.05 +- 4 standard errors of 400 runs."""
    generator = np.random.default_rng(5)
    runs = 400
    hits = sum(
        repeating_lines(generator.standard_normal((4, 256)), 0.05).any() for _ in range(runs)
    )
    assert hits / runs < 0.05 + 4 * np.sqrt(0.05 * 0.95 / runs)
    assert hits > 0


def test_seven_sines_in_a_window_are_one_period():
    """The sine itself repeats after 357.14 samples, the record after 2500."""
    x = np.tile(np.sin(2 * np.pi * 7 * np.arange(2500) / 2500), 4)
    assert find_period(x).n_samples == 2500
    assert find_period(noisy(x, 0.05, 0)).n_samples in (2500, 357 * 7 + 1)


def test_a_gap_in_the_levels_separates_lines_from_distortion():
    """Distortion within 40 dB of the excitation repeats as well; nothing below 10 dB or 10 lines is a gap."""
    n, lines = 1000, np.arange(10, 60)
    weaker = sum(
        multisine(n, [k], seed=k, amplitude=0.1 * 0.98 ** (k - 60)) for k in range(60, 400)
    )
    signal = np.tile(multisine(n, lines) + weaker, (1, 4, 1))[..., None]
    assert excited_lines(signal).margin_db < 1  # those above -40 dB count
    assert widest_gap(signal) == pytest.approx(-10, abs=0.1)
    np.testing.assert_array_equal(excited_lines(signal, floor_db=-10).lines, lines)
    falling = sum(multisine(n, [k], seed=k, amplitude=0.9**k) for k in range(1, 80))
    assert widest_gap(np.tile(falling, (1, 4, 1))[..., None]) is None
    few = multisine(n, [20, 30]) + weaker
    assert widest_gap(np.tile(few, (1, 4, 1))[..., None]) is None


def test_a_piece_without_a_period_ends():
    """Peaks that move away from the multiples of a lag: the straight line through them must not follow."""
    reference = periodic_logs(realizations=2, periods=5)[0].velocity_ref_rad_s
    piece = reference[20 * 53 : 21 * 53]
    with contextlib.suppress(InputError):
        assert find_period(piece).n_samples < len(piece)
