"""A known discrete-time loop with several inputs: its records and its exact response."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from axisight.records.periodic import PeriodicRecords

T = 1e-3
A = np.array(
    [
        [0.95, 0.10, 0.00, 0.00],
        [-0.20, 0.90, 0.05, 0.00],
        [0.00, 0.00, 0.70, 0.30],
        [0.05, 0.00, -0.30, 0.70],
    ]
)
B = np.array([[0.0, 0.1], [1.0, 0.2], [0.3, 0.0], [0.1, 0.8]])
C = np.array([[1.0, 0.0, 0.3, 0.0], [0.0, 0.4, 0.0, 1.0]])
GAIN = 0.15
"""Controller u = r - GAIN y; the loop is stable (asserted in the tests)."""


def plant(frequency_hz: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Return G(exp(i w T)) = C (z I - A)^-1 B, (n_freq, 2, 2)."""
    z = np.exp(2j * np.pi * frequency_hz * T)
    return np.stack([C @ np.linalg.solve(s * np.eye(4) - A, B) for s in z])


def loop_records(
    n_realizations: int = 1,
    n_periods: int = 2,
    n_samples: int = 128,
    noise: float = 0.0,
    seed: int = 1,
    lines: NDArray[np.int64] | None = None,
    n_runs: int | None = None,
) -> list[PeriodicRecords]:
    """Return closed-loop records of random-phase multisines in steady state, one set per run.

    The measured output, which the controller feeds back, and the measured input have white noise of standard
    deviation ``noise``. The noise is periodic over all periods together, so that an exact steady state can be
    computed line by line.
    """
    lines = np.arange(2, 40, 3) if lines is None else lines
    rng = np.random.default_rng(seed)
    runs = 1 if n_runs is None else n_runs
    n_experiments, total = 2 * n_realizations, n_periods * n_samples
    t = np.arange(n_samples)
    phase = rng.uniform(0, 2 * np.pi, (n_realizations, 2, len(lines)))
    tones = np.cos(2 * np.pi * lines[:, None] * t / n_samples + phase[..., None]).sum(axis=2)
    # Orthogonal experiments: (+, +) and (+, -).
    signs = np.array([[1.0, 1.0], [1.0, -1.0]])
    r = tones[:, None] * signs[None, :, :, None]
    r = np.tile(r.reshape(n_experiments, 2, n_samples), (1, 1, n_periods)).swapaxes(1, 2)
    frequency = np.fft.rfftfreq(total, T)
    g = plant(frequency)
    sensitivity = np.linalg.inv(np.eye(2) + GAIN * g)
    out = []
    for _ in range(runs):
        spectrum = np.fft.rfft(r, axis=1)
        v = np.fft.rfft(noise * rng.normal(size=(n_experiments, total, 2)), axis=1)
        w = np.fft.rfft(noise * rng.normal(size=(n_experiments, total, 2)), axis=1)
        y = np.einsum("fij,efj->efi", sensitivity, np.einsum("fij,efj->efi", g, spectrum) + v)
        u = spectrum - GAIN * y + w
        shape = (n_experiments, n_periods, n_samples, 2)
        signals = [np.fft.irfft(s, total, axis=1).reshape(shape) for s in (u, y)]
        out.append(
            PeriodicRecords(
                T, signals[0], signals[1], lines, reference=r.reshape(shape), output_unit="rad"
            )
        )
    return out


def reordered(records: PeriodicRecords, order: NDArray[np.int64]) -> PeriodicRecords:
    reference = None if records.reference is None else records.reference[order]
    return replace(
        records, input=records.input[order], output=records.output[order], reference=reference
    )
