"""The loop with which the statements of chapter 3 are checked; the thesis gives no numbers there.

    y = G_0 u + H_0 e,  u = r - F_y y,  G_0 = B/F,  H_0 = C/D,  F_y = P/Q

G_0 has a resonance, H_0 is slow noise. Time is in samples, frequency in cycles per sample.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from axisight.blackbox import StateSpaceModel, input_spectra
from axisight.records.experiment import Experiment
from axisight_thesis.context import Context

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

B, F = np.array([0.0, 0.2, 0.1]), np.array([1.0, -1.6, 0.8])
C, D = np.array([1.0, 0.5]), np.array([1.0, -0.9])
P, Q = np.array([0.3, -0.2]), np.array([1.0, -0.5])
N_SAMPLES = 4000
WAITING = 300
LINES = np.linspace(0.005, 0.495, 50)
"""Frequencies at which estimates are compared."""


def ratio(top: Real, bottom: Real, frequency: Real = LINES) -> Complex:
    """Return top / bottom, polynomials in q^-1, at frequencies in cycles per sample."""
    late = np.exp(-2j * np.pi * frequency)
    return np.asarray(np.polyval(top[::-1], late) / np.polyval(bottom[::-1], late))


@dataclass(frozen=True)
class Setting:
    """What varies between experiments: the gain of the controller, and the size of the noise."""

    gain: float = 1.0
    noise_std: float = 0.5
    limit: float = np.inf
    """Largest feedback P/Q y; a finite one makes the controller nonlinear."""

    def controller(self, frequency: Real = LINES) -> Complex:
        """Return F_y."""
        return self.gain * ratio(P, Q, frequency)

    def sensitivity(self, frequency: Real = LINES) -> Complex:
        """Return S_0 = 1 / (1 + F_y G_0)."""
        return 1 / (1 + self.controller(frequency) * ratio(B, F, frequency))

    def disturbance_spectrum(self, frequency: Real = LINES) -> Real:
        """Return Phi_v."""
        return np.asarray(self.noise_std**2 * np.abs(ratio(C, D, frequency)) ** 2)

    def spectra(self, frequency: Real = LINES, reference: Real | None = None) -> tuple[Real, Real]:
        """Return Phi_u^r and Phi_u^e (3.59), for a white reference by default."""
        phi_r = np.ones_like(frequency) if reference is None else reference
        phi_v = self.disturbance_spectrum(frequency)
        return input_spectra(ratio(B, F, frequency), self.controller(frequency), phi_r, phi_v)

    def controller_model(self) -> StateSpaceModel:
        """Return F_y as a state-space model."""
        top = self.gain * P
        one, none = np.ones((1, 1)), np.zeros((1, 1))
        return StateSpaceModel(
            1.0, -Q[1] * one, one, (top[1] - Q[1] * top[0]) * one, top[0] * one, none, none
        )


def experiment(
    context: Context,
    setting: Setting,
    run: int,
    *,
    n: int = N_SAMPLES,
    reference: Real | None = None,
) -> Experiment:
    """Return one realization: ``n`` samples after the start has died out.

    ``reference`` (WAITING + n,) is white noise of variance one by default.
    """
    rng = np.random.default_rng([context.seed, run, 3])
    e = setting.noise_std * rng.standard_normal(WAITING + n)
    r = rng.standard_normal(WAITING + n) if reference is None else reference
    v = signal.lfilter(C, D, e)
    if np.isfinite(setting.limit):
        u, y = _limited(setting, r, v)
    else:
        back = np.convolve(B, setting.gain * P)
        bottom = np.convolve(F, Q)
        bottom = bottom + np.pad(back, (0, len(bottom) - len(back)))
        y = signal.lfilter(np.convolve(B, Q), bottom, r)
        y = y + signal.lfilter(np.convolve(F, Q), bottom, v)
        u = r - setting.gain * signal.lfilter(P, Q, y)
    kept = slice(WAITING, None)
    return Experiment(1.0, u[kept], y[kept], reference=r[kept])


def _limited(setting: Setting, r: Real, v: Real) -> tuple[Real, Real]:
    """Return u and y with a limited feedback, sample by sample."""
    n = len(r)
    u, x, w = np.zeros(n + 2), np.zeros(n + 2), np.zeros(n + 1)
    y = np.zeros(n + 1)
    # Two leading zeros for x and u, one for w and y.
    for t in range(n):
        x[t + 2] = B[1] * u[t + 1] + B[2] * u[t] - F[1] * x[t + 1] - F[2] * x[t]
        y[t + 1] = x[t + 2] + v[t]
        w[t + 1] = P[0] * y[t + 1] + P[1] * y[t] - Q[1] * w[t]
        fed = setting.gain * w[t + 1]
        u[t + 2] = r[t] - min(max(fed, -setting.limit), setting.limit)
    return u[2:], y[1:]


def realizations(context: Context) -> int:
    """Return the number of realizations of a comparison."""
    return 8 if context.quick else 30


def responses(
    context: Context,
    name: str,
    setting: Setting,
    fit: Callable[[Experiment], Complex],
) -> Complex:
    """Return G (realization, line) by one method; computed once per context for each ``name``."""

    def compute() -> Complex:
        context.report(f"chapter 3: {name}")
        runs = range(realizations(context))
        return np.stack([fit(experiment(context, setting, run)) for run in runs])

    return context.shared(("chapter 3", name, setting), compute)
