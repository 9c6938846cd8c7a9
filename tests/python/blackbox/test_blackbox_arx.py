"""ARX models: identities, oracles, recovery, uncertainty, orders, misuse."""

import sys
from dataclasses import replace

import control
import numpy as np
import pytest
from scipy import signal

import blackbox_data as known
from axisight.blackbox import arx, arx_orders, fit_percent, residual_tests
from axisight.errors import InputError
from axisight.frf import Flag
from axisight.records.experiment import Experiment

TRUTH = np.concatenate(
    [
        np.concatenate(
            [
                np.ravel([[known.A1[i, j], known.A2[i, j]] for j in range(2)]),
                np.ravel([[known.B1[i, j], known.B2[i, j]] for j in range(2)]),
            ]
        )
        for i in range(2)
    ]
)


def test_exact_data_give_exact_parameters_and_prediction() -> None:
    data = known.arx_experiment(200, 0.0, 1)
    model = arx(data, na=2, nb=2)
    np.testing.assert_allclose(model.values, TRUTH, rtol=0, atol=1e-12)
    assert np.isnan(model.predict(data)[:2]).all()
    np.testing.assert_allclose(model.predict(data)[2:], data.output[2:], atol=1e-12)
    np.testing.assert_allclose(model.simulate(data), data.output, atol=1e-11)


def test_same_as_a_plain_least_squares_problem_with_merged_records() -> None:
    """(3.38) written out row by row, one input to one output, unequal orders and a delay."""
    rng = np.random.default_rng(3)
    data = [Experiment(1.0, rng.normal(size=n), rng.normal(size=n)) for n in (40, 60)]
    rows, target = [], []
    for e in data:
        y, u = e.output[:, 0], e.input[:, 0]
        for t in range(4, len(y)):
            rows.append([-y[t - 1], -y[t - 2], -y[t - 3], u[t - 3], u[t - 4]])
            target.append(y[t])
    theta, rss, *_ = np.linalg.lstsq(np.array(rows), np.array(target))
    model = arx(data, na=3, nb=2, nk=3)
    assert model.names == ("A11[1]", "A11[2]", "A11[3]", "B11[3]", "B11[4]")
    np.testing.assert_allclose(model.values, theta, rtol=1e-11)
    variance = rss[0] / (len(rows) - 5)
    assert model.noise_covariance[0, 0] == pytest.approx(variance, rel=1e-11)
    covariance = variance * np.linalg.inv(np.array(rows).T @ np.array(rows))
    np.testing.assert_allclose(model.covariance, covariance, rtol=1e-9)


def test_a_finite_pulse_response_is_that_of_python_control() -> None:
    """Without lags of the output ARX is what control.markov estimates."""
    rng = np.random.default_rng(4)
    u = rng.normal(size=400)
    y = signal.lfilter(known.TOP, known.BOTTOM, u)
    # control.markov starts from rest: leading zeros make the first rows the same.
    rest = np.zeros(9)
    model = arx(Experiment(1.0, np.r_[rest, u], np.r_[rest, y]), na=0, nb=10, nk=0)
    other = np.squeeze(control.markov(y, u, 10, dt=1))
    np.testing.assert_allclose(model.values, other, rtol=0, atol=1e-10)


def test_long_records_are_triangularized_in_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    data = known.arx_experiment(500, 0.1, 5)
    whole = arx(data, na=2, nb=2)
    # The function hides the module of its name.
    monkeypatch.setattr(sys.modules["axisight.blackbox.arx"], "CHUNK", 64)
    np.testing.assert_allclose(arx(data, na=2, nb=2).values, whole.values, rtol=1e-11)


def test_standard_errors_are_the_scatter_over_realizations() -> None:
    """Whitened errors of 200 runs, all 16 parameters together: chi-square, so mean 16, and
    standard deviation of the mean sqrt(2 * 16 / 200) = 0.4; three of them are allowed."""
    distances, discs = [], []
    f = np.array([20.0, 120.0, 400.0])
    states = arx(known.arx_experiment(300, 0.0, 0), na=2, nb=2).to_state_space()
    truth = states.response(f)["response"].values
    for seed in range(200):
        model = arx(known.arx_experiment(400, 0.3, seed), na=2, nb=2)
        error = model.values - TRUTH
        distances.append(error @ np.linalg.solve(model.covariance, error))
        found = model.response(f)
        discs.append(np.abs(found["response"].values - truth) ** 2 / found["variance"].values)
    assert np.mean(distances) == pytest.approx(16, abs=1.2)
    # E|dG|^2 over its variance is one; the 12 elements are correlated, count one per run.
    np.testing.assert_allclose(np.mean(discs, axis=0), 1.0, atol=0.35)
    assert np.mean(discs) == pytest.approx(1.0, abs=0.2)


def test_response_and_poles_agree_with_state_space() -> None:
    model = arx(known.arx_experiment(600, 0.2, 6), na=[[2, 1], [1, 3]], nb=[[2, 1], [3, 2]], nk=0)
    states = model.to_state_space()
    f = np.linspace(0, 500, 30)
    np.testing.assert_allclose(
        model.response(f)["response"].values, states.response(f)["response"].values, rtol=1e-10
    )
    outer = [p for p in states.poles if abs(p) > 1e-3]
    inner = [p for p in model.poles if abs(p) > 1e-3]
    # Zero poles, which delays bring, are split by rounding to the root of their number.
    for p in inner:
        assert min(abs(p - q) for q in outer) < 1e-6
    data = known.arx_experiment(100, 0.2, 7)
    known_rows = ~np.isnan(model.predict(data)).any(axis=1)
    start = 3  # past the largest lag both know the same past
    predicted = states.predict(data)
    # From rest the state is exact from the first sample: u and y before are zero.
    assert known_rows[start:].all()
    np.testing.assert_allclose(predicted[start:], model.predict(data)[start:], atol=1e-10)
    system = states.to_control()
    np.testing.assert_allclose(
        np.moveaxis(system(np.exp(2j * np.pi * f[1:] * known.T)), 2, 0),
        states.response(f[1:])["response"].values,
        rtol=1e-9,
    )
    assert states.to_scipy().dt == known.T


def test_order_table_finds_the_true_order_and_agrees_with_single_fits() -> None:
    data = [known.arx_experiment(800, 0.2, s) for s in (8, 9)]
    fresh = known.arx_experiment(700, 0.2, 10)
    table = arx_orders(data, na=range(1, 5), nb=range(1, 4), nk=(1, 2), validation=fresh)
    best = table.isel(candidate=table.attrs["best_bic"])
    assert (int(best["na"]), int(best["nb"]), int(best["nk"])) == (2, 2, 1)
    assert int(best["n_parameters"]) == 16
    # The largest lag is 4, so a fit on the same rows leaves out two of each record's start.
    cut = [Experiment(e.sample_time_s, e.input[2:], e.output[2:]) for e in data]
    model = arx(cut, na=2, nb=2)
    left = np.concatenate([(e.output - model.predict(e))[2:] for e in cut])
    assert float(best["loss"]) == pytest.approx(np.linalg.det(left.T @ left / len(left)), rel=1e-9)
    left = (fresh.output - model.predict(fresh))[4:]
    expected = np.linalg.det(left.T @ left / len(left))
    assert float(best["validation_loss"]) == pytest.approx(expected, rel=1e-9)


def test_noise_free_data_above_their_order_are_told() -> None:
    data = known.arx_experiment(300, 0.0, 11)
    with pytest.raises(InputError, match="rank"):
        arx(data, na=4, nb=4)
    table = arx_orders(data, na=(2, 4), nb=(2, 4))
    assert table["status"].values.tolist()[0] == "estimated"
    assert table["status"].values.tolist()[-1] == "rank_deficient"
    assert np.isnan(table["validation_loss"]).all() and table.attrs["best_validation_loss"] == -1


def test_residual_tests_pass_the_true_order_and_fail_a_lower_one() -> None:
    data = known.arx_experiment(3000, 0.2, 12)
    right = arx(data, na=2, nb=2)
    tests = residual_tests(data.output - right.predict(data), data.input)
    assert tests.white and tests.independent and not tests.advice()
    low = arx(data, na=1, nb=1)
    tests = residual_tests(data.output - low.predict(data), data.input)
    assert not tests.white and not tests.independent
    assert any("delay" in line for line in tests.advice())
    assert tests.to_xarray()["cross_correlation"].shape == (2, 2, 51)


def test_residual_tests_hold_their_level() -> None:
    """500 white residuals: 5 % fail on average, 25 of them, standard deviation 4.9; the input is
    coloured, and so is the residual of the second test, which must not matter to it."""
    failed = np.zeros(2)
    for seed in range(500):
        rng = np.random.default_rng(seed)
        e, u = rng.normal(size=(2, 600))
        u = signal.lfilter([1.0], [1.0, -0.8], u)
        failed[0] += not residual_tests(e, u, lags=15, probability=0.95).white
        e = signal.lfilter([1.0], [1.0, -0.7], e)
        failed[1] += not residual_tests(e, u, lags=15, probability=0.95).independent
    assert np.all(failed > 25 - 3 * 4.9) and np.all(failed < 25 + 3 * 4.9), failed


def test_fit_percent_is_3_54() -> None:
    y = np.array([1.0, 3.0, 5.0, 7.0])
    assert fit_percent(y, y)[0] == 100
    assert fit_percent(y, np.full(4, 4.0))[0] == 0
    assert np.isnan(fit_percent(np.ones(4), np.ones(4))[0])
    np.testing.assert_allclose(fit_percent(y, np.r_[np.nan, y[1:] + 1]), 100 * (1 - np.sqrt(3 / 8)))


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda d: arx([], na=1, nb=1), "experiments: expected at least one"),
        (lambda d: arx([d, 3], na=1, nb=1), "got int at 2"),
        (lambda d: arx(d, na=-1, nb=1), "na: expected numbers from 0"),
        (lambda d: arx(d, na=1.5, nb=1), "na: expected whole numbers"),
        (lambda d: arx(d, na=1, nb=[1, 2, 3]), "nb: expected one number or shape"),
        (lambda d: arx(d, na=0, nb=0), "at least one parameter"),
        (lambda d: arx(d, na=20, nb=20), "expected more than 80 samples"),
        (lambda d: arx([d, Experiment(2 * known.T, d.input, d.output)], na=1, nb=1), "resample"),
        (lambda d: arx([d, Experiment(known.T, d.input[:, 0], d.output)], na=1, nb=1), "1 and 2"),
        (lambda d: arx(Experiment(known.T, 0 * d.input, d.output), na=1, nb=1), "does not excite"),
        (lambda d: arx(d, na=1, nb=1).response([600.0]), "Nyquist"),
        (lambda d: arx(d, na=1, nb=1).response([3.0, 2.0]), "ascending"),
        (lambda d: arx(d, na=1, nb=1).simulate(Experiment(1.0, d.input, d.output)), "sample time"),
        (lambda d: arx_orders(d, na=(), nb=(1,)), "at least one candidate"),
        (lambda d: arx_orders(d, na=(1,), nb=(0,)), "nb: expected a whole number from 1"),
        (lambda d: residual_tests(d.output, d.input, lags=0), "lags"),
        (lambda d: residual_tests(d.output, d.input[:-1]), "expected 100 samples"),
        (lambda d: residual_tests(d.output, d.input, probability=1.0), "probability"),
        (lambda d: residual_tests(np.ones(100), d.input), "a constant one"),
        (lambda d: residual_tests(d.output, d.input, lags=40), "at least 160 samples"),
        (lambda d: fit_percent(d.output, d.output[:-1]), "shape of measured"),
    ],
)
def test_misuse_is_named(call, words: str) -> None:
    with pytest.raises(InputError, match=words):
        call(known.arx_experiment(100, 0.1, 1))


@pytest.mark.parametrize(("pole", "line"), [(1.0, 0), (-1.0, -1)])
def test_a_line_on_a_pole_has_no_response(pole: float, line: int) -> None:
    """As of a state-space model: at 0 Hz of an integrator, and at Nyquist; other lines stay."""
    model = arx(known.arx_experiment(200, 0.0, 1), na=2, nb=2)
    first = np.stack([np.eye(2), -pole * np.eye(2)])
    on_pole = replace(model, na=np.ones((2, 2), int), a=first)
    f = np.array([0.0, 100.0, 0.5 / model.sample_time_s])
    found = on_pole.response(f)
    flag = found["flag"].values
    assert flag[line] == Flag.RANK_DEFICIENT
    assert np.isnan(found["response"].values[line]).all()
    assert np.isnan(found["variance"].values[line]).all()
    others = np.delete(np.arange(3), line)
    assert (flag[others] == Flag.GOOD).all()
    assert np.isfinite(found["response"].values[others]).all()
    assert np.isfinite(found["variance"].values[others]).all()
