"""Known linear systems and their records, for tests of black-box models."""

import numpy as np
from scipy import signal

from axisight.records.experiment import Experiment

T = 1e-3
# A stable ARX system with two inputs and outputs and correlated disturbances.
A1 = np.array([[-1.2, 0.1], [0.05, -0.9]])
A2 = np.array([[0.6, 0.0], [-0.1, 0.3]])
B1 = np.array([[0.5, -0.2], [0.1, 0.7]])
B2 = np.array([[-0.3, 0.4], [0.2, 0.1]])
MIX = np.array([[1.0, 0.5], [0.0, 1.0]])

# An output-error system with one input.
TOP = np.array([0.0, 0.2, 0.1])
BOTTOM = np.array([1.0, -1.6, 0.8])


def arx_experiment(n: int, noise: float, seed: int) -> Experiment:
    """Return records of the ARX system from rest, driven by white input."""
    rng = np.random.default_rng(seed)
    u = rng.normal(size=(n, 2))
    e = noise * rng.normal(size=(n, 2)) @ MIX
    y = np.zeros((n, 2))
    for t in range(n):
        y[t] = e[t]
        if t >= 1:
            y[t] += -A1 @ y[t - 1] + B1 @ u[t - 1]
        if t >= 2:
            y[t] += -A2 @ y[t - 2] + B2 @ u[t - 2]
    return Experiment(T, u, y)


def output_error_experiment(n: int, noise: float, seed: int) -> Experiment:
    """Return records of the output-error system from rest, with white input and noise."""
    rng = np.random.default_rng(seed)
    u = rng.normal(size=n)
    return Experiment(T, u, signal.lfilter(TOP, BOTTOM, u) + noise * rng.normal(size=n))


def modal_system() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return A, B, C of two lightly damped modes with two inputs and outputs."""
    a = np.zeros((4, 4))
    for k, (omega, damping) in enumerate(((0.3, 0.02), (0.9, 0.03))):
        pole = np.exp(omega * (-damping + 1j * np.sqrt(1 - damping**2)))
        a[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = [[pole.real, pole.imag], [-pole.imag, pole.real]]
    b = np.array([[0.4, -1.0], [0.7, 0.3], [-0.5, 0.6], [0.9, 0.2]])
    c = np.array([[1.0, 0.2, -0.6, 0.4], [0.3, -0.8, 0.5, 0.7]])
    return a, b, c


def modal_experiment(
    n: int, noise: float, seed: int, feedback: float = 0.0, process: float = 0.0
) -> Experiment:
    """Return records of the modal system; u = r - feedback (C B)^-1 y in closed loop."""
    a, b, c = modal_system()
    gain = feedback * np.linalg.inv(c @ b)
    rng = np.random.default_rng(seed)
    x, u, y = np.zeros(4), np.zeros((n, 2)), np.zeros((n, 2))
    for t in range(n):
        y[t] = c @ x + noise * rng.normal(size=2)
        u[t] = rng.normal(size=2) - gain @ y[t]
        x = a @ x + b @ u[t] + process * rng.normal(size=4)
    return Experiment(1.0, u, y)


def response(a, b, c, d, frequency_hz, step):
    """Return C (z I - A)^-1 B + D."""
    z = np.exp(2j * np.pi * frequency_hz * step)
    return np.stack([c @ np.linalg.solve(s * np.eye(len(a)) - a, b) + d for s in z])
