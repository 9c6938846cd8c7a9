"""Error analysis of chapter 6 against exact algebra, simulation and Monte Carlo."""

import numpy as np
import pytest

from axisight import Effect, load_robot, simulate_batch
from axisight.errors import InputError
from axisight.frf import (
    averaged_relative_error,
    compare_designs,
    errors,
    predict_errors,
    robot_loop,
)

T2 = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, -1.0]])
N = 1000
LINES = np.arange(2, 21)
RIPPLE = [Effect("torque_ripple", a, {"order_1": 36.0, "sine_1_nm": 0.11}) for a in (1, 2, 3)]
RIPPLE += [Effect("resolver_ripple", a, {"order_1": 10.0, "sine_1_rad": 2e-4}) for a in (1, 2, 3)]


def _random(rng, *shape):
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


@pytest.fixture
def loop():
    """Well-conditioned random G and F, R and a small V."""
    rng = np.random.default_rng(1)
    g, f = _random(rng, 50, 3, 3), _random(rng, 50, 3, 3) + 4 * np.eye(3)
    r, v = _random(rng, 50, 3, 3) + 4 * np.eye(3), 0.01 * _random(rng, 50, 3, 3)
    return g, f, r, v


@pytest.fixture(scope="module")
def robot():
    return load_robot("irb6600_like")


def _references(directions=None, runs=1, peak=8.0, seed=3):
    rng = np.random.default_rng(seed)
    t = np.arange(N) / N
    out = []
    for _ in range(runs):
        phase = 2 * np.pi * rng.random(len(LINES))
        x = np.sin(2 * np.pi * np.outer(t, LINES) + phase).sum(1)
        x *= peak / np.abs(x).max()
        out.append(np.einsum("ie,t->eti", np.eye(3) if directions is None else directions, x))
    return np.array(out)


def _spectrum(x):
    return np.moveaxis(np.fft.rfft(x, axis=1)[:, LINES], 0, -1)


def test_lemma_is_exact(loop):
    """Y U^-1 - G equals V U^-1 and (6.15): algebra, so to rounding of a few hundred eps."""
    g, f, r, v = loop
    u, y = errors.closed_loop_spectra(r, v, g, f)
    error = y @ np.linalg.inv(u) - g
    scale = np.abs(g).max()
    assert np.abs(errors.estimation_error(v, u) - error).max() < 1e-12 * scale
    assert np.abs(errors.error_from_reference(v, r, g, f) - error).max() < 1e-12 * scale


def test_loop_responses_are_those_of_the_loop(loop):
    """u = F (r - y), y = G u + v solved as one system."""
    g, f, r, v = loop
    u, y = errors.closed_loop_spectra(r, v, g, f)
    assert np.allclose(u, f @ (r - y), rtol=0, atol=1e-11)
    assert np.allclose(u, errors.reference_to_input(g, f) @ (r - v), rtol=0, atol=1e-11)
    expected = errors.reference_to_output(g, f) @ r + errors.sensitivity(g, f) @ v
    assert np.allclose(y, expected, rtol=0, atol=1e-11)


def test_approximation_is_of_first_order(loop):
    """A tenth of the disturbance leaves a hundredth of what (6.17) neglects."""
    g, f, r, v = loop

    def neglected(scale):
        exact = errors.error_from_reference(scale * v, r, g, f)
        return np.abs(exact - errors.approximate_error(scale * v, r, g, f)).max()

    assert 80 < neglected(0.01) / neglected(0.001) < 125
    r0 = r[:, 0, 0]
    by_directions = errors.approximate_error_directions(v, r0, T2, g, f)
    assert np.allclose(by_directions, errors.approximate_error(v, r0[:, None, None] * T2, g, f))


def test_lemma_in_a_simulated_loop(robot):
    """The robot's loop with noise that repeats with the period: no leakage, so Lemma 6.1 holds.

    The slowest mode of the loop decays with 1.7 s^-1: to exp(-34) in 40 periods of half a second.
    """
    rng = np.random.default_rng(5)
    references = np.tile(_references()[0], (1, 40, 1))
    noise = np.tile(1e-3 * rng.standard_normal((3, N, 3)), (1, 40, 1))
    run = simulate_batch(robot, references, noise=noise, model="linear")
    u, y = (_spectrum(run[n].values[:, -N:]) for n in ("torque_cmd_nm", "position_rad"))
    v = _spectrum(noise[:, -N:])
    loop = robot_loop(robot, LINES / (N * robot.sample_time_s))
    error = y @ np.linalg.inv(u) - loop.response
    assert _relative(errors.estimation_error(v, u), error) < 1e-6
    r = loop.prefilter @ _spectrum(references[:, -N:])
    exact = errors.error_from_reference(v, r, loop.response, loop.controller)
    assert _relative(exact, error) < 1e-6
    approximate = errors.approximate_error(v, r, loop.response, loop.controller)
    assert 1e-4 < _relative(approximate, error) < 0.5


def _relative(got, want):
    return np.abs(got - want).max() / np.abs(want).max()


def test_variance_against_monte_carlo(loop):
    """4000 draws of V: a mean square of circular normals scatters by 1/sqrt(4000) = 1.6 %."""
    g, f, r = (np.repeat(x[:5], 4000, axis=0) for x in loop[:3])
    std = np.array([1e-3, 2e-3, 5e-4])
    v = std[:, None] * _random(np.random.default_rng(2), *g.shape) / np.sqrt(2)
    error = errors.error_from_reference(v, r, g, f)
    u = errors.reference_to_input(g[::4000], f[::4000]) @ r[::4000]
    predicted = errors.error_variance(np.tile(std**2, (5, 1)), u)
    ratio = np.mean(np.abs(error.reshape(5, 4000, 3, 3)) ** 2, axis=1) / predicted
    assert np.abs(ratio - 1).max() < 5 / np.sqrt(4000)


def test_directions(loop):
    """Section 6.3.3: T2 halves the power of independent disturbances, exactly in error_variance."""
    assert errors.directions_gain(np.eye(3)) == pytest.approx(1)
    assert errors.directions_gain(T2) == pytest.approx(0.5)
    g, f = loop[:2]
    power = np.ones((50, 3))
    gu = errors.reference_to_input(g, f)
    # With G_u = I the columns of U^-1 are those of T^-1.
    ratio = errors.error_variance(power, gu @ np.linalg.inv(gu) @ np.tile(T2, (50, 1, 1)))
    assert ratio == pytest.approx(0.5)


def test_spectral_analysis_limit():
    """(3.66) for one channel, and the limit of averaged cross spectra for three."""
    rng = np.random.default_rng(4)
    g, f = _random(rng, 9, 1, 1), _random(rng, 9, 1, 1)
    phi_r, phi_v = 2.0, 0.5
    want = (g * phi_r - np.conj(f) * phi_v) / (phi_r + np.abs(f) ** 2 * phi_v)
    one = np.ones((9, 1, 1))
    assert np.allclose(errors.spectral_analysis_limit(g, f, phi_r * one, phi_v * one), want)

    g, f = _random(rng, 1, 3, 3), _random(rng, 1, 3, 3) + 3 * np.eye(3)
    n = 400_000
    r, v = np.sqrt(2.0) * _random(rng, 1, 3, n), np.sqrt(0.5) * _random(rng, 1, 3, n)
    u = np.linalg.inv(np.eye(3) + f @ g) @ (r - f @ v)
    y = g @ u + v
    adjoint = np.conj(np.swapaxes(u, 1, 2))
    h1 = (y @ adjoint) @ np.linalg.inv(u @ adjoint)
    eye = np.eye(3)[None]
    limit = errors.spectral_analysis_limit(g, f, 4 * eye, 1 * eye)
    # Scatter of the average: about |G| cond(S_uu) / sqrt(n); the bias itself is a hundred times that.
    assert np.abs(h1 - limit).max() < 0.02 < 0.1 * np.abs(limit - g).max()


def test_noise_free_limits(loop):
    g, f, r, v = loop
    assert np.array_equal(errors.spectral_analysis_limit(g, f, r, 0 * g), g)
    assert np.abs(errors.error_from_reference(0 * v, r, g, f)).max() == 0


def test_relative_error_and_snr():
    true = np.array([[[1.0 + 1j]], [[0.0]], [[2.0]]])
    estimate = np.array([[[1.1 + 1.1j]], [[1.0]], [[1.0]]])
    relative = errors.relative_error(estimate, true)
    assert relative[0] == pytest.approx(0.1)
    assert np.isnan(relative[1])
    assert errors.mean_relative_error(estimate, true) == pytest.approx(0.3)
    assert np.isnan(errors.mean_relative_error(estimate[1:2], true[1:2]))
    snr = errors.signal_to_noise_ratio([3.0, 1.0], [0.3, 0.0])
    assert snr[0] == pytest.approx(100)
    assert np.isnan(snr[1])


def test_singular_lines_are_nan(loop):
    g, f, r, v = loop
    u, _ = errors.closed_loop_spectra(r, v, g, f)
    u[3, :, 1] = u[3, :, 0]
    u[4, 0, 0] = np.nan
    error = errors.estimation_error(v, u)
    assert np.isnan(error[3:5]).all()
    assert np.isfinite(np.delete(error, [3, 4], axis=0)).all()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda g: errors.estimation_error(g, g[:, :, :2]), "as many experiments"),
        (lambda g: errors.estimation_error(g[:4], g), "multiplied"),
        (lambda g: errors.sensitivity(g[0], g), "response: expected matrices"),
        (lambda g: errors.relative_error(g, g[:4]), r"estimate: expected shape \(4, 3, 3\)"),
        (lambda g: errors.error_variance(np.ones(50), g), "disturbance_power"),
        (lambda g: errors.directions_gain(np.ones((2, 3))), "directions"),
        (lambda g: errors.error_from_reference(g[:4], g, g, g), "disturbance: expected shape"),
    ],
)
def test_shapes(loop, call, message):
    with pytest.raises(InputError, match=message):
        call(loop[0])


def test_loop_of_the_robot(robot):
    """F and P against the controller's own equations, run as a filter on one axis."""
    n, step = 4096, robot.sample_time_s
    rng = np.random.default_rng(6)
    gains = robot.controller_gains
    kp, ki = gains["kp"][0], gains["ki"][0]
    w_ref, y = rng.standard_normal(n), rng.standard_normal(n)
    w_ref -= w_ref.mean()
    phi_ref = step * (np.cumsum(w_ref) - w_ref)
    u = kp * (w_ref - (y - np.roll(y, 1)) / step) + ki * (phi_ref - y)
    lines = np.arange(1, 200)
    loop = robot_loop(robot, lines / (n * step))
    r, y, u = (np.fft.rfft(x)[lines] for x in (w_ref, y, u))
    f, p = loop.controller[:, 0, 0], loop.prefilter[:, 0, 0]
    assert np.abs(f * (p * r - y) - u).max() < 1e-9 * np.abs(u).max()


def test_loop_refuses_other_controllers(tmp_path, robot):
    before, after = robot.toml.split("[controller]")
    text = before + '[controller]\nkind = "none"\n' + after[after.index("[sensor]") :]
    path = tmp_path / "robot.toml"
    path.write_text(text)
    with pytest.raises(InputError, match="pi_velocity"):
        robot_loop(load_robot(path), np.array([1.0]))


def _true(robot):
    frequency = LINES / (N * robot.sample_time_s)
    iw = 2j * np.pi * frequency[:, None, None]
    return iw**2, iw**2 * robot.zoh_response(frequency).values


def test_prediction_of_ripple_is_what_comes(robot):
    """The same simulation read in two ways: Y U^-1 - G, and Lemma 6.1."""
    references = _references(runs=3)
    predicted = predict_errors(robot, references, LINES, effects=RIPPLE, waiting_periods=4)
    to_acceleration, true = _true(robot)
    found = []
    for one in references:
        run = simulate_batch(robot, np.tile(one, (1, 5, 1)), effects=RIPPLE, model="linear")
        u, y = (_spectrum(run[n].values[:, -N:]) for n in ("torque_cmd_nm", "position_rad"))
        found.append(to_acceleration * y @ np.linalg.inv(u) - true)
    error = np.array(found)
    assert _relative(predicted["response"].values, true) < 1e-12
    assert _relative(predicted["bias"].values, error.mean(0)) < 1e-9
    scatter = error.var(0, ddof=1)
    assert _relative(predicted["realization_variance"].values, scatter) < 1e-9
    assert np.isfinite(predicted["input_snr"]).all()


def test_prediction_of_noise_against_monte_carlo(robot):
    """400 noisy periods of one design.

    At the lowest lines all but a thousandth is leakage, real and shared by all lines: a mean
    square then scatters by sqrt(2/400) = 7 %, and the mean over three outputs in three
    experiments by a third of that. Five and four times that are the bounds.
    """
    references = _references(T2)
    predicted = predict_errors(robot, references, LINES, waiting_periods=40)
    periods = 400
    repeated = np.tile(references[0], (1, 40 + periods, 1))
    run = simulate_batch(robot, repeated, noise_seed=2, model="linear")
    u, y = (
        np.fft.rfft(run[n].values[:, 40 * N :].reshape(3, periods, N, 3), axis=2)[:, :, LINES]
        for n in ("torque_cmd_nm", "position_rad")
    )
    u, y = (np.moveaxis(x, 0, -1) for x in (u, y))
    to_acceleration, true = _true(robot)
    error = to_acceleration * (y @ np.linalg.inv(u)) - true
    ratio = np.mean(np.abs(error) ** 2, axis=0) / predicted["noise_variance"].values
    assert abs(ratio.mean() - 1) < 0.1
    assert np.abs(ratio - 1).max() < 5 * np.sqrt(2 / periods)
    assert predicted["noise_variance"].values[0, 0, 0] > 100 * _without_leakage(
        robot, references[0]
    )


def _without_leakage(robot, references):
    """Noise variance at the first line, element (1, 1), had the noise no past and no future."""
    run = simulate_batch(robot, np.tile(references, (1, 41, 1)), model="linear")
    u = _spectrum(run["torque_cmd_nm"].values[:, -N:])
    power = np.full((len(LINES), 3), N * robot.position_noise_std**2)
    to_acceleration, _ = _true(robot)
    return (np.abs(to_acceleration) ** 2 * errors.error_variance(power, u))[0, 0, 0]


def test_designs_compared(robot):
    """More amplitude helps against noise in proportion; averaging by the root of their number."""
    designs = {"low": _references(runs=2, peak=4.0), "high": _references(runs=2, peak=8.0)}
    found = {n: predict_errors(robot, r, LINES, waiting_periods=40) for n, r in designs.items()}
    table = compare_designs(found).set_index("design")
    assert table.loc["low", "mean"] / table.loc["high", "mean"] == pytest.approx(2, rel=1e-6)
    averaged = averaged_relative_error(found["low"], 4)
    assert np.allclose(averaged, found["low"]["relative_error"] / 2, rtol=1e-3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"references_rad_s": np.zeros((3, N, 3))}, "references_rad_s: expected shape"),
        ({"lines": [0, 1]}, "lines: expected"),
        ({"lines": [1.5]}, "lines: expected"),
        ({"lines": [N // 2]}, "Nyquist"),
        ({"n_periods": 0}, "n_periods"),
        ({"waiting_periods": -1}, "waiting_periods"),
    ],
)
def test_prediction_refuses(robot, change, message):
    given = {"references_rad_s": _references(), "lines": LINES, **change}
    with pytest.raises(InputError, match=message):
        predict_errors(robot, **given)


def test_one_realization_cannot_be_averaged(robot):
    predicted = predict_errors(robot, _references(), LINES)
    assert np.isnan(predicted["realization_variance"]).all()
    with pytest.raises(InputError, match="prediction: expected one from at least 2"):
        averaged_relative_error(predicted, 4)


def test_example_of_the_page(repository):
    """The page's last snippet runs, and T2 pays for ripple in the rows of axis 1's column."""
    page = (repository / "docs" / "predicted_errors.md").read_text(encoding="utf-8")
    snippet = page.rsplit("```python\n", 1)[1].split("```", 1)[0]
    names = {}
    exec(snippet, names)
    table = compare_designs(names["predictions"]).set_index("design")
    assert table.loc["all axes", "3,1"] > 3 * table.loc["one axis at a time", "3,1"]
