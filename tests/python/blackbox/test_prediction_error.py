"""ARMAX, Box-Jenkins and innovations models: identities, oracles, recovery, misuse."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

import blackbox_data as known
import closed_loop_data as closed
from axisight.blackbox import (
    armax,
    arx,
    box_jenkins,
    output_error,
    polynomial_model,
    residual_tests,
    state_space,
    state_space_pem,
)
from axisight.blackbox.prediction_error._innovations import InnovationsProblem, Layout, Matrices
from axisight.blackbox.prediction_error._row import RowOrders, RowProblem, polynomials
from axisight.errors import InputError
from axisight.records.experiment import Experiment

LINES = np.linspace(0.01, 0.49, 30)


def row_problem(transients: bool) -> tuple[RowProblem, np.ndarray]:
    """A problem with every polynomial, two inputs and two outputs, away from its minimum."""
    orders = RowOrders(
        1, np.array([1, 2]), np.array([2, 1]), np.array([1, 2]), np.array([1, 0]), 2, 1
    )
    e = known.arx_experiment(60, 0.5, 3)
    other = known.arx_experiment(40, 0.5, 4)
    problem = RowProblem(
        orders, [e.input, other.input], [e.output, other.output[:, ::-1]], transients
    )
    theta = np.r_[0.1, -0.5, 0.2, 0.4, 0.2, -0.6, 0.3, -0.3, 0.2, 0.3, -0.2, 0.4]
    assert len(theta) == orders.n_parameters
    return problem, theta


def central(function, theta: np.ndarray, k: int, step: float = 1e-5) -> np.ndarray:
    moved = np.zeros_like(theta)
    moved[k] = step
    return (function(theta + moved) - function(theta - moved)) / (2 * step)


@pytest.mark.parametrize("transients", [False, True])
def test_gradients_of_polynomials_are_exact(transients: bool) -> None:
    """Central differences are off by step^2 = 1e-10 times third derivatives of some 1e3 at most.

    With unknown pasts the Jacobian leaves out a part that is orthogonal to the errors, so only the
    gradient of the loss is compared.
    """
    problem, theta = row_problem(transients)
    slope, errors = problem.jacobian(theta), problem.residual(theta)
    for k in range(len(theta)):
        gradient = central(problem.loss, theta, k) / 2
        scale = np.linalg.norm(slope[:, k]) * np.linalg.norm(errors)
        assert abs(slope[:, k] @ errors - gradient) < 1e-7 * scale
        if not transients:
            numeric = central(problem.residual, theta, k)
            np.testing.assert_allclose(
                slope[:, k], numeric, rtol=0, atol=1e-6 * np.abs(numeric).max()
            )


def test_arx_and_output_error_are_special_cases() -> None:
    """ARX with free pasts drops the samples of its lags: the same equations as `arx`, exactly."""
    data = [known.arx_experiment(300, 0.3, 1), known.arx_experiment(200, 0.3, 2)]
    ours, theirs = polynomial_model(data, na=2, nb=2), arx(data, na=2, nb=2)
    assert ours.names == theirs.names and ours.status == "converged"
    np.testing.assert_allclose(ours.values, theirs.values, rtol=0, atol=1e-11)
    np.testing.assert_allclose(ours.covariance, theirs.covariance, rtol=0, atol=1e-12)
    np.testing.assert_allclose(ours.noise_covariance, theirs.noise_covariance, rtol=1e-10)
    e = known.output_error_experiment(400, 0.3, 3)
    ours = polynomial_model(e, nb=2, nf=2, initial="zero")
    theirs = output_error(e, nf=2, nb=2)
    np.testing.assert_allclose(ours.values, theirs.values, rtol=0, atol=1e-7)
    np.testing.assert_allclose(ours.covariance, theirs.covariance, rtol=1e-5)


def test_state_space_of_one_channel_is_armax_of_full_order() -> None:
    """Both sets hold the same models, so two searches in different coordinates end at one model.

    The searches stop at a relative change of 1e-10 of the step: responses agree to 1e-6.
    """
    x = closed.loop(1500, 1)
    one, other = armax(x, na=3, nb=3, nc=3), state_space_pem(x, 3)
    assert one.status == other.status == "converged"
    a, b = one.response(LINES), other.response(LINES)
    np.testing.assert_allclose(a["response"], b["response"], rtol=0, atol=1e-5)
    np.testing.assert_allclose(a["variance"], b["variance"], rtol=1e-3)
    np.testing.assert_allclose(one.noise_covariance, other.noise_covariance, rtol=1e-8)
    np.testing.assert_allclose(
        one.noise_response(LINES), other.noise_response(LINES), rtol=0, atol=1e-4
    )


def test_likelihood_agrees_with_statsmodels() -> None:
    """Oracle: statsmodels 0.15.0, exact Gaussian likelihood of a regression with ARMA(2,2) errors.

    ``SARIMAX(y, exog=[u(t-1), u(t-2)], order=(2, 0, 2)).fit()`` on these data. The conditional
    likelihood here treats the first two samples as free: parameters move by some 1/n = 2e-4, standard
    errors by 2 % (statsmodels takes its own from the outer product of gradients).
    """
    rng = np.random.default_rng(7)
    e, u = rng.normal(size=5000), rng.normal(size=5000)
    late = [np.r_[np.zeros(k), u[:-k]] for k in (1, 2)]
    y = signal.lfilter([1, 0.6, 0.2], [1, -1.2, 0.5], e) + 0.8 * late[0] - 0.3 * late[1]
    model = box_jenkins(Experiment(1.0, u, y), nb=2, nc=2, nd=2, nf=0)
    assert model.names == ("B11[1]", "B11[2]", "C1[1]", "C1[2]", "D1[1]", "D1[2]")
    wanted = [0.8053871, -0.30139087, 0.61082069, 0.20492908, -1.19833549, 0.49467]
    std = [0.00876556, 0.00876793, 0.02608183, 0.02205942, 0.02376454, 0.02071068]
    np.testing.assert_allclose(model.values, wanted, rtol=0, atol=5e-4)
    np.testing.assert_allclose(model.std, std, rtol=0.04)
    # statsmodels divides by n, this model by n less parameters and pasts: 8 of 5000.
    assert model.noise_covariance[0, 0] == pytest.approx(0.98745, rel=3e-3)


def test_standard_errors_are_the_cramer_rao_bound() -> None:
    """Closed form for y + a y(t-1) = e + c e(t-1), Box, Jenkins and Reinsel, section 7.2.6:
    var a = (1 - a c)^2 (1 - a^2) / ((c - a)^2 n), and c with 1 - c^2. Their estimate from 20,000
    samples has the parameters' error of 1 %, squared in the formula: within 5 %."""
    a, c, n = -0.8, 0.4, 20000
    e = np.random.default_rng(2).normal(size=n)
    x = Experiment(1.0, e, signal.lfilter([1, c], [1, a], e))
    model = armax(x, na=1, nb=0, nc=1)
    bound = (1 - a * c) / abs(c - a) * np.sqrt(np.array([1 - a * a, 1 - c * c]) / n)
    np.testing.assert_allclose(model.std, bound, rtol=0.05)
    assert np.abs(model.values - [a, c]).max() < 4 * bound.max()


def test_standard_errors_are_the_scatter_in_closed_loop() -> None:
    """Whitened squared errors of 6 parameters over 50 runs have the mean 6 +- 3 sqrt(2 * 6 / 50)
    = 1.47. A model with white noise is off by many standard errors."""
    distances, wrong = [], []
    for seed in range(50):
        x = closed.loop(600, seed)
        model = box_jenkins(x, nb=2, nc=1, nd=1, nf=2)
        error = model.values - closed.TRUTH
        distances.append(error @ np.linalg.solve(model.covariance, error))
        if seed < 15:
            wrong.append(output_error(x, nf=2, nb=2, skip=30).values[:2] - closed.TRUTH[:2])
    assert np.mean(distances) == pytest.approx(6.0, abs=1.47)
    off = np.mean(wrong, axis=0) / np.std(wrong, axis=0) * np.sqrt(len(wrong))
    assert np.abs(off).max() > 10


def test_pasts_of_several_experiments_are_estimated() -> None:
    """Pieces of one motion without noise: exact with free pasts, wrong from rest."""
    x = closed.loop(400, 5, noise=0.0)
    pieces = [Experiment(1.0, x.input[s], x.output[s]) for s in (slice(0, 150), slice(220, 400))]
    free = polynomial_model(pieces, nb=2, nf=2)
    # Errors at rounding: 1e-15 of the signal, times the condition of 1e3.
    np.testing.assert_allclose(free.values, closed.TRUTH[:4], rtol=0, atol=1e-9)
    rest = polynomial_model(pieces, nb=2, nf=2, initial="zero")
    assert np.abs(rest.values - closed.TRUTH[:4]).max() > 1e-3
    np.testing.assert_allclose(free.predict(pieces[1]), pieces[1].output, atol=1e-9)
    np.testing.assert_allclose(
        free.simulate(pieces[0])[60:], pieces[0].output[60:], atol=2e-2 * x.output.std()
    )


def test_all_forms_of_a_polynomial_model_agree() -> None:
    """Response, realization and prediction describe one model, with A, B/F and C/D at once."""
    data = known.arx_experiment(400, 0.4, 6)
    model = polynomial_model(
        data, na=[[1, 0], [1, 1]], nb=[[2, 1], [1, 2]], nf=[[1, 0], [0, 2]], nc=1, nd=[1, 0]
    )
    space = model.to_state_space()
    np.testing.assert_allclose(
        model.response(LINES)["response"], space.response(LINES)["response"], atol=1e-10
    )
    rows = [RowProblem(row, [data.input], [data.output], False) for row in model.orders]
    ends = np.cumsum([row.n_parameters for row in model.orders])[:-1]
    errors = [r.residual(t) for r, t in zip(rows, np.split(model.values, ends), strict=True)]
    np.testing.assert_allclose(
        space.predict(data), data.output - np.stack(errors, axis=1), rtol=0, atol=1e-9
    )
    h = model.noise_response(LINES)
    z = np.exp(2j * np.pi * LINES * known.T)
    inner = z[:, None, None] * np.eye(space.order) - space.a
    np.testing.assert_allclose(
        h, space.c @ np.linalg.solve(inner, space.k[None]) + np.eye(2), atol=1e-10
    )


def test_slopes_of_responses_are_derivatives() -> None:
    """Central differences of the response in every parameter, through the stored polynomials."""
    model = polynomial_model(
        known.arx_experiment(400, 0.4, 6), na=1, nb=2, nf=[[1, 0], [0, 1]], nc=1
    )
    ends = np.cumsum([row.n_parameters for row in model.orders])[:-1]

    def response(theta: np.ndarray) -> np.ndarray:
        parts = np.split(theta, ends)
        found = tuple(polynomials(o, t) for o, t in zip(model.orders, parts, strict=True))
        return replace(model, values=theta, polynomials=found).response_slopes(LINES)[0]

    _, slope = model.response_slopes(LINES)
    for k in range(len(model.values)):
        numeric = central(response, model.values, k)
        np.testing.assert_allclose(slope[..., k], numeric, rtol=0, atol=1e-6 * np.abs(slope).max())


def test_armax_of_two_outputs_recovers_the_truth() -> None:
    """ARX data are ARMAX data with C = 1: 20 parameters, none beyond 4 deviations (chance 1e-3)."""
    model = armax(known.arx_experiment(3000, 0.3, 8), na=2, nb=2, nc=1)
    truth = {
        **{
            f"A{i + 1}{j + 1}[{k + 1}]": (known.A1, known.A2)[k][i, j]
            for i in (0, 1)
            for j in (0, 1)
            for k in (0, 1)
        },
        **{
            f"B{i + 1}{j + 1}[{k + 1}]": (known.B1, known.B2)[k][i, j]
            for i in (0, 1)
            for j in (0, 1)
            for k in (0, 1)
        },
        "C1[1]": 0.0,
        "C2[1]": 0.0,
    }
    wanted = np.array([truth[name] for name in model.names])
    assert np.abs((model.values - wanted) / model.std).max() < 4
    mix = 0.09 * known.MIX.T @ known.MIX
    np.testing.assert_allclose(model.noise_covariance, mix, rtol=0, atol=0.01)
    assert model.residual_tests(known.arx_experiment(3000, 0.3, 11)).white
    assert model.stable and len(model.poles) == 4


def test_residual_tests_know_of_feedback_within_the_sample() -> None:
    """The controller acts on e(t) within the sample, so u(t) follows e(t) for the true model too."""
    x = closed.loop(4000, 11)
    model = box_jenkins(x, nb=2, nc=1, nd=1, nf=2)
    assert model.residual_tests(x).advice() == ()
    left = (x.output - model.predict(x))[3:]
    assert not residual_tests(left, x.input[3:]).independent


@pytest.mark.parametrize("transients", [False, True])
def test_gradients_of_state_space_are_exact(transients: bool) -> None:
    """As for polynomials, with third derivatives of 1e4 as the modes are slow; and errors do not move
    along changes of coordinates."""
    e = known.modal_experiment(60, 0.3, 5, process=0.3)
    start = state_space(known.modal_experiment(2000, 0.3, 5, process=0.3), 4, window=15).model
    layout = Layout(4, 2, 2, True, True)
    x = Matrices(start.a, start.b, start.c, start.d + 0.1, start.k)
    theta = layout.vector(x)
    weight = np.array([[1.0, 0.2], [0.0, 0.7]])
    problem = InnovationsProblem(layout, [e.input], [e.output], weight, transients)
    slope, errors = problem.jacobian(theta), problem.residual(theta)
    for k in range(len(theta)):
        gradient = central(lambda t: np.sum(problem.residual(t) ** 2), theta, k) / 2
        scale = np.linalg.norm(slope[:, k]) * np.linalg.norm(errors)
        assert abs(slope[:, k] @ errors - gradient) < 1e-6 * scale
        if not transients:
            numeric = central(problem.residual, theta, k)
            np.testing.assert_allclose(
                slope[:, k], numeric, rtol=0, atol=1e-6 * np.abs(numeric).max()
            )
    ways = layout.directions(x)
    still = np.linalg.svd(ways)[0][:, ways.shape[1] :]
    assert still.shape[1] == 16
    assert np.abs(slope @ still).max() < 1e-10 * np.abs(slope).max()
    turned = x.balanced()
    again = problem.residual(layout.vector(turned))
    np.testing.assert_allclose(again, errors, rtol=0, atol=1e-8 * np.abs(errors).max())


def test_variance_of_state_space_responses_is_the_scatter() -> None:
    """Mean of |error|^2 over variance: 1. 25 runs of 24 elements, of which some
    10 are independent: 1 +- 3 / sqrt(250) = 0.19."""
    a, b, c = known.modal_system()
    truth = known.response(a, b, c, 0, LINES[::5], 1.0)
    ratios = []
    for seed in range(25):
        x = known.modal_experiment(800, 0.3, seed, feedback=0.02, process=0.3)
        model = state_space_pem(x, 4, window=12)
        found = model.response(LINES[::5])
        error = np.abs(found["response"].values - truth) ** 2
        ratios.append(np.mean(error / found["variance"].values))
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.19)


def test_state_space_does_not_depend_on_the_coordinates_of_its_start() -> None:
    x = known.modal_experiment(600, 0.3, 3, process=0.3)
    start = state_space(x, 4, window=12).model
    t = np.random.default_rng(1).normal(size=(4, 4))
    m = Matrices(start.a, start.b, start.c, start.d, start.k).transformed(t)
    turned = type(start)(1.0, m.a, m.b, m.c, m.d, m.k, start.noise_covariance)
    one, other = (state_space_pem(x, 4, start=s) for s in (start, turned))
    a, b = one.response(LINES), other.response(LINES)
    size = np.abs(a["response"].values).max()
    np.testing.assert_allclose(a["response"], b["response"], rtol=0, atol=1e-4 * size)
    np.testing.assert_allclose(a["variance"], b["variance"], rtol=1e-2)
    assert one.loss == pytest.approx(other.loss, rel=1e-8)
    before = x.output - start.predict(x)
    assert one.loss < np.linalg.det(before.T @ before / len(before))


def test_state_space_identifies_an_integrator_under_feedback() -> None:
    """y = 0.1 q^-1 (1 + 0.5 q^-1) / ((1 - q^-1)(1 - 0.7 q^-1)) u + noise of its own integrator."""
    rng = np.random.default_rng(4)
    n, top, bottom = 4000, np.array([0, 0.1, 0.05]), np.convolve([1, -1], [1, -0.7])
    r, e = rng.normal(size=n), 0.1 * rng.normal(size=n)
    loop = bottom + 0.2 * top
    y = signal.lfilter(top, loop, r) + signal.lfilter([1, -0.5, 0.1], loop, e)
    model = state_space_pem(Experiment(1.0, r - 0.2 * y, y), 2)
    assert model.status == "converged"
    np.testing.assert_allclose(model.poles.real, [1.0, 0.7], atol=0.01)


def test_output_error_state_space_has_no_gain() -> None:
    e = known.output_error_experiment(500, 0.2, 4)
    one = state_space_pem(e, 2, noise="none", initial="zero")
    other = output_error(e, nf=2, nb=2)
    f = LINES / known.T
    a, b = one.response(f), other.response(f)
    np.testing.assert_allclose(a["response"], b["response"], rtol=0, atol=1e-5)
    np.testing.assert_allclose(a["variance"], b["variance"], rtol=2e-3)
    assert not one.model.k.any() and one.noise == "none"


def test_fits_say_what_is_wrong() -> None:
    over = box_jenkins(closed.loop(500, 1, noise=0.0), nb=4, nc=0, nd=0, nf=4)
    assert over.status == "rank_deficient" and np.isnan(over.std).all()
    assert "cancel" in over.warnings[0]
    short = armax(closed.loop(500, 1), na=3, nb=3, nc=3, max_evaluations=1)
    assert short.status == "max_evaluations" and "limit" in short.warnings[0]
    e = np.random.default_rng(1).normal(size=1500)
    differenced = armax(Experiment(1.0, e, np.r_[0, np.diff(e)]), na=1, nb=0, nc=1)
    assert any("unit circle" in w for w in differenced.warnings)
    short = state_space_pem(closed.loop(500, 1), 3, max_evaluations=1)
    assert short.status == "max_evaluations"


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda d: armax(d, na=2, nb=2, nc=-1), "nc: expected numbers from 0"),
        (lambda d: armax(d, na=2, nb=2, nc=1, initial="free"), "initial"),
        (lambda d: armax(d, na=2, nb=2, nc=1, max_evaluations=0), "max_evaluations"),
        (lambda d: armax(d, na=30, nb=30, nc=30), "experiments: expected more than"),
        (lambda d: box_jenkins(d, nb=0, nc=1, nd=1, nf=2), "nf: expected 0 where nb is 0"),
        (lambda d: polynomial_model(d, nb=0), "na, nb: expected at least one parameter"),
        (lambda d: state_space_pem(d, 0), "order"),
        (lambda d: state_space_pem(d, 2, noise="white"), "noise"),
        (lambda d: state_space_pem(d, 3, start=state_space(d, 2).model), "start: expected order 3"),
        (lambda d: armax(d, na=2, nb=2, nc=1).predict(known.arx_experiment(50, 0.1, 1)), "inputs"),
        (lambda d: armax(d, na=2, nb=2, nc=1).response([0.7]), "Nyquist"),
        (lambda d: residual_tests(d.output, d.input, first_lag=26), "first_lag"),
    ],
)
def test_misuse_is_named(call, words: str) -> None:
    with pytest.raises(InputError, match=words):
        call(closed.loop(100, 1))
