"""Waiting time and the steady-state test."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.signal import lfilter

from axisight.errors import InputError
from axisight.records import (
    drift_per_period,
    mode_time_constant_s,
    remove_drift,
    steady_state,
    waiting_time_s,
)
from records_data import SAMPLE_TIME_S, experiment, mode, multisine


@pytest.mark.parametrize(("tau", "record", "epsilon"), [(1.0, 10.0, 1000.0), (0.3, 2.0, 50.0)])
def test_waiting_time_is_when_the_transient_falls_to_the_noise(tau, record, epsilon):
    """Its mean square over a record that follows (its tail past the record included)."""

    def excess(wait):
        energy = quad(lambda t: np.exp(-2 * t / tau), wait, wait + 40 * tau)[0]
        return energy / record - epsilon**-2

    assert waiting_time_s(tau, record, epsilon) == pytest.approx(
        brentq(excess, 0, 20 * tau), rel=1e-6
    )


def test_waiting_time_is_never_negative():
    assert waiting_time_s(0.01, 100.0, 2.0) == 0.0


def test_time_constant_of_a_mode_is_that_of_its_poles():
    system = mode(20.0, 0.02)
    poles = np.log(np.linalg.eigvals(system.A).astype(complex)) / SAMPLE_TIME_S
    assert mode_time_constant_s(20.0, 0.02) == pytest.approx(-1 / poles.real.max(), rel=1e-9)


@pytest.mark.parametrize(
    ("function", "arguments", "field"),
    [
        (waiting_time_s, (0.0, 1.0, 1.0), "time_constant_s"),
        (waiting_time_s, (1.0, float("nan"), 1.0), "record_s"),
        (waiting_time_s, (1.0, 1.0, -3.0), "signal_to_noise"),
        (mode_time_constant_s, (0.0, 0.1), "frequency_hz"),
        (mode_time_constant_s, (1.0, 1.5), "damping_ratio"),
    ],
)
def test_misuse_is_named(function, arguments, field):
    with pytest.raises(InputError, match=field):
        function(*arguments)


def coloured(generator, shape, pole=0.98):
    """First-order noise, as position noise is: most of it in few lines."""
    white = generator.standard_normal((shape[0] * shape[1] + 500, shape[2]))
    return lfilter([1], [1, -pole], white, axis=0)[500:].reshape(shape)


@pytest.mark.parametrize("colour", [None, 0.9, 0.99])
@pytest.mark.parametrize("n_periods", [3, 4, 8])
def test_steady_records_are_kept_as_often_as_stated(colour, n_periods):
    """False drops at significance 0.1: at most 0.1 and four standard errors of 300 runs."""
    generator = np.random.default_rng(7)
    runs, shape = 300, (n_periods, 1024, 2)
    drops = 0
    for _ in range(runs):
        noise = coloured(generator, shape, colour) if colour else generator.standard_normal(shape)
        drops += steady_state(noise, significance=0.1).first > 0
    assert drops / runs < 0.1 + 4 * np.sqrt(0.1 * 0.9 / runs)


def test_a_transient_is_dropped_where_it_is_above_the_noise():
    """The mode rings down by exp(-T_period / tau) a period: known how many periods are too many."""
    run = experiment(n=500, n_periods=24, noise=1e-3, lines=np.arange(2, 60))
    signals = run.output.reshape(24, 500, 1)
    found = steady_state(signals)
    clean = experiment(n=500, n_periods=24, lines=np.arange(2, 60)).output.reshape(24, 500, 1)
    ringing = np.sqrt(np.mean((clean - clean[-1]) ** 2, axis=(1, 2))) / 1e-3
    # Much above the noise it must go, far below it must stay.
    assert np.all(ringing[: found.first] > 0.02)
    assert ringing[found.first] < 0.5
    assert found.first >= 2
    assert found.reached
    assert found.excess[0] > 100


def test_a_steady_state_that_is_not_reached_is_said():
    run = experiment(n=100, n_periods=6, noise=1e-4, lines=np.arange(1, 20))
    found = steady_state(run.output.reshape(6, 100, 1))
    assert not found.reached
    assert found.first == 3


def test_steady_state_misuse():
    with pytest.raises(InputError, match="three periods"):
        steady_state(np.zeros((2, 10, 1)))
    with pytest.raises(InputError, match="significance"):
        steady_state(np.zeros((4, 10, 1)), significance=0.0)


def test_drift_is_removed_and_the_excitation_is_not():
    x = np.tile(multisine(400, np.arange(1, 50)), 5)
    ramp = 0.02 / 400 * np.arange(2000)
    drifting = (x + ramp).reshape(5, 400, 1)
    assert drift_per_period(drifting)[0] == pytest.approx(0.02, rel=1e-10)
    clean = remove_drift(drifting)
    spectrum = np.fft.rfft(clean[:, :, 0], axis=1)
    np.testing.assert_allclose(
        spectrum[:, 1:], np.fft.rfft(x.reshape(5, 400), axis=1)[:, 1:], atol=1e-9
    )
    assert clean.mean() == pytest.approx(drifting.mean())


def test_a_transient_in_the_first_period_is_not_taken_for_drift():
    x = np.tile(multisine(400, np.arange(1, 50)), 8).reshape(8, 400, 1)
    x[0] += 3.0
    assert abs(drift_per_period(x)[0]) < 1e-12


def test_drift_of_one_period_is_not_known():
    with pytest.raises(InputError, match="two periods"):
        remove_drift(np.zeros((1, 10, 1)))
