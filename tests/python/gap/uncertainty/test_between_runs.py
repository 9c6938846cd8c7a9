"""Which parameters vary between runs: false alarms, power, size, and logs that say nothing."""

from dataclasses import replace

import numpy as np
import pytest

from axisight.gap.uncertainty.between_runs import between_runs
from gap_data import linear_evidence

NAMES = ("one", "two")
BLOCK = 20


def evidence(seed, *, logs=6, spread=0.0, blocks=10, quiet=None):
    """Least squares of two columns on several logs; the first parameter has another value in each log.

    ``quiet``: a log in which the second column hardly moves.
    """
    rng = np.random.default_rng(seed)
    n = blocks * BLOCK
    number = np.repeat(np.arange(logs), n)
    x = rng.standard_normal((logs * n, 2)) @ np.array([[1.0, 0.6], [0.0, 0.8]])
    # Logs have different noise.
    noise = rng.standard_normal(logs * n) * np.linspace(0.5, 2.0, logs)[number]
    if quiet is not None:
        x[number == quiet, 1] *= 1e-3
        # A small error of the formula there.
        noise[number == quiet] += 0.3 * np.abs(x[number == quiet, 0]) + 0.5
    own = 1.0 + spread * rng.standard_normal(logs)
    y = x[:, 0] * own[number] + 2.0 * x[:, 1] + noise
    return linear_evidence(x, y, number, BLOCK), own


def test_constant_parameters_seldom_vary():
    runs = 200
    found = [between_runs(evidence(k)[0], NAMES, np.zeros(2)) for k in range(runs)]
    alarms = sum(any(x.varies for x in each) for each in found)
    # 5 % in all; Welch's approximation with ten blocks is good to a factor of two. Four deviations of a binomial.
    assert alarms <= runs * 0.1 + 4 * (runs * 0.1 * 0.9) ** 0.5 / 2
    p = np.array([[x.p_value for x in each] for each in found])
    assert np.median(p) == pytest.approx(0.5, abs=0.15)
    assert all(x.std == 0 for each in found for x in each if not x.varies)


def test_what_varies_is_found_and_what_does_not_stays_quiet():
    found = [between_runs(evidence(k, spread=0.3)[0], NAMES, np.zeros(2)) for k in range(40)]
    assert sum(x[0].varies for x in found) >= 38
    assert sum(x[1].varies for x in found) <= 8


def test_the_size_of_the_variation():
    fitted, own = evidence(5, logs=40, spread=0.3)
    first = between_runs(fitted, NAMES, np.zeros(2))[0]
    # The sample of 40 values is known; noise of one log adds 0.1, which is taken off again.
    assert first.std == pytest.approx(own.std(ddof=1), rel=0.15)
    # Noise of up to 0.18 beside changes of 0.3.
    assert np.corrcoef(first.by_log, own)[0, 1] > 0.7


def test_differences_within_the_error_of_formulas_count_as_the_same():
    fitted, _ = evidence(2, spread=0.3)
    assert between_runs(fitted, NAMES, np.zeros(2))[0].varies
    assert not between_runs(fitted, NAMES, np.array([1.0, 0.0]))[0].varies


def test_a_log_that_hardly_tells_a_parameter_is_left_out():
    """Its small error of formulas would show as a large change of the parameter."""
    fitted, _ = evidence(3, quiet=2)
    second = between_runs(fitted, NAMES, np.zeros(2))[1]
    assert np.isnan(second.by_log[2]) and np.isfinite(np.delete(second.by_log, 2)).all()
    assert not second.varies


def test_tolerances_hold_what_a_log_does_not_tell():
    """A parameter known far better from its tolerance than from any log has no test."""
    fitted, _ = evidence(0)
    held = replace(fitted, prior_matrix=np.diag([0.0, 1e9]))
    first, second = between_runs(held, NAMES, np.zeros(2))
    assert first.p_value is not None
    assert second.p_value is None and second.says == "not known" and second.std == 0


def test_parameters_at_a_bound_and_single_logs_have_no_test():
    fitted, _ = evidence(0)
    bound = replace(fitted, at_bound=(fitted.parameters[0],))
    assert between_runs(bound, NAMES, np.zeros(2))[0].p_value is None
    alone, _ = evidence(0, logs=1)
    assert [x.p_value for x in between_runs(alone, NAMES, np.zeros(2))] == [None, None]
