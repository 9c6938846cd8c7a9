"""The tables of chapter 8 against the values of the thesis: start angles, averages, agreement."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest
from scipy import stats

from axisight_thesis import Context, context, registered
from axisight_thesis.agreement import Agreement
from axisight_thesis.chapter8_averages import DESIGN, averaged, realizations_from_rest
from axisight_thesis.chapter8_robot import CONTROLLER_SPEED, weakly_coupled
from axisight_thesis.chapter8_setting import (
    PERIOD_S,
    RESOLVER_RIPPLE_RAD,
    Design,
    excited_lines,
    references,
    ripple,
    start_angles,
)
from axisight_thesis.chapter8_sinusoid import RAYLEIGH_FACTORS, SINUSOID_HZ, error_runs
from axisight_thesis.chapter8_study import experiments, true_response


@pytest.fixture(scope="module")
def quick() -> Context:
    return context(quick=True)


def test_start_angles_are_a_function_of_seed_and_run(quick: Context) -> None:
    robot = quick.robot
    assert np.all(start_angles(robot, 0, 0) == 0)
    found = np.array([start_angles(robot, 0, run) for run in range(1, 400)])
    assert np.array_equal(found[4], start_angles(robot, 0, 5))
    assert not np.allclose(found[4], start_angles(robot, 1, 5))
    # Uniform over a turn; a true hypothesis fails once in a thousand seeds.
    assert stats.kstest(found.ravel() / (2 * np.pi), "uniform").pvalue > 1e-3


def test_ripple_begins_at_the_start_angle(quick: Context) -> None:
    """Order by order the effect is the sine of (8.2b) at the angle moved by the start."""
    start = np.array([0.3, 2.0, 5.0])
    resolver = [e for e in ripple(quick.robot, start) if e.name == "resolver_ripple"]
    angle = np.linspace(0, 3, 50)
    for effect, moved in zip(resolver, start, strict=True):
        p = effect.parameters
        for k, (order, amplitude, phase) in enumerate(RESOLVER_RIPPLE_RAD, 1):
            here = p[f"cosine_{k}_rad"] * np.cos(order * angle)
            here = here + p[f"sine_{k}_rad"] * np.sin(order * angle)
            expected = amplitude * np.sin(order * (angle + moved) + phase)
            np.testing.assert_allclose(here, expected, atol=1e-15)


def test_a_whole_turn_changes_nothing(quick: Context) -> None:
    turned = ripple(quick.robot, 2 * np.pi)
    for before, after in zip(ripple(quick.robot), turned, strict=True):
        for name, value in (before.parameters or {}).items():
            assert (after.parameters or {})[name] == pytest.approx(value, abs=1e-12)


def test_realizations_of_the_averages_are_clipped(quick: Context) -> None:
    """Crest factor 1.55 as in section 8.2; random phases have 3.6."""
    crest = []
    for run in range(20):
        r = references(quick.robot, Design("T1", square=False), 0, run)[0, :, 0]
        crest.append(np.abs(r).max() / np.sqrt(np.mean(r**2)))
    # Single signals scatter by 0.02.
    assert np.mean(crest) == pytest.approx(1.55, abs=0.02)
    assert max(crest) < 1.65


def test_realizations_are_a_function_of_seed_and_run(quick: Context) -> None:
    """Neither threads nor the number of realizations change a realization."""
    few = realizations_from_rest(quick, 3)
    again = realizations_from_rest(context(quick=True, threads=2), 9)
    assert few.tobytes() == again[:3].tobytes()
    # A realization of the next block has a multisine of its own, too.
    near, far = (np.median(np.abs(again[k] - again[0])) for k in (1, 8))
    assert far > 0.5 * near
    other = realizations_from_rest(context(seed=1, quick=True), 3)
    assert not np.allclose(few, other)
    # The first begins at rest like the one of Table 8.2, and differs by the noise only.
    table = experiments(quick, DESIGN).estimate
    true = true_response(quick, excited_lines() / PERIOD_S)
    assert np.median(np.abs(few[0] - table) / np.abs(table - true)) < 0.05


def test_averages_are_those_of_their_definitions(quick: Context) -> None:
    study = averaged(quick, 40)
    assert study.attrs["runs"] == 4
    single = realizations_from_rest(quick, 4)
    np.testing.assert_allclose(study["arithmetic_mean"].values, single.mean(axis=0))
    size = stats.gmean(np.abs(single), axis=0)
    np.testing.assert_allclose(np.abs(study["log_mean"].values), size)
    scatter = np.sqrt(single.real.var(axis=0, ddof=1) + single.imag.var(axis=0, ddof=1))
    np.testing.assert_allclose(study["standard_error"].values, scatter / 2)


def test_the_weakly_coupled_robot_changes_six_numbers_and_its_gains(quick: Context) -> None:
    weak = weakly_coupled(quick)
    before, after = (tomllib.loads(c.robot.toml)["joint"] for c in (quick, weak))
    changed = 0
    for a, b in zip(before, after, strict=True):
        links = (j.pop("link", {"com": [], "inertia": []}) for j in (a, b))
        for x, y in zip(*(link["com"] + link["inertia"] for link in links), strict=True):
            changed += x != y
        assert a == b
    assert changed == 6
    assert weakly_coupled(quick) is weak
    gains = [c.robot.controller_gains for c in (quick, weak)]
    assert gains[1]["kp"] == pytest.approx(CONTROLLER_SPEED * gains[0]["kp"])
    assert gains[1]["ki"] == pytest.approx(CONTROLLER_SPEED**2 * gains[0]["ki"])


def test_only_the_coupling_of_axis_1_changes_at_low_frequency(quick: Context) -> None:
    f = np.array([SINUSOID_HZ])
    before, after = (np.abs(true_response(c, f)[0]) for c in (quick, weakly_coupled(quick)))
    ratio = after / before
    assert ratio[0, 1] < 0.3 and ratio[0, 2] < 0.3
    # A weak coupling hardly acts back on the other elements.
    assert ratio[[0, 1, 1, 2], [0, 1, 2, 2]] == pytest.approx(np.ones(4), abs=0.15)


def test_agreement_finds_a_table_of_the_same_distribution() -> None:
    """A draw from the realizations' own distribution agrees; one moved by a factor 3 does not."""
    rng = np.random.default_rng(0)
    size = rng.uniform(0, 5, 36)
    agreed = 0
    for _ in range(200):
        draws = np.exp(size + 0.2 * rng.normal(size=(9, 36)))
        agreed += Agreement.of(draws[0], draws[1:]).scattered
        assert not Agreement.of(3 * draws[0], draws[1:]).scattered
    # 36 entries at 5 %: at most 4 outside in 97 % of the cases. Four standard errors of 200 cases.
    expected = stats.binom.cdf(4, 36, 0.05)
    assert agreed / 200 > expected - 4 * np.sqrt(expected * (1 - expected) / 200)


def test_agreement_of_patterns() -> None:
    rng = np.random.default_rng(1)
    size = rng.uniform(0, 5, 18)
    draws = np.exp(size + 0.1 * rng.normal(size=(8, 18)))
    assert Agreement.of(7 * np.exp(size), draws).alike  # a common factor is no matter of pattern
    assert not Agreement.of(np.exp(rng.permutation(size)), draws).alike
    assert Agreement.of(7 * np.exp(size), draws).factor == pytest.approx(7, rel=0.2)


def test_rayleigh_factors() -> None:
    mean = stats.rayleigh.mean()

    def within(factor: float) -> float:
        low, high = stats.rayleigh.cdf([mean / factor, mean * factor])
        return float(high - low)

    assert within(RAYLEIGH_FACTORS[0]) == pytest.approx(0.95, abs=0.002)
    assert within(RAYLEIGH_FACTORS[1]) == pytest.approx(0.5, abs=0.005)


def test_realizations_of_the_sinusoid_differ_by_start_angle(quick: Context) -> None:
    runs = error_runs(quick)
    assert runs.shape == (2, 2, 3, 3)
    assert np.all(runs[0] != runs[1])


@pytest.mark.parametrize("name", ["table-8.2", "table-8.3", "table-8.4"])
def test_tables_hold_claims_on_their_values(quick: Context, name: str) -> None:
    made = registered()[name](quick)
    ids = [claim.id for claim in made.claims]
    assert len(set(ids)) == len(ids) >= 3
    assert all(i.startswith(name) for i in ids)
    assert all(claim.evidence for claim in made.claims)
