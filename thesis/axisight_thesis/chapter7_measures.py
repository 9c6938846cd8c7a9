"""Numerical measures of what the figures of chapter 7 show.

A response has axes (n_freq, output, input); several responses have one more leading axis. A measure is
one number per element, a median over lines, on which resonances and outliers have little influence.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.frf import frequency_response, logarithmic_mean

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Mask = NDArray[np.bool_]

DIAGONAL = np.eye(3, dtype=bool)
COUPLING = np.array([[0, 1, 1], [1, 0, 0], [1, 0, 0]], dtype=bool)
"""Elements between axis 1 and the others."""
LOW_HZ = 5.0
"""Upper limit of low frequencies, below the first notch."""


def level_db(response: Complex | Real) -> Real:
    """Return 20 log10 of the magnitude."""
    return np.asarray(20 * np.log10(np.abs(response)))


def scatter_db(response: Complex | Real) -> Real:
    """Return the randomness from line to line, (3, 3) [dB].

    It is the standard deviation of independent errors of neighbouring lines, from the median size of
    second differences of the level. Second differences have six times the variance of the errors.
    """
    bends = np.diff(level_db(response), n=2, axis=-3)
    return np.asarray(np.median(np.abs(bends), axis=-3) / 0.6745 / np.sqrt(6))


def spread_db(responses: Complex) -> Real:
    """Return the standard deviation over several responses, (3, 3) [dB]."""
    return np.asarray(np.median(np.std(level_db(responses), axis=0, ddof=1), axis=0))


def distance_db(one: Complex | Real, other: Complex | Real) -> Real:
    """Return the distance between two responses, (3, 3) [dB]."""
    return np.asarray(np.median(np.abs(level_db(one) - level_db(other)), axis=-3))


def log_mean(responses: Complex) -> Complex:
    """Return the logarithmic mean (7.8), with the phase of the arithmetic mean (7.7)."""
    lines = np.arange(1.0, responses.shape[1] + 1)  # frequencies take no part in the mean
    each = [frequency_response(lines, one, estimator="mfrf") for one in responses]
    return np.asarray(logarithmic_mean(each, phase="arithmetic")["response"].values)


def notch_hz(frequency_hz: Real, element: Complex, band_hz: tuple[float, float]) -> float:
    """Return the frequency of the lowest magnitude within a band [Hz], interpolated between lines.

    A complex parabola is fitted to the lines within 0.8 Hz of the lowest running mean of three levels,
    and its smallest magnitude gives the notch. Near a notch the complex response is smooth, while its
    level is not.
    """
    inside = (frequency_hz >= band_hz[0]) & (frequency_hz <= band_hz[1])
    f, values = frequency_hz[inside], element[inside]
    smooth = np.convolve(level_db(values), np.ones(3) / 3, mode="valid")
    lowest = 1 + int(np.argmin(smooth))
    offset = f - f[lowest]
    near = np.abs(offset) < 0.85
    parabola = np.polyfit(offset[near], values[near], 2)
    fine = np.linspace(offset[near].min(), offset[near].max(), 801)
    return float(f[lowest] + fine[np.argmin(np.abs(np.polyval(parabola, fine)))])


def peak_hz(frequency_hz: Real, element: Complex, band_hz: tuple[float, float]) -> float:
    """Return the frequency of the highest magnitude within a band [Hz], like :func:`notch_hz`."""
    return notch_hz(frequency_hz, 1 / element, band_hz)


def peak_db(frequency_hz: Real, element: Complex | Real, band_hz: tuple[float, float]) -> float:
    """Return the height of a resonance over the level above 30 Hz [dB]."""
    inside = (frequency_hz >= band_hz[0]) & (frequency_hz <= band_hz[1])
    level = level_db(element)
    return float(level[inside].max() - np.median(level[frequency_hz > 30]))


def middle(matrix: Real, elements: Mask | None = None) -> float:
    """Return the median over (chosen) elements."""
    return float(np.median(matrix if elements is None else matrix[elements]))


def names(elements: Mask) -> str:
    """Return chosen elements as ``(1,2), (2,1)``, or ``none``."""
    return ", ".join(f"({i + 1},{j + 1})" for i, j in np.argwhere(elements)) or "none"
