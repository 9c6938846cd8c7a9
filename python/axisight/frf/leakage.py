"""Leakage of sensor noise in a loop.

Noise keeps the plant moving, so a record does not end in the state in which it began. For a plant
that integrates, this leakage exceeds the noise itself at low frequency.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm, solve_discrete_lyapunov

from axisight.arguments import whole
from axisight.frf.loop import frequencies_below_nyquist, velocity_gains
from axisight.robot import Robot

Real = NDArray[np.float64]


def noise_leakage_power(robot: Robot, frequency_hz: Real, n_samples: int) -> Real:
    """Return ``E|L|^2`` [rad^2] of the leakage ``L`` in ``Y = G U + V + L``, (n_freq, n_axes).

    With the sampled plant ``x+ = A x + B u``, ``y = C x``, a record of N = ``n_samples`` samples has
    ``L = z C (z I - A)^-1 (x_0 - x_N)``, z = exp(i w T). Both states scatter with the covariance of
    the closed loop under white sensor noise, from a Lyapunov equation. The correlation between them
    over N samples is included. ``frequency_hz`` [Hz] is (n_freq,).
    Raises InputError for another controller than ``pi_velocity`` or ``p_velocity``.
    """
    kp, ki = velocity_gains(robot)
    frequency_hz = frequencies_below_nyquist(robot, frequency_hz)
    whole("n_samples", n_samples)
    step, std = robot.sample_time_s, robot.position_noise_std
    a, b, c = _sampled(robot)
    n, m = b.shape
    now, before = np.diag(kp / step + ki), np.diag(kp / step)
    # State: plant and last measurement, under u = -now (C x + e) + before (last measurement).
    loop = np.block([[a - b @ now @ c, b @ before], [c, np.zeros((m, m))]])
    drive = np.vstack([-b @ now, np.eye(m)])
    covariance = solve_discrete_lyapunov(loop, std**2 * drive @ drive.T)
    remembered = np.linalg.matrix_power(loop, n_samples) @ covariance
    ends = (2 * covariance - remembered - remembered.T)[:n, :n]
    z = np.exp(2j * np.pi * np.asarray(frequency_hz) * step)[:, None, None]
    to_output = c @ np.linalg.inv(z * np.eye(n) - a)
    power = np.einsum("fij,jk,fik->fi", to_output, ends, to_output.conj())
    return np.asarray(power.real)


def _sampled(robot: Robot) -> tuple[Real, Real, Real]:
    """Return A, B of the plant under zero-order hold, and C."""
    a, b, c = robot.linearize()
    n, m = b.shape
    both = expm(np.block([[a, b], [np.zeros((m, n + m))]]) * robot.sample_time_s)
    return both[:n, :n], both[:n, n:], c
