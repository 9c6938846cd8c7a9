"""Rational fits of responses: identities, oracles, recovery, uncertainty, realization, misuse."""

from functools import lru_cache

import numpy as np
import pytest
import xarray as xr
from scipy import interpolate, linalg, signal

from axisight import Robot, load_robot
from axisight.blackbox import RationalModel, fit_rational, rational_orders, realize
from axisight.blackbox._model import evaluate
from axisight.blackbox._sections import Domain, Sections, Weighted
from axisight.blackbox._vector_fitting import relocated
from axisight.blackbox.rational import _searched, projected_jacobian
from axisight.errors import InputError
from axisight.frf import logarithmic_mean, mfrf
from axisight.frf.response import frequency_response
from axisight.records.periodic import PeriodicRecords
from axisight.simulation import simulate_batch
from axisight_thesis.chapter8_setting import Design, references, ripple

OMEGA = 2 * np.pi * np.array([8.0, 15.0, 30.0])
ZETA = np.array([0.02, 0.015, 0.03])
SHAPES = np.array([[0.9, -0.4], [0.5, 1.2], [-0.7, 0.8]])
MASS = np.array([[2.0, 0.3], [0.3, 1.0]])
LINES = np.arange(20, 500, 2) / 10.0


def continuous(f: np.ndarray) -> np.ndarray:
    """Two masses with three modes of rank one: 1/s^2 and three pairs, 10 states."""
    s = 2j * np.pi * f[:, None, None]
    g = np.linalg.inv(MASS) / s**2
    for shape, omega, zeta in zip(SHAPES, OMEGA, ZETA, strict=True):
        g = g + np.outer(shape, shape) / (s * s + 2 * zeta * omega * s + omega**2)
    return g


def state_space() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same as A, B, C."""
    parts = [np.block([[np.zeros((2, 2)), np.eye(2)], [np.zeros((2, 4))]])]
    drives, outputs = [np.vstack([np.zeros((2, 2)), np.linalg.inv(MASS)])], [np.eye(2, 4)]
    for shape, omega, zeta in zip(SHAPES, OMEGA, ZETA, strict=True):
        parts.append(np.array([[0, 1], [-(omega**2), -2 * zeta * omega]]))
        drives.append(np.vstack([np.zeros(2), shape]))
        outputs.append(np.outer(shape, [1, 0]))
    return linalg.block_diag(*parts), np.vstack(drives), np.hstack(outputs)


def noisy(g: np.ndarray, f: np.ndarray, share: float, seed: int = 0) -> xr.Dataset:
    """The response with circular noise of a share of each element, and its variance."""
    rng = np.random.default_rng(seed)
    variance = (share * np.abs(g)) ** 2
    unit = rng.normal(size=g.shape) + 1j * rng.normal(size=g.shape)
    return frequency_response(f, g + np.sqrt(variance / 2) * unit, estimator="t", variance=variance)


def test_sections_are_their_poles() -> None:
    poles = np.array([-1 + 5j, -1 - 5j, -3.0, -0.2, -7.0])
    sections = Sections.of_poles(poles)
    np.testing.assert_allclose(np.sort_complex(sections.poles()), np.sort_complex(poles))
    assert sections.order == 5
    x = 1j * np.array([0.3, 2.0, 9.0])
    coefficients = np.array([0.4, -1.2, 2.0, 0.3, 0.7])
    zeros = sections.zeros(coefficients, 1.5)
    expected = 1.5 * np.prod(x[:, None] - zeros, axis=1) / np.prod(x[:, None] - poles, axis=1)
    np.testing.assert_allclose(sections.basis(x) @ coefficients + 1.5, expected, rtol=1e-12)
    # Two equal real poles are a section like any other; complex steps check the slopes.
    section = Sections(np.array([[2.0, 1.0]]), np.array([0.5]))
    np.testing.assert_allclose(section.poles(), [-1, -1, -0.5])
    numerator = np.array([0.3, 0.7, 1.1])
    slopes = section.slopes(x, numerator)
    for k in range(3):
        ends = []
        for sign in (1, -1):
            vector = section.vector.copy()
            vector[k] += sign * 1e-5
            ends.append(Sections.of_vector(vector).basis(x) @ numerator)
        np.testing.assert_allclose(slopes[:, k], (ends[0] - ends[1]) / 2e-5, rtol=1e-8)


@pytest.mark.parametrize("step", [None, 1e-3])
def test_poles_outside_are_mirrored(step: float | None) -> None:
    domain = Domain(10.0, step)
    out = domain.from_continuous(np.array([2 + 30j, 2 - 30j, -1 + 5j, -1 - 5j]))
    assert not domain.stable(out)
    back = domain.stabilized(out)
    assert domain.stable(back)
    rate, _ = domain.rate(back)
    np.testing.assert_allclose(rate, [-2 + 30j, -2 - 30j, -1 + 5j, -1 - 5j], rtol=1e-9)


def test_one_relocation_finds_the_poles_of_exact_data() -> None:
    """The linear problem is then solved exactly, from the true poles and from others."""
    domain = Domain(100.0, None)
    x = domain.points(LINES)
    g = continuous(LINES).reshape(-1, 4)
    problem = Weighted(x, g, 1 / np.abs(g), np.stack([1 / x, 1 / x**2], axis=1), np.ones(g.shape))
    poles = OMEGA * (-ZETA + 1j * np.sqrt(1 - ZETA**2)) / 100
    poles = np.concatenate([poles, poles.conj()])
    for start in (poles, poles * 1.2, poles.real * 3 + 1.1j * poles.imag):
        found = relocated(problem, Sections.of_poles(start))
        np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(poles), rtol=1e-6)


def test_projected_jacobian_gives_the_gradient_of_the_loss() -> None:
    """J^T r is half the slope of the least loss over residues, here by central differences."""
    response = noisy(continuous(LINES), LINES, 0.05)
    model = fit_rational(response, 6, integrators=2)
    problem = model.problem
    moved = model.sections.vector * (1 + 0.01 * np.arange(1, 7))
    solved = problem.residues(Sections.of_vector(moved))
    gradient = (
        projected_jacobian(problem, Sections.of_vector(moved), solved).T @ solved.left.ravel()
    )
    for k in range(6):
        step = 1e-6 * abs(moved[k])
        ends = []
        for sign in (1, -1):
            vector = moved.copy()
            vector[k] += sign * step
            ends.append(problem.residues(Sections.of_vector(vector)).loss)
        assert gradient[k] == pytest.approx((ends[0] - ends[1]) / (4 * step), rel=1e-5)


@pytest.mark.parametrize("step", [None, 5e-4])
def test_exact_responses_come_back(step: float | None) -> None:
    g = continuous(LINES)
    if step is not None:
        a, b, c = state_space()
        a, b, c, d, _ = signal.cont2discrete((a, b, c, np.zeros((2, 2))), step)
        z = np.exp(2j * np.pi * LINES * step)
        g = np.stack([c @ np.linalg.solve(s * np.eye(10) - a, b) + d for s in z])
    model = fit_rational(noisy(g, LINES, 1e-10), 6, integrators=2, sample_time_s=step)
    assert model.status == "converged" and model.stable and not model.warnings
    modes = model.modes()
    np.testing.assert_allclose(modes["frequency_hz"], OMEGA / (2 * np.pi), rtol=1e-8)
    np.testing.assert_allclose(modes["damping_ratio"], ZETA, rtol=1e-6)
    np.testing.assert_allclose(model.response(LINES)["response"].values / g, 1.0, atol=1e-8)
    whole = realize(model)
    np.testing.assert_allclose(whole.response(LINES)["response"].values / g, 1.0, atol=1e-6)
    # The least order: four states of 1/s^2 and two for each mode.
    least = realize(model, rank_tolerance=1e-6)
    assert least.order == 10
    np.testing.assert_allclose(least.response(LINES)["response"].values / g, 1.0, atol=1e-6)
    system = least.to_control()
    at = 2j * np.pi * LINES[:3] if step is None else np.exp(2j * np.pi * LINES[:3] * step)
    np.testing.assert_allclose(np.moveaxis(system(at), 2, 0) / g[:3], 1.0, atol=1e-6)
    assert (least.to_scipy().dt or None) == step


@pytest.mark.parametrize("step", [None, 0.004])
def test_zeros_are_where_the_element_is_zero(step: float | None) -> None:
    """Oracle: SciPy's filter design; two outputs and inputs that share their poles."""
    poles = np.array([-1 + 40j, -3 + 90j, -0.5 + 15j])
    zeros = np.array([[[-1, 30], [-2, 70], [-0.3, 10]], [[-2, 35], [-1, 80], [-1, 12]]])
    zeros = zeros[..., 0] + 1j * zeros[..., 1]
    poles, zeros = (np.concatenate([x, x.conj()], axis=-1) for x in (poles, zeros))
    s = 2j * np.pi * LINES
    if step is not None:
        poles, zeros, s = (np.exp(step * x) for x in (poles, zeros, s))
    gain = np.array([[1.0, -2.0], [3.0, 0.5]])
    g = np.empty((len(s), 2, 2), complex)
    for i, j in np.ndindex(2, 2):
        top, bottom = gain[i, j] * np.poly(zeros[(i + j) % 2]).real, np.poly(poles).real
        _, g[:, i, j] = (
            signal.freqs(top, bottom, s.imag)
            if step is None
            else signal.freqz(top, bottom, np.angle(s))
        )
    response = frequency_response(LINES, g, estimator="t")
    model = fit_rational(response, 6, direct=True, weighting="relative", sample_time_s=step)
    for i, j in np.ndindex(2, 2):
        found = model.zeros(i + 1, j + 1)
        for zero in zeros[(i + j) % 2]:
            assert np.min(np.abs(found - zero)) < 1e-6 * abs(zero)


def test_poles_are_those_of_adaptive_antoulas_anderson() -> None:
    """SciPy's AAA, one element at a time, as an independent rational fit; a direct term."""
    s = 2j * np.pi * LINES
    g = 0.5 + sum(
        1.0 / (s * s + 2 * z * w * s + w * w) * w**2 for w, z in zip(OMEGA, ZETA, strict=True)
    )
    both = np.concatenate([s, s.conj()])
    other = interpolate.AAA(both, np.concatenate([g, g.conj()]), rtol=1e-12)
    response = frequency_response(LINES, g[:, None, None], estimator="t")
    model = fit_rational(response, 6, direct=True, weighting="relative")
    assert model.direct[0, 0] == pytest.approx(0.5, abs=1e-9)
    poles = other.poles()
    for pole in model.poles:
        assert np.min(np.abs(poles - pole)) < 1e-6 * abs(pole)


def test_uncertainty_is_the_scatter_and_the_loss_a_chi_square() -> None:
    """60 realizations. Poles: six coefficients, mean of the whitened squared error
    6 +- 3 sqrt(12 / 60) = 1.4. Loss over its degrees of freedom (about 1900): 1 +- 3 *
    sqrt(2 / 1900 / 60) = 0.013. Response: |dG|^2 over its variance has mean one; lines
    are correlated within a run, so count about 20 (unknowns by element) in each."""
    g = continuous(LINES)
    exact = fit_rational(noisy(g, LINES, 1e-10), 6, integrators=2)
    distances, losses, discs, white = [], [], [], []
    for seed in range(60):
        model = fit_rational(noisy(g, LINES, 0.02, seed), 6, integrators=2)
        truth = exact.modes()
        distances.append(mode_distance(model, truth))
        tests = model.residual_tests()
        losses.append(tests.attrs["reduced_loss"])
        white.append(tests["whiteness_p"].values)
        found = model.response(LINES)
        discs.append(np.mean(np.abs(found["response"].values - g) ** 2 / found["variance"].values))
    assert np.mean(distances) == pytest.approx(6.0, abs=1.4)
    assert np.mean(losses) == pytest.approx(1.0, abs=0.013)
    assert np.mean(discs) == pytest.approx(1.0, abs=0.12)
    # p-values of residuals that are white are uniform: mean 1/2, deviation 1/sqrt(12 * 240).
    assert np.mean(white) == pytest.approx(0.5, abs=4 / np.sqrt(12 * 240))


def mode_distance(model: RationalModel, truth: xr.Dataset) -> float:
    """Squared errors of frequencies and dampings in their standard errors, summed."""
    modes = model.modes()
    pairs = (("frequency_hz", "frequency_std_hz"), ("damping_ratio", "damping_std"))
    return float(sum(np.sum(((modes[n] - truth[n]) / modes[s]) ** 2) for n, s in pairs))


def of_few(response: xr.Dataset, freedom: float) -> xr.Dataset:
    return response.assign_attrs(degrees_of_freedom=freedom)


def of_three(g: np.ndarray, seed: int) -> xr.Dataset:
    """Mean of three realizations and its sample variance; every other line has 9 times more."""
    rng = np.random.default_rng([3, seed])
    jagged = np.where(np.arange(len(g)) % 2, 3.0, 1 / 3)[:, None, None]
    parts = rng.normal(size=(2, 3, *g.shape)) * np.sqrt(1.5 * jagged) * 0.02
    error = (parts[0] + 1j * parts[1]) * np.abs(g)
    mean = error.mean(axis=0)
    variance = np.mean(np.abs(error - mean) ** 2, axis=0) / 2
    attrs = {"degrees_of_freedom": 2}
    return frequency_response(LINES, g + mean, estimator="t", variance=variance, attrs=attrs)


def test_three_realizations_make_honest_uncertainty() -> None:
    """As above, with variances of two degrees of freedom: weighed by their own, lines made the
    distance 32 and the loss 1.9. Neighbours resemble each other badly, which costs precision but
    no honesty: with the pooled variance the distance were 10 and the loss 1.7. 20 runs: 6 +- 3
    sqrt(12 / 20) = 2.3; the loss, half of whose terms count and whose yardstick is uncertain
    too, 1 +- 3 sqrt(2 (2 + 1) / 1900 / 20) = 0.04."""
    g = continuous(LINES)
    truth = fit_rational(noisy(g, LINES, 1e-10), 6, integrators=2).modes()
    distances, losses, chances, discs, warned = [], [], [], [], 0
    for seed in range(20):
        model = fit_rational(of_three(g, seed), 6, integrators=2)
        distances.append(mode_distance(model, truth))
        attrs = model.residual_tests().attrs
        losses.append(attrs["reduced_loss"])
        chances.append(attrs["loss_p"])
        found = model.response(LINES)
        discs.append(np.mean(np.abs(found["response"].values - g) ** 2 / found["variance"].values))
        warned += bool(model.warnings)
    # 1.1 is 1.8 standard deviations of the loss, sqrt(2 (2 + 1) / 1900).
    assert warned <= 4
    assert np.mean(distances) == pytest.approx(6.0, abs=2.3)
    assert np.mean(losses) == pytest.approx(1.0, abs=0.04)
    assert np.mean(chances) == pytest.approx(0.5, abs=4 / np.sqrt(12 * 20))
    assert np.mean(discs) == pytest.approx(1.0, abs=0.2)
    own = fit_rational(of_three(g, 0), 6, integrators=2, neighbours=0)
    assert any("own variance of 2 degrees" in text for text in own.warnings)


def test_own_weights_of_ten_degrees_are_put_right() -> None:
    """20 runs: distance 6 +- 2.3 (7.5 without), loss 1 +- 3 sqrt(2 10 / 8 / 1900 / 20) = 0.024 (1.11
    without), p-values of mean 1/2 +- 4 sqrt(1 / 12 / 20)."""
    g = continuous(LINES)
    truth = fit_rational(noisy(g, LINES, 1e-10), 6, integrators=2).modes()
    distances, losses, chances = [], [], []
    for seed in range(20):
        rng = np.random.default_rng([11, seed])
        data = noisy(g, LINES, 0.02, seed)
        scatter = rng.gamma(10.0, 0.1, g.shape)
        data = of_few(data.assign(variance=data["variance"] * scatter), 10.0)
        model = fit_rational(data, 6, integrators=2, neighbours=0)
        distances.append(mode_distance(model, truth))
        attrs = model.residual_tests().attrs
        losses.append(attrs["reduced_loss"])
        chances.append(attrs["loss_p"])
    assert np.mean(distances) == pytest.approx(6.0, abs=2.3)
    assert np.mean(losses) == pytest.approx(1.0, abs=0.024)
    assert np.mean(chances) == pytest.approx(0.5, abs=4 / np.sqrt(12 * 20))


def test_orders_are_judged_without_a_bound_on_the_weights() -> None:
    """One degree of freedom: the loss has no mean, but residual powers still compare."""
    data = of_few(noisy(continuous(LINES), LINES, 0.02), 1.0)
    found = rational_orders(data, [4, 6], integrators=2, neighbours=0)
    assert np.isfinite(found["bic"]).all() and found.attrs["best_bic"] == 6


def test_one_direction_for_each_mode_is_refitted() -> None:
    """Rank one: 10 states instead of 16, and the loss grows by the saved parameters only, each
    one on average."""
    g = continuous(LINES)
    model = fit_rational(noisy(g, LINES, 0.02, 3), 6, integrators=2)
    least = realize(model, rank=1)
    assert least.order == 10 and least.status == "converged"
    # The residue of a mode, 2 x 2 complex, has 8 numbers, of rank one 6: two saved for each.
    assert -1e-6 <= least.loss - model.loss < 6 + 4 * np.sqrt(12)
    # It is a minimum: to first order no entry of C or B lowers the loss.
    scale, x = model.domain.scale_rad_s, model.problem.x
    for name in ("b", "c"):
        for place in ((4, 0), (7, 1)):
            ends = []
            for sign in (1, 0, -1):
                b, c = least.b / scale, least.c.copy()
                entry = b if name == "b" else c.T
                entry[place] += 1e-2 * sign * np.abs(entry[place[0]]).max()
                g = evaluate(least.a / scale, b, c, least.d, x)
                left = model.problem.weight * (g.reshape(len(x), -1) - model.problem.values)
                ends.append(np.sum(np.abs(left) ** 2))
            assert abs(ends[0] - ends[2]) < 0.05 * (ends[0] + ends[2] - 2 * ends[1])
    cut = realize(model, rank=2)
    assert cut.order == 16 and cut.status == "exact"


def test_orders_are_judged_and_too_low_ones_show_it() -> None:
    g = continuous(LINES)
    table = rational_orders(noisy(g, LINES, 0.02), (4, 6, 8), integrators=2)
    assert table.attrs["best_bic"] == 6
    assert table["reduced_loss"].values[0] > 100 and table["reduced_loss"].values[1] < 1.1
    low = fit_rational(noisy(g, LINES, 0.02), 4, integrators=2)
    tests = low.residual_tests()
    assert tests.attrs["loss_p"] < 1e-9 and (tests["whiteness_p"] < 1e-9).all()


def test_stability_is_kept_or_let_go() -> None:
    """A response of an unstable pair: kept stable it cannot be met, let go it is."""
    s = 2j * np.pi * LINES
    g = 1 / (s * s - 2 * 0.02 * OMEGA[0] * s + OMEGA[0] ** 2)
    response = noisy(g[:, None, None], LINES, 1e-6)
    free = fit_rational(response, 2, stable=False)
    assert not free.stable and free.modes()["damping_ratio"].values[0] == pytest.approx(-0.02, 1e-4)
    kept = fit_rational(response, 2)
    assert kept.stable and kept.loss > 1e6 * free.loss
    # A real pole outside, a start just inside: the search alone, let go, would cross.
    g = 1 / (s - 2 * np.pi * 5)
    free = fit_rational(noisy(g[:, None, None], LINES, 1e-3), 1, stable=False)
    assert free.poles[0].real == pytest.approx(2 * np.pi * 5, rel=1e-3)
    start = Sections.of_poles(free.domain.from_continuous(np.array([-0.5 + 0j])))
    for stable in (True, False):
        found, _, _ = _searched(free.problem, start, free.domain, stable, 60)
        assert free.domain.stable(found.poles()) is stable


def test_search_that_runs_out_says_so() -> None:
    model = fit_rational(noisy(continuous(LINES), LINES, 0.02), 6, integrators=2, max_iterations=1)
    assert model.status == "not_converged" and "limit" in model.warnings[0]


@lru_cache(maxsize=1)
def measured() -> tuple[Robot, PeriodicRecords]:
    """Four realizations of the thesis's design, with the ripple of Table 8.1 and sensor noise."""
    robot = load_robot("irb6600_like")
    design = Design("T2", square=True)
    refs = np.concatenate([references(robot, design, 0, r) for r in range(4)])
    n = refs.shape[1]
    run = simulate_batch(
        robot,
        np.tile(refs, (1, 2, 1)),
        effects=ripple(robot),
        noise_seed=1,
        model="linear",
        threads=1,
    )
    u, y = (
        run[name].values[:, n:].reshape(12, 1, n, 3) for name in ("torque_cmd_nm", "position_rad")
    )
    records = PeriodicRecords(robot.sample_time_s, u, y, np.arange(10, 401), output_unit="rad")
    return robot, records


def test_robot_is_recovered_at_the_noise_of_the_thesis() -> None:
    """Five modes lie in the band, of seven; friction and gravity below it look like 1/s^2. At
    this noise the order is told by the residuals: white at 10 poles, not at 8."""
    robot, records = measured()
    response = logarithmic_mean(records)
    f = response["frequency_hz"].values
    options = {"integrators": 2, "sample_time_s": robot.sample_time_s}
    model = fit_rational(response, 10, **options)
    assert model.status == "converged" and model.stable
    modes, truth = model.modes(), robot.modes()
    inside = truth.where((truth["frequency_hz"] > 5) & (truth["frequency_hz"] < 41), drop=True)
    np.testing.assert_allclose(modes["frequency_hz"], inside["frequency_hz"], rtol=2e-3)
    np.testing.assert_allclose(modes["damping_ratio"], inside["damping_ratio"], rtol=0.25)
    exact = robot.zoh_response(f).values
    error = np.abs(model.response(f)["response"].values / exact - 1)
    raw = np.abs(response["response"].values / exact - 1)
    # A hundred and fifty unknowns for 391 * 18 numbers: much nearer than the data.
    assert np.median(error) < np.median(raw) / 3
    tests = model.residual_tests()
    assert tests["whiteness_p"].min() > 1e-3
    # Four realizations: the variance itself is known to a third only.
    assert 0.7 < tests.attrs["reduced_loss"] < 1.3
    low = fit_rational(response, 8, **options).residual_tests()
    assert low["whiteness_p"].min() < 1e-9 and low.attrs["reduced_loss"] > 2


def test_residuals_show_the_bias_of_an_estimate() -> None:
    """Y U^-1 over all realizations is biased where U is weak: no order makes its residuals white."""
    robot, records = measured()
    model = fit_rational(mfrf(records), 10, integrators=2, sample_time_s=robot.sample_time_s)
    assert (model.residual_tests()["whiteness_p"] < 1e-3).all()


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda r: fit_rational(r, -1), "order: expected a whole number from 0"),
        (lambda r: fit_rational(r, 0), "at least one pole"),
        (lambda r: fit_rational(r, 2, integrators=3), "integrators"),
        (lambda r: fit_rational(r, 2, weighting="log"), "weighting"),
        (lambda r: fit_rational(r.drop_vars("variance"), 2), "expected a variance"),
        (lambda r: fit_rational(r.assign(variance=r["variance"] * np.nan), 2), "positive variance"),
        (lambda r: fit_rational(r, 2, neighbours=-4), "even number from 4"),
        (lambda r: fit_rational(r, 2, neighbours=5), "even number from 4"),
        (lambda r: fit_rational(r, 2, neighbours=8), "expected a response with degrees_of"),
        (lambda r: fit_rational(r, 2, neighbours=8, weighting="relative"), "weighting='relative'"),
        (lambda r: fit_rational(of_few(r, 0.0), 2), "degrees_of_freedom: expected positive"),
        (lambda r: fit_rational(of_few(r, 2.0), 2, neighbours=300), "fewer than the 240 lines"),
        (lambda r: fit_rational(r, 2, sample_time_s=-1.0), "sample_time_s"),
        (lambda r: fit_rational(r, 2, sample_time_s=0.1), "Nyquist"),
        (lambda r: fit_rational(r.isel(frequency_hz=[0]), 4), "more than 4 lines"),
        (lambda r: fit_rational(r, 2, start_rad_s=[-1 + 2j, -1 + 2j]), "conjugation"),
        (lambda r: fit_rational(r["response"], 2), "expected a Dataset"),
        (lambda r: rational_orders(r, []), "orders"),
        (lambda r: rational_orders(r, [500]), "more than"),
        (lambda r: realize(fit_rational(r, 2), rank=0), "rank"),
        (lambda r: realize(fit_rational(r, 2), rank_tolerance=2.0), "rank_tolerance"),
        (lambda r: fit_rational(r, 2).residual_tests(200), "lags"),
        (lambda r: fit_rational(r, 2).zeros(), "zeros: expected a model with a direct term"),
        (lambda r: fit_rational(r, 2, direct=True, integrators=1).zeros(), "got 1 integrators"),
        (lambda r: fit_rational(r, 2, direct=True).zeros(3), "output: expected at most"),
        (lambda r: fit_rational(r, 2, direct=True).zeros(1, 0), "input_: expected a whole"),
    ],
)
def test_misuse_is_named(call, words: str) -> None:
    with pytest.raises(InputError, match=words):
        call(noisy(continuous(LINES), LINES, 0.1))
