"""Fit, residual tests, cross-validation and sensitivity."""

from __future__ import annotations

from collections.abc import Mapping
from statistics import NormalDist

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import kstest

from axisight.errors import InputError
from axisight.graybox.sensitivity import sensitivity_table
from axisight.graybox.validation import cross_validation, fit_percent, residual_tests

Real = np.ndarray


def test_fit_is_100_for_the_measurement_and_0_for_its_mean() -> None:
    y = np.random.default_rng(0).normal(2.0, 1.0, 100)
    assert fit_percent(y, y) == 100
    assert fit_percent(y, np.full(100, y.mean())) == pytest.approx(0, abs=1e-12)
    # Half of the deviation left is a fit of 50.
    assert fit_percent(y, y.mean() + 0.5 * (y - y.mean())) == pytest.approx(50)


def test_correlations_are_those_of_numpy() -> None:
    rng = np.random.default_rng(1)
    e, u = rng.normal(size=(2, 500))
    found = residual_tests(e, u, lags=5).correlations
    e, u = e - e.mean(), u - u.mean()
    full = np.correlate(e, u, "full") / np.sqrt((e @ e) * (u @ u))
    np.testing.assert_allclose(found["cross_correlation"], full[499 - 5 : 499 + 6], atol=1e-12)
    auto = np.correlate(e, e, "full") / (e @ e)
    np.testing.assert_allclose(found["autocorrelation"], auto[499 - 5 : 499 + 6], atol=1e-12)
    limit = NormalDist().inv_cdf(0.995) / np.sqrt(500)
    assert float(found["autocorrelation_limit"]) == pytest.approx(limit)


def test_p_values_are_uniform_where_the_hypothesis_is_true() -> None:
    rng = np.random.default_rng(2)
    white, past, later = [], [], []
    for _ in range(120):
        u = lfilter([1], [1, -0.9], rng.normal(size=1000))
        found = residual_tests(rng.normal(size=1000), u)
        white.append(found.whiteness_p_value)
        # Coloured residuals must not disturb the test of independence.
        coloured = residual_tests(lfilter([1], [1, -0.8], rng.normal(size=1000)), u)
        past.append(coloured.independence_p_value)
        later.append(coloured.feedback_p_value)
    for values in (white, past, later):
        assert kstest(values, "uniform").pvalue > 1e-3


def test_missing_dynamics_and_feedback_are_told_apart() -> None:
    rng = np.random.default_rng(3)
    w, v = rng.normal(size=(2, 4000))
    e = lfilter([1], [1, -0.8], v)
    u = lfilter([1], [1, -0.9], w)
    past = residual_tests(e + 0.2 * lfilter([0, 0, 1], [1], u), u)
    assert past.independence_p_value < 1e-6
    assert "lacks dynamics" in past.verdict
    # The input answers the residual at once and later: closed loop.
    feedback = residual_tests(v, u + lfilter([0.5], [1, -0.5], v))
    assert feedback.feedback_p_value < 1e-6 < 0.01 < feedback.independence_p_value
    assert "no fault of the model" in feedback.verdict
    # Coloured residuals come back through the loop: only the reference tells.
    loop = u + lfilter([0.5], [1, -0.5], e)
    coloured = residual_tests(e, loop)
    assert coloured.independence_p_value < 1e-6 and "test with the reference" in coloured.verdict
    assert residual_tests(e, u).independence_p_value > 0.01
    assert "a closed loop" in residual_tests(e, u + 0.5 * np.roll(e, 1), closed_loop=False).verdict
    assert coloured.whiteness_p_value < 1e-6 and "not white" in coloured.verdict


def test_cross_validation_of_a_gain() -> None:
    rng = np.random.default_rng(4)
    sets = {name: (u := rng.normal(size=50), gain * u) for name, gain in (("a", 1.0), ("b", 2.0))}

    def fit(chosen: list[tuple[Real, Real]]) -> float:
        u, y = (np.concatenate(part) for part in zip(*chosen, strict=True))
        return float(u @ y / (u @ u))

    table, models = cross_validation(fit, sets, lambda g, d: g * d[0], lambda d: d[1])
    assert table.dims == ("data_set", "estimated_on")
    assert float(table.sel(data_set="a", estimated_on="a")) == pytest.approx(100)
    u, y = sets["b"]
    assert float(table.sel(data_set="b", estimated_on="a")) == pytest.approx(fit_percent(y, u))
    assert 1 < models["a, b"] < 2
    with pytest.raises(InputError, match="expected names among a, b, got"):
        cross_validation(fit, sets, lambda g, d: g * d[0], lambda d: d[1], combinations=[["c"]])


def test_sensitivity_of_a_straight_line() -> None:
    t = np.linspace(-1, 1, 101)
    parameters = {"slope": 3.0, "offset": 1.0, "none": 0.0}

    def simulate(values: Mapping[str, float], scale: float) -> Real:
        return scale * (values["slope"] * t + values["offset"] + values["none"])

    def measured(scale: float) -> Real:
        return scale * (3 * t + 1)

    found = sensitivity_table(parameters, {"one": 1.0, "two": 2.0}, simulate, measured)
    assert found["parameter"].values.tolist() == ["slope", "offset"]
    # A slope off by 20 % misses by 20 % of the spread, whatever the scale.
    np.testing.assert_allclose(found.sel(parameter="slope"), -20.0)
    spread = np.sqrt(np.sum((3 * t) ** 2))
    np.testing.assert_allclose(
        found.sel(parameter="offset"), -100 * 0.2 * np.sqrt(101) / spread, rtol=1e-12
    )
    with pytest.raises(InputError, match="none is zero"):
        sensitivity_table(parameters, {"one": 1.0}, simulate, measured, names=("none",))
    with pytest.raises(InputError, match="change: expected a number between 0 and 1"):
        sensitivity_table(parameters, {"one": 1.0}, simulate, measured, change=1.5)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: fit_percent(np.ones(5), np.ones(5)), "measured: expected values that vary"),
        (lambda: fit_percent(np.arange(5.0), np.ones(4)), "simulated: expected 5 samples"),
        (
            lambda: fit_percent([1.0, np.inf], [1.0, 2.0]),
            "measured: expected finite .* inf at sample 2",
        ),
        (lambda: fit_percent(["a"], [1.0]), "measured: expected real numbers"),
        (lambda: residual_tests(np.ones(200), np.arange(200.0)), "expected values that vary"),
        (lambda: residual_tests(np.arange(50.0), np.arange(50.0)), "expected at least 104 samples"),
        (
            lambda: residual_tests(np.arange(50.0), np.arange(50.0), lags=0),
            "lags: expected a whole",
        ),
        (
            lambda: residual_tests(np.arange(500.0), np.arange(500.0), probability=1.0),
            "probability: expected a number between 0 and 1",
        ),
    ],
)
def test_misuse(call: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        call()  # type: ignore[operator]
