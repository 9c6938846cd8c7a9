"""Signals for the tests of records: multisines, seeded noise, a lightly damped mode."""

import numpy as np
from scipy.signal import cont2discrete, dlsim, dlti

from axisight.records import Experiment

SAMPLE_TIME_S = 1e-3


def multisine(n, lines, seed=0, amplitude=1.0):
    """Return one period (n,) with random phases; its rms is sqrt(len(lines) / 2) times the amplitude."""
    spectrum = np.zeros(n // 2 + 1, complex)
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(lines))
    spectrum[np.asarray(lines)] = amplitude * n / 2 * np.exp(1j * phases)
    return np.fft.irfft(spectrum, n)


def late(x, samples, lines):
    """Return one period later by a fraction of samples, by its definition as a sum of sines."""
    n = len(x)
    spectrum = np.fft.rfft(x)
    t = np.arange(n) - samples
    return sum(
        2 / n * (spectrum[k] * np.exp(2j * np.pi * k * t / n)).real for k in np.asarray(lines)
    )


def mode(frequency_hz=20.0, damping=0.02):
    """Return a second-order mode, discretized with a zero-order hold."""
    w = 2 * np.pi * frequency_hz
    continuous = [
        np.array(m, float) for m in ([[0, 1], [-w * w, -2 * damping * w]], [[0], [w * w]])
    ]
    a, b, c, d, _ = cont2discrete(
        (*continuous, np.array([[1.0, 0]]), np.zeros((1, 1))), SAMPLE_TIME_S
    )
    return dlti(a, b, c, d, dt=SAMPLE_TIME_S)


def experiment(n=1000, n_periods=8, lines=None, noise=0.0, seed=0, system=None):
    """Return an experiment: input and reference repeat from sample 0, the system starts at rest."""
    lines = np.arange(2, 100) if lines is None else lines
    u = np.tile(multisine(n, lines, seed), n_periods)
    y = dlsim(system or mode(), u)[1][:, 0]
    generator = np.random.default_rng(1000 + seed)
    y = y + noise * generator.standard_normal(len(y))
    v = u + noise * generator.standard_normal(len(u))
    return Experiment(SAMPLE_TIME_S, v, y, u)
