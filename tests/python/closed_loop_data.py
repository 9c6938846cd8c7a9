"""A stable closed loop with coloured noise, for tests of prediction-error and closed-loop methods."""

import numpy as np
from scipy import signal

from axisight.records.experiment import Experiment

# y = B/F u + C/D e, u = r - P/Q y; the loop is stable.
B = np.array([0.0, 0.2, 0.1])
F = np.array([1.0, -1.6, 0.8])
C = np.array([1.0, 0.5])
D = np.array([1.0, -0.9])
P = np.array([0.3, -0.2])
Q = np.array([1.0, -0.5])
CONTROLLER = signal.dlti(P, Q, dt=1.0)
# In the order of a Box-Jenkins model with nb = nf = 2 and nc = nd = 1.
TRUTH = np.array([0.2, 0.1, -1.6, 0.8, 0.5, -0.9])
BEFORE = 200


def ratio(top, bottom, frequency):
    """Return top / bottom at frequencies in cycles per sample."""
    late = np.exp(-2j * np.pi * np.asarray(frequency))
    return np.polyval(top[::-1], late) / np.polyval(bottom[::-1], late)


def loop(n, seed, noise=0.5, gain=1.0, reference=None):
    """Return one experiment of ``n`` samples that begins in motion; ``gain`` scales the controller."""
    rng = np.random.default_rng(seed)
    e = noise * rng.normal(size=n + BEFORE)
    r = rng.normal(size=n + BEFORE) if reference is None else reference
    v = signal.lfilter(C, D, e)
    bottom = np.convolve(F, Q)
    back = gain * np.convolve(B, P)
    bottom = bottom + np.pad(back, (0, len(bottom) - len(back)))
    y = signal.lfilter(np.convolve(B, Q), bottom, r) + signal.lfilter(np.convolve(F, Q), bottom, v)
    u = r - gain * signal.lfilter(P, Q, y)
    s = slice(BEFORE, None)
    return Experiment(1.0, u[s], y[s], reference=r[s])
