"""Samples of a posterior have its moments, and depend on seed and run alone."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from axisight import load_robot
from axisight.errors import InputError
from axisight.posterior import sampled_robot
from axisight.posterior.parameter import Prior
from axisight.posterior.sampling import square_root
from posterior_data import COULOMB, MASS, OFFSET, VISCOUS, one_hypothesis, two_hypotheses

NUMBER = 20_000


def test_a_sample_depends_on_seed_and_run_alone():
    found = two_hypotheses()
    whole = found.samples(7, seed=11)
    parts = [found.samples(3, seed=11), found.samples(4, seed=11, first_run=3)]
    assert whole.identical(xr.concat(parts, "draw"))
    assert not whole.equals(found.samples(7, seed=12))
    assert found.samples(2).attrs["seed"] == found.seed


def test_samples_have_the_moments_of_the_gaussian():
    found = one_hypothesis()
    drawn = found.samples(NUMBER)
    known = found.gaussian()
    values = np.array([drawn[n].values for n in found.names])
    std = known.deviation.values
    # Four standard errors of a mean and of a correlation; no bound cuts off more than 1e-4 of a parameter.
    assert np.abs(values.mean(axis=1) - known.value.values).max() < 4 * (std / NUMBER**0.5).max()
    mean_errors = (values.mean(axis=1) - known.value.values) / (std / NUMBER**0.5)
    assert np.abs(mean_errors).max() < 4
    assert np.corrcoef(values) == pytest.approx(known.correlation.values, abs=4 / NUMBER**0.5)
    # A standard deviation has the relative standard error 1 / sqrt(2 n).
    assert values.std(axis=1) == pytest.approx(std, rel=4 / (2 * NUMBER) ** 0.5)


def test_formula_error_and_variation_between_runs_add_in_squares():
    found = one_hypothesis()
    fit, formula, runs = (
        float(found.gaussian(formula_error=a, between_runs=b).deviation.sel(parameter=COULOMB))
        for a, b in ((False, False), (True, False), (True, True))
    )
    assert fit == pytest.approx(0.02)
    assert formula == pytest.approx(np.hypot(0.02, 0.005))
    assert runs == pytest.approx(np.sqrt(0.02**2 + 0.005**2 + 0.03**2))
    # What does not vary stays as it is.
    still = [
        float(found.gaussian(between_runs=b).deviation.sel(parameter=VISCOUS))
        for b in (False, True)
    ]
    assert still[0] == still[1]


def test_hypotheses_are_drawn_by_weight_and_lack_the_causes_of_others():
    found = two_hypotheses()
    drawn = found.samples(4000)
    rival = drawn.hypothesis.values == 1
    assert rival.mean() == pytest.approx(0.25, abs=4 * (0.25 * 0.75 / 4000) ** 0.5)
    assert np.all(drawn[COULOMB].values[rival] == 0) and np.all(drawn[OFFSET].values[~rival] == 0)
    assert drawn[OFFSET].values[rival].mean() == pytest.approx(-0.4, abs=4 * 0.01 / 1000**0.5)
    # A parameter that a hypothesis lacks has its nominal value there.
    assert set(drawn[MASS].values[rival]) == {500.0}


def test_samples_stay_within_the_bounds():
    found = one_hypothesis()
    narrow = tuple(
        replace(p, lower=0.49, upper=0.53) if p.name == COULOMB else p for p in found.parameters
    )
    values = replace(found, parameters=narrow).samples(500)[COULOMB].values
    assert values.min() == 0.49 and values.max() == 0.53


def test_the_square_root_of_a_singular_covariance():
    rng = np.random.default_rng(0)
    factor = rng.standard_normal((4, 2)) * np.array([[1e6], [1.0], [1e-4], [2.0]])
    root = square_root(factor @ factor.T)
    assert root @ root.T == pytest.approx(factor @ factor.T, rel=1e-9, abs=1e-12)


def test_correlated_pairs_come_strongest_first():
    assert one_hypothesis().correlated() == [(COULOMB, VISCOUS, pytest.approx(-0.7761, abs=1e-4))]
    assert one_hypothesis().correlated(0.9) == []


def test_a_sample_as_a_robot():
    robot = load_robot("two_mass_axis").with_effects([])
    found = two_hypotheses()
    drawn = found.samples(20)
    for k in range(20):
        one = drawn.isel(draw=k)
        made = sampled_robot(found, robot, one)
        held = {e.label: e.parameters for e in made.effects}
        assert made.parameters()[VISCOUS] == float(one[VISCOUS])
        if int(one.hypothesis):
            assert held == {"torque_offset@1": {"offset_nm": float(one[OFFSET])}}
        else:
            friction = held["coulomb_friction@1"]
            assert friction["coulomb_nm"] == float(one[COULOMB])
            # What was not fitted stays.
            assert friction["smoothing_rad_s"] == 0.05
    with pytest.raises(InputError, match=r"sample: expected one draw, got 20"):
        sampled_robot(found, robot, drawn)


def test_priors_have_their_quantiles():
    share = np.array([0.025, 0.5, 0.975])
    assert Prior("normal", 2.0, 0.1).at(share, -10, 10) == pytest.approx(
        [1.804, 2.0, 2.196], abs=1e-3
    )
    assert Prior("uniform", 0.0, 0.0).at(share, 2.0, 4.0) == pytest.approx([2.05, 3.0, 3.95])
    assert Prior("log_normal", 2.0, 0.5).at(share, 0, 1e9)[1] == pytest.approx(2.0)
    # Half of a normal: its median is that of |z|.
    half = Prior("half_normal", 0.0, 1.0).at(np.array([0.5]), 0.0, 50.0)
    assert half == pytest.approx([0.67449], abs=1e-5)


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda p: p.samples(0), "number: expected a whole number"),
        (lambda p: p.samples(3, first_run=-1), "first_run: expected a whole number"),
        (lambda p: p.samples(3, seed=0.5), "seed: expected"),
        (lambda p: p.samples(3, between_runs="yes"), "between_runs: expected"),
        (
            lambda p: p.parameter("axis1.viscous"),
            "parameter: expected one of the 5.*viscous_friction",
        ),
    ],
)
def test_misuse(call, says):
    with pytest.raises(InputError, match=says):
        call(one_hypothesis())


def test_the_repr_is_short():
    text = repr(two_hypotheses())
    assert "coulomb_friction@1.coulomb_nm" in text and "weight 0.75" in text
    assert "varies between runs: yes" in text
