"""Direct, indirect and joint methods, and their expected errors: identities, oracles, recovery, misuse."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

import closed_loop_data as closed
from axisight import frf
from axisight.blackbox import (
    StateSpaceModel,
    arx,
    asymptotic_variance,
    etfe_bias_bound,
    etfe_variance,
    expected_errors,
    identify_closed_loop,
    indirect_response,
    input_spectra,
    limiting_model,
    noise_model_bias,
    polynomial_model,
    wrong_controller_bias,
)
from axisight.blackbox.closed_loop._covariance import joint_covariance
from axisight.blackbox.closed_loop.controller import plant_of_closed_loop, plant_of_joint
from axisight.blackbox.prediction_error.state_space import (
    matrices_of,
    problem_of,
    state_space_pem,
)
from axisight.errors import InputError
from axisight.frf.response import frequency_response
from axisight.records.experiment import Experiment
from axisight.records.periodic import PeriodicRecords

LINES = np.linspace(0.01, 0.49, 25)
GRID = np.linspace(0, 0.5, 801)
PLANT = closed.ratio(closed.B, closed.F, LINES)[:, None, None]


def on_grid(frequency=GRID):
    """G_0, H_0 and F_y."""
    return (
        closed.ratio(closed.B, closed.F, frequency),
        closed.ratio(closed.C, closed.D, frequency),
        closed.ratio(closed.P, closed.Q, frequency),
    )


def matrix_loop(n: int, noise: float, seed: int):
    """Two inputs and outputs with a dynamic controller: experiment, controller and true plant."""
    rng = np.random.default_rng(seed)
    a = np.diag([0.9, 0.7, 0.5])
    b, c = (
        np.array([[1.0, 0.2], [-0.3, 0.8], [0.5, 0.5]]),
        np.array([[0.4, 0.3, -0.5], [0.1, 0.9, 0.4]]),
    )
    back = StateSpaceModel(
        1.0,
        np.array([[0.4]]),
        np.array([[0.3, -0.2]]),
        np.array([[0.1], [0.1]]),
        np.array([[0.08, 0.0], [0.02, 0.05]]),
        np.zeros((1, 2)),
        np.zeros((2, 2)),
    )
    x, w = np.zeros(3), np.zeros(1)
    u, y, r = np.zeros((n, 2)), np.zeros((n, 2)), rng.normal(size=(n, 2))
    for t in range(n):
        y[t] = c @ x + noise * rng.normal(size=2)
        u[t] = r[t] - back.c @ w - back.d @ y[t]
        w = back.a @ w + back.b @ y[t]
        x = a @ x + b @ u[t]
    z = np.exp(2j * np.pi * LINES)
    true = np.stack([c @ np.linalg.solve(s * np.eye(3) - a, b) for s in z])
    return Experiment(1.0, u, y, reference=r), back, true


def test_all_methods_are_exact_without_noise() -> None:
    x, controller, true = matrix_loop(600, 0.0, 3)
    found = identify_closed_loop(x, 3, controller=controller, closed_order=4)
    for name, estimate in found.estimates.items():
        g = estimate.response(LINES)["response"].values
        np.testing.assert_allclose(g, true, rtol=0, atol=1e-6 * np.abs(true).max(), err_msg=name)
    assert found.controller_mismatch.max() < 1e-12


def test_plants_are_the_responses() -> None:
    """The realizations agree with the algebra of responses, to rounding of nearly equal poles."""
    x, controller, _ = matrix_loop(1500, 0.1, 4)
    found = identify_closed_loop(x, 3, controller=controller)
    for estimate in found.estimates.values():
        g = estimate.response(LINES)["response"].values
        plant = estimate.plant.response(LINES)["response"].values
        np.testing.assert_allclose(plant, g, rtol=0, atol=1e-9 * np.abs(g).max())
    assert set(found.response(LINES)["approach"].values) == {"direct", "indirect", "joint"}


def test_methods_are_consistent_and_their_variances_are_the_scatter() -> None:
    """12 runs of 25 lines, of which some 6 are independent: the median of |error|^2 / variance is
    ln 2 of an exponential, +- 3 / sqrt(72) = 0.35. Single runs have heavy tails."""
    ratios = {"direct": [], "indirect": [], "joint": []}
    errors = {name: [] for name in ratios}
    for seed in range(12):
        x = closed.loop(1500, seed)
        found = identify_closed_loop(x, 3, controller=closed.CONTROLLER)
        for name, estimate in found.estimates.items():
            g = estimate.response(LINES)
            error = g["response"].values - PLANT
            errors[name].append(error)
            ratios[name].append(np.abs(error) ** 2 / g["variance"].values)
    for name, values in ratios.items():
        assert np.median(values) == pytest.approx(np.log(2), rel=0.35), name
        mean = np.mean(errors[name], axis=0)
        standard = np.std(errors[name], axis=0) / np.sqrt(12)
        # A complex mean has |mean|^2 = standard^2 on average; no line beyond 3.5 (chance 1e-4 each;
        # the spread of 12 runs is itself off by 20 %).
        assert np.max(np.abs(mean) / standard) < 3.5, name


def test_joint_covariance_of_one_model_is_its_own() -> None:
    """White errors at other lags add scatter only: 20 tapered lags of 4,000 samples, some 10 %."""
    x = closed.loop(4000, 3)
    model = state_space_pem(x, 3)
    both = joint_covariance([model], [[x]])
    f, slope = model.response_slopes(LINES)
    one, other = (
        np.einsum("fk,kl,fl->f", slope[:, 0, 0], c, slope[:, 0, 0].conj()).real
        for c in (model.covariance, both)
    )
    np.testing.assert_allclose(other, one, rtol=0.35)
    assert np.median(other / one) == pytest.approx(1.0, abs=0.15) and len(f) == 25


def test_joint_covariance_sees_errors_of_other_samples() -> None:
    """The second model sees the same records one sample later, so both have nearly the same error.

    The taper leaves 2 (1 - 20/21) = 0.095 of the variance in the difference; without other lags it is 2.
    """
    x = closed.loop(3001, 3)
    early = Experiment(1.0, x.input[1:], x.output[1:])
    late = Experiment(1.0, x.input[:-1], x.output[:-1])
    models = [state_space_pem(d, 3) for d in (early, late)]
    both = joint_covariance(models, [[early], [late]])
    slopes = [m.response_slopes(LINES)[1][:, 0, 0] for m in models]
    apart = np.concatenate([slopes[0], -slopes[1]], axis=1)
    difference = np.einsum("fk,kl,fl->f", apart, both, apart.conj()).real
    own = models[0].response(LINES)["variance"].values[:, 0, 0]
    assert np.median(difference / own) == pytest.approx(2 / 21, abs=0.1)


def test_slopes_of_every_approach_are_derivatives() -> None:
    """Central differences along random changes of all matrices of the fitted models."""
    x, controller, _ = matrix_loop(800, 0.1, 4)
    found = identify_closed_loop(x, 3, controller=controller)
    rng = np.random.default_rng(1)
    for name, estimate in found.estimates.items():
        ways = [rng.normal(size=len(m.covariance)) for m in estimate.models]

        def moved(step: float, estimate=estimate, ways=ways) -> np.ndarray:
            models = []
            for m, way in zip(estimate.models, ways, strict=True):
                layout = problem_of(m, []).layout
                y = layout.matrices(layout.vector(matrices_of(m)) + step * way)
                space = replace(m.model, a=y.a, b=y.b, c=y.c, d=y.d, k=y.k)
                models.append(replace(m, model=space))
            return replace(estimate, models=tuple(models))._slopes(LINES)[0]

        g, slope = estimate._slopes(LINES)
        exact = slope @ np.concatenate(ways)
        numeric = (moved(1e-6) - moved(-1e-6)) / 2e-6
        np.testing.assert_allclose(
            exact, numeric, rtol=0, atol=1e-5 * np.abs(numeric).max(), err_msg=name
        )
        assert g.shape == exact.shape


def test_realizations_undo_loops_with_direct_terms() -> None:
    """Random stable systems with direct terms everywhere, by the algebra of their responses."""
    rng = np.random.default_rng(5)

    def system(n: int, p: int, m: int) -> StateSpaceModel:
        a = np.diag(rng.uniform(-0.8, 0.8, n))
        b, c, d = rng.normal(size=(n, m)), rng.normal(size=(p, n)), rng.normal(size=(p, m))
        return StateSpaceModel(1.0, a, b, c, d, np.zeros((n, p)), np.zeros((p, p)))

    def at(model: StateSpaceModel) -> np.ndarray:
        return model.response(LINES)["response"].values

    closed_, back = system(3, 2, 2), system(2, 2, 2)
    g = at(closed_) @ np.linalg.inv(np.eye(2) - at(back) @ at(closed_))
    np.testing.assert_allclose(at(plant_of_closed_loop(closed_, back)), g, rtol=0, atol=1e-9)
    y, u = system(3, 2, 2), system(2, 2, 2)
    np.testing.assert_allclose(
        at(plant_of_joint(y, u)), at(y) @ np.linalg.inv(at(u)), rtol=0, atol=1e-9
    )


def test_a_wrong_controller_is_noticed_and_its_bias_is_predicted() -> None:
    x = closed.loop(2000, 6, noise=0.05)
    wrong = signal.dlti(2 * closed.P, closed.Q, dt=1.0)
    found = identify_closed_loop(x, 3, controller=wrong)
    assert found.controller_mismatch[0] > 0.05
    assert "do not trust the indirect method" in found.warnings[0]
    table = found.table(LINES, PLANT)
    assert table["error"].sel(approach="indirect") > 10 * table["error"].sel(approach="joint")
    g, _, back = on_grid(LINES)
    bias = wrong_controller_bias(g, back, 2 * back)
    off = found.estimates["indirect"].response(LINES)["response"].values[:, 0, 0] - g
    # Noise moves the joint estimate by 1 % here.
    np.testing.assert_allclose(off, bias, rtol=0, atol=0.05 * np.abs(bias).max())


def test_reference_of_a_position_loop_is_filtered_by_the_controller() -> None:
    """u = F (r - y) is the loop u = F r - F y: the same data give the same models."""
    x = closed.loop(1500, 7)
    # F has a stable inverse, so some r gives this F r.
    r = signal.lfilter(closed.Q, closed.P, x.reference, axis=0)
    other = Experiment(1.0, x.input, x.output, reference=r)
    one = identify_closed_loop(x, 3, controller=closed.CONTROLLER)
    two = identify_closed_loop(other, 3, controller=closed.CONTROLLER, reference_at="output")
    for name in one.estimates:
        a, b = (k.estimates[name].response(LINES)["response"].values for k in (one, two))
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-5, err_msg=name)


def test_indirect_response_undoes_the_loop() -> None:
    """The inverse of G_c = G (I + F G)^-1; its variance against the scatter of many perturbed G_c."""
    rng = np.random.default_rng(1)
    shape = (4, 2, 2)
    g, f = (rng.normal(size=shape) + 1j * rng.normal(size=shape) for _ in range(2))
    loop = g @ np.linalg.inv(np.eye(2) + f @ g)
    variance = 1e-6 * rng.uniform(1, 2, size=shape)
    hz = np.arange(1.0, 5.0)
    found = indirect_response(
        frequency_response(hz, loop, estimator="x", variance=variance, input_unit="Nm"), f
    )
    np.testing.assert_allclose(found["response"], g, rtol=1e-9)
    moved = np.sqrt(variance / 2) * (
        rng.normal(size=(4000, *shape)) + 1j * rng.normal(size=(4000, *shape))
    )
    others = np.stack(
        [
            indirect_response(frequency_response(hz, loop + d, estimator="x"), f)["response"].values
            for d in moved[:400]
        ]
    )
    # 400 draws: 3 / sqrt(400) = 15 %.
    scatter = np.mean(np.abs(others - g) ** 2, axis=0)
    np.testing.assert_allclose(found["variance"], scatter, rtol=0.2)


def test_indirect_response_of_periodic_records() -> None:
    """Noise-free periodic records: `mfrf` from r to y, then the controller, is the plant."""
    n, lines = 256, np.arange(1, 100)
    rng = np.random.default_rng(2)
    spectrum = np.zeros(n // 2 + 1, complex)
    spectrum[lines] = np.exp(2j * np.pi * rng.random(len(lines)))
    period = np.fft.irfft(spectrum, n) * n / 20
    x = closed.loop(6 * n - closed.BEFORE, 1, 0.0, reference=np.tile(period, 6))
    last = slice(-n, None)
    # The signals repeat from the second half on; cut one period.
    records = PeriodicRecords(
        1.0,
        np.asarray(x.reference[last])[None, None],
        np.asarray(x.output[last])[None, None],
        lines,
    )
    through = frf.mfrf(records, quantity="position")
    _, _, back = on_grid(records.frequency_hz)
    found = indirect_response(through, back[:, None, None])
    truth = closed.ratio(closed.B, closed.F, records.frequency_hz)
    np.testing.assert_allclose(found["response"].values[:, 0, 0], truth, rtol=1e-6)


def test_bias_of_a_fixed_noise_model_is_that_of_the_thesis() -> None:
    """(3.62) for the magnitude; open loop and the true noise model have no bias."""
    g, h, back = on_grid()
    power = 0.25
    bias = noise_model_bias(g, back, np.ones_like(GRID), power, h, np.ones_like(h))
    by_reference, by_noise = input_spectra(g, back, np.ones_like(GRID), power * np.abs(h) ** 2)
    total = by_reference + by_noise
    wanted = power / total * by_noise / total * np.abs(h - 1) ** 2
    np.testing.assert_allclose(np.abs(bias) ** 2, wanted, rtol=1e-10)
    assert not noise_model_bias(g, back, np.ones_like(GRID), power, h, h).any()
    assert not noise_model_bias(g, 0 * back, np.ones_like(GRID), power, h, np.ones_like(h)).any()
    limit = frf.errors.spectral_analysis_limit(
        *(v[:, None, None] for v in (g, back, np.ones_like(g), power * np.abs(h) ** 2))
    )
    table = expected_errors(
        GRID,
        response=g,
        controller=back,
        reference_spectrum=np.ones_like(GRID),
        noise_variance=power,
        noise_model=h,
        order=10,
        n_samples=1000,
    )
    np.testing.assert_allclose(
        table["bias"].sel(approach="spectral"), limit[:, 0, 0] - g, atol=1e-12
    )
    assert not table["bias"].sel(approach=["direct", "indirect", "joint"]).any()


def test_output_error_tends_to_the_limiting_model() -> None:
    """(3.61): the mean of 8 estimates from 20,000 samples is within 4 standard errors of the limit,
    and the truth is not."""
    g, h, back = on_grid()
    power, ones = 0.0625, np.ones_like(GRID)
    by_reference, by_noise = input_spectra(g, back, ones, power * np.abs(h) ** 2)
    bias = noise_model_bias(g, back, ones, power, h, ones.astype(complex))
    limit = limiting_model(GRID, g + bias, by_reference + by_noise, nb=2, nf=2)
    assert limit.status == "converged"
    wanted = np.r_[limit.b[1:], limit.f[1:]]
    found = np.array(
        [polynomial_model(closed.loop(20000, s, 0.25), nf=2, nb=2).values for s in range(8)]
    )
    standard = found.std(axis=0, ddof=1) / np.sqrt(8)
    assert np.abs((found.mean(axis=0) - wanted) / standard).max() < 4
    assert np.abs((found.mean(axis=0) - closed.TRUTH[:4]) / standard).max() > 10
    # Four times the power: this limit has a second minimum, 16 % higher, near poles at 0.91 +- 0.13i.
    more = input_spectra(g, back, ones, 4 * power * np.abs(h) ** 2)
    bias = noise_model_bias(g, back, ones, 4 * power, h, ones.astype(complex))
    limit = limiting_model(GRID, g + bias, more[0] + more[1], nb=2, nf=2)
    np.testing.assert_allclose(limit.f, [1, -1.551, 0.843], atol=1e-3)
    exact = limiting_model(GRID, g, by_reference + by_noise, nb=2, nf=2)
    np.testing.assert_allclose(np.r_[exact.b[1:], exact.f[1:]], closed.TRUTH[:4], atol=1e-9)


def test_variance_of_high_orders_is_that_of_the_thesis() -> None:
    """(3.63) with ARX models of order 30: 60 runs of 15 lines that are nearly independent, so the mean
    ratio is 1 +- 3 / sqrt(900) = 0.1, and a loss of 2 n / N = 2 % of the samples to the fit."""
    n, count = 30, 3000
    f = LINES[5:20]
    g, h, back = on_grid(f)
    phi_v = 0.25 * np.abs(h) ** 2
    by_reference, _ = input_spectra(g, back, np.ones_like(f), phi_v)
    wanted = asymptotic_variance(n, count, phi_v, by_reference)
    found = [
        arx(closed.loop(count, s), na=n, nb=n).response(f)["response"].values[:, 0, 0]
        for s in range(60)
    ]
    ratio = np.mean(np.abs(np.array(found) - g) ** 2, axis=0) / wanted
    assert ratio.mean() == pytest.approx(1.05, abs=0.15)


def test_etfe_has_the_bias_and_variance_of_the_thesis() -> None:
    """(3.64), (3.65) in open loop: the bound holds at every line, and the variance is Phi_v / |U|^2."""
    n, runs = 512, 300
    rng = np.random.default_rng(3)
    u = rng.choice([-1.0, 1.0], size=n + closed.BEFORE)
    pulse = signal.lfilter(closed.B, closed.F, np.eye(1, 200)[0])
    clean = signal.lfilter(closed.B, closed.F, u)[closed.BEFORE :]
    spectrum = np.fft.rfft(u[closed.BEFORE :]) / np.sqrt(n)
    f = np.fft.rfftfreq(n)
    power = np.abs(spectrum) ** 2
    rest = np.abs(np.fft.rfft(clean) / np.sqrt(n) / spectrum - closed.ratio(closed.B, closed.F, f))
    assert np.all(rest < etfe_bias_bound(pulse, 1.0, power, n))
    e = 0.3 * rng.normal(size=(runs, n + closed.BEFORE))
    v = signal.lfilter(closed.C, closed.D, e, axis=1)[:, closed.BEFORE :]
    errors = np.fft.rfft(v, axis=1) / np.sqrt(n) / spectrum
    phi_v = 0.09 * np.abs(closed.ratio(closed.C, closed.D, f)) ** 2
    found, wanted = np.mean(np.abs(errors) ** 2, axis=0)[1:-1], etfe_variance(phi_v, power)[1:-1]
    # rho_2 of (3.65) from the autocovariance: a record of n samples sees it under a triangle.
    colour = signal.lfilter(closed.C, closed.D, np.eye(1, n)[0])
    auto = 0.09 * np.correlate(colour, colour, "full")[n - 1 :]
    lags = np.arange(1, n)
    seen = -2 / n * np.cos(2 * np.pi * np.outer(f, lags)) @ (lags * auto[1:])
    exact = wanted + seen[1:-1] / power[1:-1]
    # 255 lines of 300 runs: 3 / sqrt(76500) = 1 %, weighted by the spectrum.
    assert np.mean(found / exact) == pytest.approx(1.0, abs=0.02)
    np.testing.assert_allclose(exact, wanted, rtol=0.2)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda x: identify_closed_loop(x, 3), "controller: expected F_y"),
        (lambda x: identify_closed_loop(x, 3, using=["joint"]), "closed_order"),
        (lambda x: identify_closed_loop(x, 3, using=["two-stage"]), "using"),
        (lambda x: identify_closed_loop(x, 3, using=[]), "using: expected at least one"),
        (
            lambda x: identify_closed_loop(x, 3, controller=signal.dlti([1], [1, 0], dt=0.5)),
            "controller: expected the sample time",
        ),
        (
            lambda x: identify_closed_loop(
                Experiment(1.0, x.input, x.output), 3, controller=closed.CONTROLLER
            ),
            "a reference with 1 channels in experiment 1",
        ),
        (
            lambda x: identify_closed_loop(
                x, 3, controller=closed.CONTROLLER, reference_at="plant"
            ),
            "reference_at",
        ),
        (lambda x: input_spectra([1.0], [1.0], [-1.0], [1.0]), "reference_spectrum"),
        (lambda x: input_spectra([1.0], [1.0, 2.0], [1.0], [1.0]), "controller: expected 1"),
        (lambda x: limiting_model([0, 0.5], [1, 1], [1, 1], nb=2, nf=2), "more than 4 lines"),
        (lambda x: asymptotic_variance(0, 10, [1.0], [1.0]), "order"),
    ],
)
def test_misuse_is_named(call, words: str) -> None:
    with pytest.raises(InputError, match=words):
        call(closed.loop(200, 1))
