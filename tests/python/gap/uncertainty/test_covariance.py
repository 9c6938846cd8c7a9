"""Covariance of all parameters: against least squares, a block bootstrap and a sampler of the true likelihood."""

from dataclasses import replace

import numpy as np
import pytest

from axisight import Effect, Settings, diagnose
from axisight.fitting.divergence import Diverged
from axisight.gap.uncertainty import posterior_of as module
from axisight.gap.uncertainty.covariance import bootstrap_std, covariance, inverse, sandwich
from gap_data import HELD, PLAN, bare_axis, linear_evidence, logs_of, scattered

STRETCHES, BLOCK = 300, 20


def line_and_curve(seed: int = 0):
    """Least squares of three strongly correlated columns with white noise of variance one."""
    rng = np.random.default_rng(seed)
    n = STRETCHES * BLOCK
    a = rng.standard_normal((n, 3))
    x = a @ np.array([[1.0, 0.9, 0.0], [0.0, 0.45, 0.0], [0.0, 0.0, 1e3]])
    return x, linear_evidence(x, x @ [1.0, 2.0, 3e-3] + rng.standard_normal(n), np.zeros(n, int))


def test_inverse_and_sandwich_are_the_covariance_of_least_squares():
    x, fitted = line_and_curve()
    exact = np.linalg.inv(x.T @ x)
    assert inverse(fitted) == pytest.approx(exact, rel=1e-9)
    # The scatter of n blocks has the relative error sqrt(2 / n); four of these.
    size = np.sqrt(np.outer(np.diag(exact), np.diag(exact)))
    assert sandwich(fitted) / size == pytest.approx(exact / size, abs=4 * (2 / STRETCHES) ** 0.5)


def test_standard_errors_are_those_of_the_verdict():
    x, fitted = line_and_curve()
    std = np.array([2.0, 5.0, 1e-3])
    found = covariance(fitted, std)
    assert np.sqrt(np.diag(found)) == pytest.approx(std)
    exact = np.linalg.inv(x.T @ x)
    wanted = exact[0, 1] / np.sqrt(exact[0, 0] * exact[1, 1])
    assert found[0, 1] / 10 == pytest.approx(wanted, abs=4 * (2 / STRETCHES) ** 0.5)
    assert np.linalg.eigvalsh(found / np.outer(std, std)).min() > 0


def test_what_nothing_determines_correlates_with_nothing():
    _, fitted = line_and_curve()
    found = covariance(fitted, np.array([1.0, np.inf, 1.0]))
    assert np.isinf(found[1, 1]) and found[0, 1] == found[1, 2] == 0
    assert np.isfinite(found[np.ix_([0, 2], [0, 2])]).all()


def test_the_bootstrap_agrees_with_the_sandwich():
    _, fitted = line_and_curve()
    draws = 400
    found = bootstrap_std(fitted, draws=draws, seed=1)
    # Four standard errors of a standard deviation from so many draws, and from so many blocks.
    error = 4 * (1 / (2 * draws) + 1 / (2 * STRETCHES)) ** 0.5
    assert found == pytest.approx(np.sqrt(np.diag(sandwich(fitted))), rel=error)


def test_the_bootstrap_keeps_tolerances():
    """A parameter that no data determine scatters by its tolerance."""
    _, fitted = line_and_curve()
    blind = replace(
        fitted,
        matrix=fitted.matrix * np.outer([1, 1, 0], [1, 1, 0]),
        gradient=fitted.gradient * [1, 1, 0],
        prior_matrix=np.diag([0.0, 0.0, 1 / 0.2**2]),
    )
    assert bootstrap_std(blind, draws=800, seed=0)[2] == pytest.approx(0.2, rel=4 / 1600**0.5)


@pytest.fixture(scope="module")
def small():
    """Return the fitter and the model behind the posterior of one axis with dry friction, evaluated there."""
    kept = {}
    real = module.evaluated

    def evaluated(fitter, model):
        kept.setdefault("fitter", fitter)
        return kept.setdefault("at", real(fitter, model))

    robot = bare_axis()
    machine = scattered(robot, 4)
    effect = [Effect("coulomb_friction", 1, {"coulomb_nm": 0.5, "smoothing_rad_s": 0.05})]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "evaluated", evaluated)
        found = diagnose(
            robot=robot,
            estimation=logs_of(machine, effect, PLAN, seconds=2.0),
            validation=logs_of(machine, effect, HELD, seconds=2.0),
            settings=Settings(bootstrap=50),
            posterior=True,
        )
    return kept["fitter"], kept["at"], found


def test_evaluation_at_the_end_of_a_fit_changes_nothing(small):
    fitter, at, found = small
    assert [c.label for c in found.causes] == ["coulomb_friction@1"]
    again = fitter.fit(at.free, at, fresh=True, max_iterations=0)
    assert again.robot_values == at.robot_values
    # The standard errors of the verdict are those of the same sandwich; sensitivities were renewed.
    mine = {f"{at.effects[0].label}.{n}": s for (p, n), s in at.std.items() if p == 0}
    told = found.posterior.gaussian(formula_error=False)
    for name, deviation in mine.items():
        assert float(told.deviation.sel(parameter=name)) == pytest.approx(deviation, rel=0.02)


def test_a_sampler_of_the_true_likelihood_agrees_with_the_normal_equations(small):
    """Three parameters, the others held: random-walk Metropolis on exp(-loss / 2) of the simulated closed loop.

    It needs no sensitivities, so it checks both these and that the loss is quadratic near the fit.
    """
    fitter, at, _ = small
    keys = [(None, "axis1.motor_inertia"), (None, "axis1.viscous_friction"), (0, "coulomb_nm")]
    place = [at.parameters.index(key) for key in keys]
    precision = (at.matrix.sum(axis=0) + at.prior_matrix)[np.ix_(place, place)]
    exact = np.linalg.inv(precision)
    start = np.array(
        [at.robot_values[n] if p is None else at.effects[p].values()[0] for p, n in keys]
    )
    prior = {p.name: p.prior for p in fitter.own}

    def loss(values):
        own = {**at.robot_values, keys[0][1]: values[0], keys[1][1]: values[1]}
        found = fitter.loss([at.free[0].at({"coulomb_nm": values[2]})], at, robot_values=own)
        assert not isinstance(found, Diverged)
        pulls = [(own[n] - prior[n][0]) / prior[n][1] for n in (keys[0][1], keys[1][1])]
        return found + float(np.square(pulls).sum())

    rng = np.random.default_rng(3)
    step = np.linalg.cholesky(exact) * 2.4 / 3**0.5
    now, height, kept, moved = start, loss(start), [], 0
    number = 1200
    for _ in range(number):
        trial = now + step @ rng.standard_normal(3)
        there = loss(trial)
        if np.log(rng.random()) < 0.5 * (height - there):
            now, height, moved = trial, there, moved + 1
        kept.append(now)
    chain = np.array(kept[100:])
    assert 0.15 < moved / number < 0.6
    # The chain remembers about 10 steps, so it is worth 100 draws: a deviation is known to 7 %, a mean to 0.1 of it.
    std = np.sqrt(np.diag(exact))
    assert chain.std(axis=0) == pytest.approx(std, rel=0.28)
    assert np.abs((chain.mean(axis=0) - start) / std).max() < 0.4
    correlation = exact / np.outer(std, std)
    assert np.corrcoef(chain.T) == pytest.approx(correlation, abs=0.4)
    assert abs(correlation[1, 2]) > 0.5, "the pair that matters is correlated"
