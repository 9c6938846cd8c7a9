"""Chapters 3 and 5 in a quick run: the loop, the statistics of the claims, and what they decide."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import integrate

from axisight_thesis import Claim, Context, context, registered
from axisight_thesis import chapter3_claims as three
from axisight_thesis.chapter3_loop import P, Q, Setting, experiment, ratio
from axisight_thesis.chapter5_transients import SAMPLES, outputs


@pytest.fixture(scope="module")
def quick() -> Context:
    return context(quick=True)


def test_the_loop_is_the_one_that_is_predicted(quick: Context) -> None:
    """The variance of u is the integral of its spectrum (3.59): 100,000 samples whose correlation of
    some 20 samples leaves 5,000 independent ones, 3 sqrt(2 / 5000) = 6 %."""
    setting = Setting(gain=2.0, noise_std=1.0)
    x = experiment(quick, setting, 0, n=100_000)
    f = np.linspace(0, 0.5, 4001)
    expected = 2 * integrate.trapezoid(sum(setting.spectra(f)), f)
    assert x.input.var() == pytest.approx(expected, rel=0.06)
    # Without noise y = G u, and u = r - F_y y.
    exact = experiment(quick, replace(setting, noise_std=0.0), 0, n=4096)
    model = setting.controller_model()
    g = model.response([0.1, 0.3])["response"].values[:, 0, 0]
    np.testing.assert_allclose(g, 2.0 * ratio(P, Q, np.array([0.1, 0.3])), rtol=1e-12)
    left = exact.input[50:] - (exact.reference - model.simulate(exact_of(exact)))[50:]
    # The controller starts at rest here; its pole of 0.5 forgets that in 50 samples to 1e-15.
    np.testing.assert_allclose(left, 0, atol=1e-12)


def exact_of(x):
    return replace(x, input=x.output, output=x.input)


def test_a_limit_that_is_never_reached_changes_nothing(quick: Context) -> None:
    setting = Setting(gain=2.0)
    one = experiment(quick, setting, 1, n=500)
    other = experiment(quick, replace(setting, limit=1e6), 1, n=500)
    np.testing.assert_allclose(other.output, one.output, atol=1e-10)
    np.testing.assert_allclose(other.input, one.input, atol=1e-10)
    limited = experiment(quick, replace(setting, limit=0.1), 1, n=500)
    assert np.abs(limited.reference - limited.input).max() <= 0.1 + 1e-12


def test_share_of_a_bias() -> None:
    bias = three.predicted_bias(three.USUAL)
    g = three.truth()
    np.testing.assert_allclose(
        three.share(np.stack([g, g + bias, g - bias]), bias), [0, 1, -1], atol=1e-12
    )
    assert np.linalg.norm(bias) / np.linalg.norm(g) == pytest.approx(0.244, abs=0.001)
    # The true noise model has no bias, and neither has open loop.
    f = three.GRID
    exact = ratio(three.C, three.D, f)
    assert np.abs(three.predicted_bias(three.USUAL, exact)).max() < 1e-6
    assert np.abs(three.predicted_bias(replace(three.USUAL, gain=0.0))).max() < 1e-6


@pytest.mark.parametrize(
    ("values", "verdict"), [([1.0, 1.1, 0.9], True), ([3.0, 3.1, 2.9], False), ([1.0, 9.0], None)]
)
def test_within(values, verdict) -> None:
    assert three.within(np.asarray(values), 0.0, 2.0) is verdict


@pytest.mark.parametrize(
    "check",
    ["_direct", "_variance", "_reference_part", "_spectral_limit", "_inverse_controller", "_etfe"],
)
def test_claims_of_chapter_3_hold_in_a_quick_run(check: str, quick: Context) -> None:
    holds, evidence = getattr(three, check)(quick)
    assert holds is True, evidence


def test_the_bias_of_a_fixed_noise_model_is_the_predicted_one(quick: Context) -> None:
    """Eight realizations: a mean of 1 with a standard error of 6 %."""
    bias = three.predicted_bias(three.USUAL)
    found = three.share(three._usual(quick, "direct, output error"), bias)
    assert found.mean() == pytest.approx(1.0, abs=0.2)


def test_claims_of_chapter_5(quick: Context) -> None:
    claims: dict[str, Claim] = {c.id: c for c in registered()["claims-5"](quick).claims}
    denied = [name for name, c in claims.items() if c.holds is not True]
    assert denied == ["5.4-schroeder"], [claims[n].evidence for n in denied]
    assert len(claims) == 10


def test_figure_5_1_solves_the_equation(quick: Context) -> None:
    """y' = -y + sin(2 pi t) by SciPy's solver."""
    t, y, _ = outputs()
    solved = integrate.solve_ivp(
        lambda at, state: -state + np.sin(2 * np.pi * at),
        (0, 5),
        [0.0],
        t_eval=t,
        rtol=1e-10,
        atol=1e-12,
    )
    np.testing.assert_allclose(y, solved.y[0], atol=1e-8)
    made = registered()["figure-5.1"](quick)
    assert len(made.tables[""]) == 5 * SAMPLES and [c.verdict for c in made.claims] == [
        "yes",
        "yes",
    ]
    spectrum = made.tables["spectrum"]
    # Each period has exp(-1) of the transient of the one before.
    np.testing.assert_allclose(
        spectrum["period_2"][2:] / spectrum["period_1"][2:], np.exp(-1), rtol=1e-9
    )
