"""Power spectral densities by averages over segments (Welch 1967)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def welch(x: Array, rate_hz: float, segment: int) -> tuple[Array, Array]:
    """Return frequencies (n_freq,) [Hz] and the one-sided density (n_freq, k) of a signal (n, k), in its unit^2/Hz.

    Segments of ``segment`` samples, at most n, overlap by half. Each is taken without its mean, under a Hann window.
    """
    step = segment - segment // 2
    pieces = np.lib.stride_tricks.sliding_window_view(x, segment, axis=0)[::step]
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(segment) / segment)
    spectra = np.fft.rfft((pieces - pieces.mean(axis=-1, keepdims=True)) * window, axis=-1)
    density = np.mean(spectra.real**2 + spectra.imag**2, axis=0).T / (rate_hz * window @ window)
    # Negative frequencies count with the positive ones. Zero, and the Nyquist frequency of an even number, have none.
    density[1 : (segment + 1) // 2] *= 2.0
    frequency_hz = np.asarray(np.fft.rfftfreq(segment, 1.0 / rate_hz), dtype=np.float64)
    return frequency_hz, np.asarray(density, dtype=np.float64)
