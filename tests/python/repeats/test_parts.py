"""Temperature as a covariate, the family of tests, and echoes."""

import numpy as np
import pytest
import scipy.stats
import xarray as xr

from axisight.repeats.family import judged
from axisight.repeats.temperature import temperature_slope
from axisight.statistics.holm import holm


def test_slope_of_one_day_is_that_of_scipy():
    rng = np.random.default_rng(0)
    celsius = rng.uniform(20, 40, 12)
    values = 3 - 0.1 * celsius + rng.normal(size=12)
    found = temperature_slope(values, celsius, np.zeros(12, dtype=np.intp))
    oracle = scipy.stats.linregress(celsius, values)
    assert found.per_c == pytest.approx(oracle.slope, rel=1e-9)
    assert found.p_value == pytest.approx(oracle.pvalue, rel=1e-9)
    half = scipy.stats.t.isf(0.025, 10) * oracle.stderr
    assert found.upper - found.per_c == pytest.approx(half, rel=1e-9)


def test_days_at_equal_temperature_are_the_f_test_of_nested_regressions():
    rng = np.random.default_rng(1)
    group = np.repeat([0, 1, 2], [4, 5, 3])
    celsius = rng.uniform(20, 40, 12) + 5 * group
    values = 0.2 * celsius + 1.5 * group + rng.normal(size=12)
    found = temperature_slope(values, celsius, group)
    small = np.column_stack([np.ones(12), celsius])
    large = np.column_stack([np.eye(3)[group], celsius])
    left = [np.linalg.lstsq(x, values, rcond=None)[1][0] for x in (small, large)]
    f = (left[0] - left[1]) / 2 / (left[1] / 8)
    assert found.p_days == pytest.approx(scipy.stats.f.sf(f, 2, 8), rel=1e-9)


def test_slope_without_repeats_or_differences_is_unknown():
    group = np.array([0, 0, 1])
    assert temperature_slope(np.arange(3.0), np.arange(3.0), group) is None
    still = np.full(6, 25.0)
    assert temperature_slope(np.arange(6.0), still, np.repeat([0, 1], 3)) is None


def tables(p_parameters, p_torque, share, between):
    parameters = xr.Dataset(
        {"p_value": ("parameter", p_parameters), "torque_share": ("parameter", share)}
    )
    torque = xr.Dataset(
        {
            "p_value": ("axis", p_torque),
            "smooth_between_nm": ("axis", between),
            "torque_nm": ("axis", np.ones(len(p_torque))),
        }
    )
    return parameters, torque


def test_parameters_and_torques_are_one_family():
    p, q = [1e-3, 0.02, 0.3], [0.014, 0.6]
    parameters, torque = judged(*tables(p, q, np.ones(3), np.ones(2)), 0.05)
    expected = holm(np.array(p + q))
    np.testing.assert_allclose(parameters["p_adjusted"], expected[:3])
    np.testing.assert_allclose(torque["p_adjusted"], expected[3:])
    # 0.014 alone is below 5 %, but not as the second of five.
    assert parameters["moved"].values.tolist() == [True, False, False]
    assert not torque["moved"].values.any()


def test_a_trace_of_a_large_change_is_an_echo():
    """4 % of the largest change is one, 6 % is none; what does not differ is neither, however large."""
    p = [1e-9, 1e-9, 1e-9, 0.9]
    parameters, torque = judged(*tables(p, [1e-9, 1e-9], [1.0, 0.04, 0.06, 9.0], [1.0, 0.01]), 0.05)
    assert parameters["echo"].values.tolist() == [False, True, False, False]
    assert parameters["moved"].values.tolist() == [True, False, True, False]
    assert torque["moved"].values.tolist() == [True, False]
