"""Output-error and state-space models: identities, oracles, recovery, misuse."""

import control
import numpy as np
import pytest
from scipy import signal

import blackbox_data as known
from axisight.blackbox import (
    output_error,
    residual_tests,
    state_space,
    state_space_orders,
    subspace,
)
from axisight.blackbox._output_error_problem import OutputErrorProblem
from axisight.errors import InputError
from axisight.records.experiment import Experiment

TRUTH = np.array([0.2, 0.1, -1.6, 0.8])


def pair(omega: float, damping: float) -> np.ndarray:
    pole = np.exp(omega * (-damping + 1j * np.sqrt(1 - damping**2)))
    return np.real(np.poly([pole, pole.conj()]))


BOTTOMS = [[pair(0.1, 0.02), pair(0.3, 0.02)], [pair(0.2, 0.01), pair(0.1, 0.02)]]


def two_by_two(n: int, noise: float, seed: int) -> Experiment:
    rng = np.random.default_rng(seed)
    u, y = rng.normal(size=(n, 2)), np.zeros((n, 2))
    for i in range(2):
        for j in range(2):
            y[:, i] += signal.lfilter([0, 0.3, 0.1 * (1 + i + j)], BOTTOMS[i][j], u[:, j])
    return Experiment(1.0, u, y + noise * y.std(axis=0) * rng.normal(size=y.shape))


def test_gradient_filters_are_the_derivative() -> None:
    """Complex steps carry no cancellation: the filters agree with them to rounding."""
    e = known.output_error_experiment(80, 0.1, 1)
    orders = (np.array([2]), np.array([2]), np.array([1]))
    problem = OutputErrorProblem(*orders, [e.input], [e.output[:, 0]], 5)
    theta = np.array([0.3, 0.05, -1.5, 0.7])
    exact = problem.jacobian(theta)
    for k in range(4):
        moved = theta.astype(complex)
        moved[k] += 1e-30j
        top, bottom = np.r_[0, moved[:2]], np.r_[1, moved[2:]]
        column = signal.lfilter(top, bottom, e.input[:, 0].astype(complex)).imag[5:] / 1e-30
        np.testing.assert_allclose(exact[:, k], column, rtol=0, atol=1e-11 * np.abs(column).max())


def test_output_error_recovers_exact_data() -> None:
    model = output_error(known.output_error_experiment(300, 0.0, 2), nf=2, nb=2)
    np.testing.assert_allclose(model.values, TRUTH, atol=1e-11)
    assert model.names == ("B11[1]", "B11[2]", "F11[1]", "F11[2]") and model.status == "converged"
    data = two_by_two(1500, 0.0, 3)
    model = output_error(data, nf=2, nb=2)
    for i in range(2):
        for j in range(2):
            np.testing.assert_allclose(model.f[i][j], BOTTOMS[i][j], atol=1e-9)
    np.testing.assert_allclose(model.simulate(data), data.output, atol=1e-7)
    f = np.linspace(0.001, 0.49, 20)
    np.testing.assert_allclose(
        model.response(f)["response"].values,
        model.to_state_space().response(f)["response"].values,
        rtol=1e-9,
    )


def test_output_error_standard_errors_are_the_scatter() -> None:
    """As for ARX: mean of the whitened squared error of 4 parameters over 150 runs is
    4 +- 3 sqrt(2 * 4 / 150) = 0.7. An ARX fit of the same data is biased by many deviations."""
    distances, discs = [], []
    f = np.array([5.0, 70.0, 300.0])
    z = np.exp(2j * np.pi * f * known.T)
    truth = np.polyval(known.TOP[::-1], 1 / z) / np.polyval(known.BOTTOM[::-1], 1 / z)
    for seed in range(150):
        model = output_error(known.output_error_experiment(500, 0.3, seed), nf=2, nb=2)
        error = model.values - TRUTH
        distances.append(error @ np.linalg.solve(model.covariance, error))
        found = model.response(f)
        error = np.abs(found["response"].values[:, 0, 0] - truth) ** 2
        discs.append(error / found["variance"].values[:, 0, 0])
    assert np.mean(distances) == pytest.approx(4.0, abs=0.7)
    np.testing.assert_allclose(np.mean(discs, axis=0), 1.0, atol=0.35)


def test_output_error_with_several_inputs_and_noise() -> None:
    model = output_error([two_by_two(1500, 0.1, 5), two_by_two(1000, 0.1, 6)], nf=2, nb=2)
    assert model.status == "converged" and model.stable
    truth = np.concatenate(
        [np.r_[0.3, 0.1 * (1 + i + j), BOTTOMS[i][j][1:]] for i in range(2) for j in range(2)]
    )
    # 16 parameters: none beyond 4.5 deviations (chance 1e-4).
    assert np.abs((model.values - truth) / model.std).max() < 4.5
    data = two_by_two(1500, 0.1, 5)
    tests = residual_tests(data.output - model.simulate(data), data.input)
    assert tests.white and tests.independent


def test_output_error_says_what_is_wrong() -> None:
    over = output_error(known.output_error_experiment(400, 0.0, 7), nf=4, nb=4)
    assert over.status == "rank_deficient" and np.isnan(over.std).all()
    assert "cancel" in over.warnings[0]
    short = output_error(two_by_two(400, 0.3, 8), nf=2, nb=2, max_evaluations=1)
    assert short.status == "max_evaluations" and "limit" in short.warnings[0]


def test_skipped_samples_are_not_compared() -> None:
    e = known.output_error_experiment(400, 0.0, 9)
    spoilt = e.output.copy()
    spoilt[:30] += 5.0
    model = output_error(Experiment(known.T, e.input, spoilt), nf=2, nb=2, skip=30)
    np.testing.assert_allclose(model.values, TRUTH, atol=1e-9)


@pytest.mark.parametrize("direct", [False, True])
def test_input_matrices_do_not_depend_on_blocks(direct: bool, monkeypatch) -> None:
    """Oracle: B and D by the responses of python-control's simulation to every unit entry."""
    a, b, c = known.modal_system()
    e = known.modal_experiment(400, 0.1, 1)
    past = subspace._triangle([e, e], 10)
    u, y = e.input / past.input_scale, e.output / past.output_scale
    columns = [
        control.initial_response(control.ss(a, b, c, 0, True), np.arange(400), x).outputs
        for x in np.eye(4)
    ]
    for j in range(2):
        for k in range(4):
            one = np.zeros((4, 2))
            one[k, j] = 1.0
            plant = control.ss(a, one, c, 0, True)
            columns.append(control.forced_response(plant, np.arange(400), u.T).outputs)
    if direct:
        columns += [np.outer(np.eye(2)[i], u[:, j]) for j in range(2) for i in range(2)]
    matrix = np.stack([np.asarray(x).T.ravel() for x in columns], axis=1)
    theta = np.linalg.lstsq(matrix, y.ravel())[0][4:]
    for numbers in (subspace.STATE_NUMBERS, 1000):
        monkeypatch.setattr(subspace, "STATE_NUMBERS", numbers)
        found_b, found_d = subspace._input_matrices(a, c, [e, e], past, direct)
        np.testing.assert_allclose(found_b, theta[:8].reshape(2, 4).T, rtol=0, atol=1e-12)
        wanted = theta[8:].reshape(2, 2).T if direct else np.zeros((2, 2))
        np.testing.assert_allclose(found_d, wanted, rtol=0, atol=1e-12)


@pytest.mark.parametrize("method", ["moesp", "pbsid"])
def test_subspace_is_exact_on_exact_data(method) -> None:
    """Oracle beside the truth: python-control's realization from the pulse response."""
    a, b, c = known.modal_system()
    data = known.modal_experiment(500, 0.0, 1)
    found = state_space(data, 4, method=method, window=10)
    f = np.linspace(0.01, 0.49, 40)
    truth = known.response(a, b, c, 0, f, 1.0)
    got = found.response(f)["response"].values
    np.testing.assert_allclose(got, truth, atol=1e-9 * np.abs(truth).max())
    pulses = np.stack([c @ np.linalg.matrix_power(a, k) @ b for k in range(40)], axis=2)
    # control's first sample is D, here zero.
    pulses = np.concatenate([np.zeros((2, 2, 1)), pulses], axis=2)
    other, _ = control.eigensys_realization(pulses, 4, dt=True)
    poles = np.linalg.eigvals(other.A)
    for pole in found.poles:
        assert np.min(np.abs(pole - poles)) < 1e-6
    assert found.stable and found.singular_values[4] < 1e-6 * found.singular_values[3]
    assert not np.any(found.model.k)


def test_moesp_estimates_what_acts_within_the_sample() -> None:
    direct = np.array([[0.5, 0.0], [-0.2, 1.0]])
    e = known.modal_experiment(500, 0.0, 2)
    data = Experiment(1.0, e.input, e.output + e.input @ direct.T)
    for method in ("moesp", "pbsid"):
        found = state_space(data, 4, method=method, window=10, direct=True)
        np.testing.assert_allclose(found.model.d, direct, atol=1e-9)


def test_moesp_takes_unknown_starts_and_coloured_noise() -> None:
    """The noise is 10 % and coloured; the poles come back to a percent of their distance."""
    a, b, c = known.modal_system()
    e = known.modal_experiment(3000, 0.0, 3)
    parts = [slice(100, 400), slice(1500, 1900)]
    exact = [Experiment(1.0, e.input[s], e.output[s]) for s in parts]
    f = np.linspace(0.01, 0.49, 20)
    truth = known.response(a, b, c, 0, f, 1.0)
    got = state_space(exact, 4, method="moesp", window=10).response(f)["response"].values
    np.testing.assert_allclose(got, truth, atol=1e-9 * np.abs(truth).max())
    colour = signal.lfilter([1.0], [1.0, -0.9], np.random.default_rng(4).normal(size=(3000, 2)), 0)
    noisy = e.output + 0.1 * e.output.std(axis=0) * colour / colour.std(axis=0)
    parts = [slice(100, 1500), slice(1500, 3000)]
    found = state_space(
        [Experiment(1.0, e.input[s], noisy[s]) for s in parts], 4, method="moesp", window=20
    )
    for pole in np.linalg.eigvals(a):
        assert np.min(np.abs(pole - found.poles)) < 2e-3


def test_pbsid_holds_in_closed_loop_where_moesp_does_not() -> None:
    a, _, _ = known.modal_system()
    data = known.modal_experiment(6000, 0.3, 5, feedback=0.02, process=0.3)
    far = {}
    for method in ("moesp", "pbsid"):
        found = state_space(data, 4, method=method, window=15)
        far[method] = max(np.min(np.abs(p - found.poles)) for p in np.linalg.eigvals(a))
    assert far["pbsid"] < 0.004 < far["moesp"], far
    found = state_space(data, 4, window=15)
    left = (data.output - found.model.predict(data))[15:]
    assert residual_tests(left, data.input[15:], lags=20, probability=0.999).white


def test_order_is_what_was_asked_for_and_the_table_finds_the_true_one() -> None:
    data = known.modal_experiment(1500, 0.2, 6, process=0.2)
    fresh = known.modal_experiment(1200, 0.2, 7, process=0.2)
    for n in (3, 4, 6):
        assert state_space(data, n, window=12).model.order == n
    table = state_space_orders(data, range(2, 7), validation=fresh, window=12)
    loss = table["validation_loss"].values
    # Of the cut-down orders one has an unstable predictor, whose loss is NaN.
    assert loss[2] < 0.1 * loss[0] and loss[2] < 1.02 * np.nanmin(loss)
    assert table["singular_value"].values[3] < 0.1 * table["singular_value"].values[2]
    assert table["simulation_fit"].sizes == {"order": 5, "output": 2}


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda d: output_error(d, nf=2, nb=0), "nb: expected numbers from 1"),
        (lambda d: output_error(d, nf=2, nb=2, skip=-1), "skip"),
        (lambda d: output_error(d, nf=2, nb=2, skip=200), "experiments: expected more than"),
        (lambda d: output_error(d, nf=2, nb=2, max_evaluations=0), "max_evaluations"),
        (lambda d: state_space(d, 0), "order: expected a whole number from 1"),
        (lambda d: state_space(d, 2.0), "order"),
        (lambda d: state_space(d, 4, window=2), "window: expected at least 3"),
        (lambda d: state_space(d, 4, window=30), "shorten the window"),
        (lambda d: state_space(d, 4, method="n4sid"), "method: expected"),
        (lambda d: state_space(Experiment(1.0, 0 * d.input, d.output), 4), "constant zero"),
        (
            lambda d: state_space(
                Experiment(1.0, np.sin(0.3 * np.arange(200)), d.output), 4, window=5
            ),
            "do not excite",
        ),
        (lambda d: state_space_orders(d, []), "orders: expected at least one"),
        (lambda d: state_space(d, 2, window=5).model.simulate(d, [1.0]), "initial_state"),
    ],
)
def test_misuse_is_named(call, words: str) -> None:
    with pytest.raises(InputError, match=words):
        call(known.modal_experiment(200, 0.1, 1))
