"""Values where the model leaves more than noise: what errors count for, and how sure values are."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pytest
import scipy.stats
from test_reversals import COULOMB_NM, QUICK, STEP_S, logs_of, simulator

from axisight import diagnose
from axisight.gap.search.balanced_values import deviations, inflation
from axisight.logs import Log, lowpass


@dataclass
class Linear:
    """A linear regression in blocks, as a fitted model has it: every axis in stretches of ``length`` rows."""

    x: np.ndarray
    y: np.ndarray
    prior: np.ndarray
    axes: int
    length: int
    at_bound: tuple = ()
    std: dict = field(default_factory=dict)

    def __post_init__(self) -> None:
        p = self.x.shape[1]
        rows = self.x.reshape(-1, self.length, p)
        self.parameters = tuple((None, f"p{i}") for i in range(p))
        self.std = dict.fromkeys(self.parameters, 1.0)
        self.prior_matrix = np.diag(self.prior)
        whole = self.x.T @ self.x + self.prior_matrix
        self.theta = np.linalg.solve(whole, self.x.T @ self.y)
        left = (self.x @ self.theta - self.y).reshape(-1, self.length)
        self.matrix = np.einsum("bri,brj->bij", rows, rows)
        self.gradient = np.einsum("bri,br->bi", rows, left)
        self.prior_gradient = self.prior * self.theta
        self.loss = 0.5 * (left**2).sum(axis=1)
        per_axis = len(rows) // self.axes
        self.axis = np.repeat(np.arange(self.axes), per_axis)
        self.log = np.zeros(len(rows), dtype=np.int64)
        self.start = np.arange(len(rows)) * self.length


def _regression(rng, *, errors, prior=0.0, axes=1, blocks=40, length=50, parameters=3) -> Linear:
    n = axes * blocks * length
    x = rng.standard_normal((n, parameters))
    return Linear(x, errors(rng, n), np.full(parameters, prior), axes, length)


def _white(rng, n):
    return rng.standard_normal(n)


def test_errors_as_the_weights_have_them_count_in_full():
    rng = np.random.default_rng(1)
    # tr(H^-1 J) / p of p chi-squares with some forty degrees of freedom each: a mean of one, and a
    # standard deviation of sqrt(2 / 40 / 3) = 0.13. The mean of a hundred is within five of its errors.
    found = [inflation(_regression(np.random.default_rng(k), errors=_white))[0] for k in range(100)]
    # What is below one counts as one: half of the scatter stays, 0.4 of a deviation.
    assert np.mean(found) == pytest.approx(1 + 0.4 * 0.13, abs=5 * 0.13 / 10)
    large = inflation(_regression(rng, errors=lambda r, n: 7 * r.standard_normal(n)))
    assert large[0] == pytest.approx(49, rel=5 * 0.13)


def test_errors_that_go_together_count_for_less():
    """A constant error over stretches of 50 counts once for the regressor that is constant there."""
    rng = np.random.default_rng(2)
    blocks, length = 200, 50
    x = np.repeat(rng.standard_normal((blocks, 1)), length, axis=0)
    y = np.repeat(rng.standard_normal(blocks), length)
    found = inflation(Linear(x, y, np.zeros(1), 1, length))
    # J / H is 50 in expectation; x^2 e^2 over x^2 scatters by sqrt(8 / 200).
    assert found[0] == pytest.approx(50, rel=5 * np.sqrt(8 / blocks))


def test_each_axis_has_its_own():
    rng = np.random.default_rng(3)
    size = np.repeat([1.0, 10.0], 40 * 50)
    found = inflation(_regression(rng, axes=2, errors=lambda r, n: size * r.standard_normal(n)))
    assert found[1] / found[0] == pytest.approx(100, rel=0.7)


def test_few_blocks_tell_nothing():
    rng = np.random.default_rng(4)
    few = _regression(rng, blocks=5, errors=lambda r, n: 9 * r.standard_normal(n))
    assert inflation(few).tolist() == [1.0]
    assert deviations(few) == few.std


def test_deviations_are_those_of_leaving_stretches_out_one_by_one():
    """The oracle fits the regression anew without each stretch, on all axes at once."""
    rng = np.random.default_rng(5)
    axes, blocks, length = 2, 12, 30
    model = _regression(rng, axes=axes, blocks=blocks, length=length, prior=40.0, errors=_white)
    stretch = np.tile(np.repeat(np.arange(blocks), length), axes)
    prior = np.diag(model.prior)
    without = []
    for k in range(blocks):
        x, y = model.x[stretch != k], model.y[stretch != k]
        without.append(np.linalg.solve(x.T @ x + prior, x.T @ y))
    inverse = np.linalg.inv(model.x.T @ model.x + prior)
    variance = (blocks - 1) * np.var(without, axis=0) + np.diag(inverse @ prior @ inverse)
    expected = np.sqrt(variance) * scipy.stats.t.ppf(0.975, blocks - 1) / 1.96
    found = deviations(model)
    assert [found[name] for name in model.parameters] == pytest.approx(expected.tolist(), rel=1e-9)


def test_intervals_hold_the_truth_as_often_as_they_say():
    """Errors of one sign over stretches, which a sandwich over twelve blocks takes for too sure."""
    held, runs = 0, 400
    for k in range(runs):
        rng = np.random.default_rng([6, k])
        blocks, length = 12, 20
        x = np.repeat(rng.standard_normal((blocks, 2)), length, axis=0)
        y = np.repeat(rng.standard_normal(blocks), length)
        model = Linear(x, y, np.zeros(2), 1, length)
        held += abs(model.theta[0]) <= 1.96 * deviations(model)[model.parameters[0]]
    # 95 % of 400 scatters by 1.1 points; the jackknife is known to be on the safe side.
    assert held / runs >= 0.95 - 3 * 0.011


def test_what_is_at_its_bound_keeps_what_the_fit_says():
    rng = np.random.default_rng(7)
    model = _regression(rng, errors=_white)
    model.at_bound = (model.parameters[1],)
    assert deviations(model)[model.parameters[1]] == 1.0


def _disturbed(log: Log, run: int) -> Log:
    """The log with a slow torque that no model knows, of 4 % of the torque."""
    rng = np.random.default_rng([99, run])
    slow = lowpass(rng.normal(size=log.torque_nm.shape), STEP_S, 0.3)
    slow *= 0.04 * log.torque_nm.std(axis=0) / slow.std(axis=0)
    return replace(log, torque_nm=log.torque_nm + slow)


def test_a_slow_disturbance_does_not_bend_a_true_simulator() -> None:
    """All but the friction of axis 5 is true: without the balance four masses and inertias go to the edge."""
    logs = [_disturbed(log, i) for i, log in enumerate(logs_of("sines", 1.0))]
    found = diagnose(
        robot=simulator(without=5), estimation=logs[:2], validation=logs[2:], settings=QUICK
    )
    assert [(c.effect, c.axis) for c in found.causes] == [("coulomb_friction", 5)]
    level = found.causes[0].parameters["coulomb_nm"]
    assert level.low <= COULOMB_NM[4] <= level.high
    assert level.value == pytest.approx(COULOMB_NM[4], rel=0.05)
    # One and a half of their tolerances (2 % of an inertia), where the bound is at four.
    assert max(abs(v.value) for v in found.refit.values()) < 0.03
    assert not [f for f in found.findings if f.name == "parameter_at_edge"]
