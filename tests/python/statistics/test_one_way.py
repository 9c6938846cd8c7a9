"""Analysis of variance, its power, curves, and Holm's procedure."""

import numpy as np
import pytest
import scipy.stats

from axisight.statistics.curve_test import curve_test, independent_values
from axisight.statistics.holm import holm
from axisight.statistics.one_way import OneWay, least_shift, power_of_shift

GROUP = np.array([0, 0, 0, 1, 1, 2, 2, 2, 2])


@pytest.fixture
def values():
    return np.random.default_rng(3).normal(size=(len(GROUP), 4)) + 0.5 * GROUP[:, None]


def test_squares_add_up(values):
    runs = OneWay(values, GROUP)
    between, within = runs.mean_squares
    above, below = runs.freedom
    total = ((values - values.mean(axis=0)) ** 2).sum(axis=0)
    np.testing.assert_allclose(between * above + within * below, total, rtol=1e-12)


def test_p_values_are_those_of_scipy(values):
    parts = [values[g == GROUP] for g in range(3)]
    np.testing.assert_allclose(OneWay(values, GROUP).p_value, scipy.stats.f_oneway(*parts).pvalue)


def test_components_are_recovered():
    """Expected mean squares: of 4,000 designs the mean component is off by 3 standard errors at most."""
    rng = np.random.default_rng(0)
    day, run = 2.0, 1.0
    group = np.repeat(np.arange(5), [2, 3, 4, 3, 2])
    values = day * rng.normal(size=(5, 4000))[group] + run * rng.normal(size=(len(group), 4000))
    runs = OneWay(values, group)
    between, within = runs.mean_squares
    n = len(group)
    typical = (n - (runs.counts**2).sum() / n) / 4
    raw = (between - within) / typical  # without the cut at zero, which would bias the mean
    for found, truth in ((raw, day**2), (within, run**2)):
        assert abs(found.mean() - truth) < 3 * found.std() / np.sqrt(found.size)
    np.testing.assert_allclose(runs.components[0], np.maximum(raw, 0))


def test_power_is_that_of_scipy_and_of_simulation():
    counts, variance, shift = np.array([4, 6]), np.array([0.5]), np.array([1.2])
    found = power_of_shift(counts, variance, 0.05, shift)[0]
    noncentral = 1.2**2 * 4 * 6 / 10 / 0.5
    limit = scipy.stats.f.isf(0.05, 1, 8)
    assert found == pytest.approx(scipy.stats.ncf.sf(limit, 1, 8, noncentral), rel=1e-6)
    group = np.repeat([0, 1], counts)
    rng = np.random.default_rng(1)
    draws = np.sqrt(0.5) * rng.normal(size=(10, 4000)) + 1.2 * group[:, None]
    rate = np.mean(OneWay(draws, group).p_value < 0.05)
    assert abs(rate - found) < 4 * np.sqrt(found * (1 - found) / 4000)


def test_least_shift_has_the_power_it_claims():
    counts, variance = np.array([3, 5, 4]), np.array([0.2, 3.0])
    least = least_shift(counts, variance, 0.01, 0.95)
    np.testing.assert_allclose(power_of_shift(counts, variance, 0.01, least), 0.95, rtol=1e-6)


def test_without_repeats_nothing_shows():
    counts = np.array([1, 1])
    assert np.isinf(least_shift(counts, np.ones(1), 0.05, 0.95)).all()
    assert (power_of_shift(counts, np.ones(1), 0.05, np.ones(1)) == 0).all()


def test_holm_steps_down():
    """By hand: 4 * 0.01, 3 * 0.01 (not below the first), 2 * 0.03, 1 * 0.5; a test without a value counts for none."""
    found = holm(np.array([0.03, 0.01, np.nan, 0.01, 0.5]))
    np.testing.assert_allclose(found, [0.06, 0.04, np.nan, 0.04, 0.5])


@pytest.mark.parametrize("common", [0.0, 0.5, 3.0])
def test_curves_of_any_correlation_are_told_apart_by_chance_as_often_as_stated(common):
    """Offset of each curve beside white noise: neither the noise nor one value a curve describes their scatter."""
    rng = np.random.default_rng(2)
    group = np.repeat([0, 1], 4)
    p = []
    for _ in range(1500):
        curves = rng.normal(size=(8, 40)) + common * rng.normal(size=(8, 1))
        p.append(curve_test(OneWay(curves, group)).p_value)
    for level in (0.05, 0.005):
        rate = np.mean(np.array(p) < level)
        assert abs(rate - level) < 4 * np.sqrt(level * (1 - level) / 1500)


def test_a_shifted_curve_is_found_and_measured():
    rng = np.random.default_rng(4)
    group = np.repeat([0, 1], 6)
    shape = np.sin(np.linspace(0, 6, 200))
    curves = 0.1 * rng.normal(size=(12, 200)) + 0.3 * group[:, None] * shape
    found = curve_test(OneWay(curves, group))
    assert found.p_value < 1e-6
    # Two groups apart by d have the variance d^2 / 2 between means.
    assert found.between == pytest.approx(0.3 * np.sqrt(np.mean(shape**2) / 2), rel=0.1)
    assert found.within == pytest.approx(0.1, rel=0.05)
    assert abs(found.shape @ shape) / np.linalg.norm(shape) > 0.95


def test_independent_values_of_blocks():
    """Curves of 10 independent values, each repeated 8 times."""
    rng = np.random.default_rng(5)
    found = [
        independent_values(
            OneWay(np.repeat(rng.normal(size=(12, 10)), 8, axis=1), np.repeat([0, 1], 6))
        )
        for _ in range(200)
    ]
    assert np.median(found) == pytest.approx(10, rel=0.1)
