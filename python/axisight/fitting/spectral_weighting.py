"""Weights from the spectrum of residuals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.arguments import between, positive, whole
from axisight.errors import InputError
from axisight.fitting.weighting import Weighting

Array = NDArray[np.float64]

_LEAST_LINES = 16
"""Periodogram lines of a band; the root of their mean scatters by an eighth."""


def spectral_weighting(
    residuals: Sequence[Array],
    sample_time_s: float,
    *,
    bands: int = 40,
    floor: float = 0.03,
) -> Weighting:
    """Return the weighting under which residuals with these spectra become white with variance one.

    The weight is one over the root of the spectrum. Periodograms of all logs are averaged over bands that
    are equally wide on a logarithmic scale. A prediction-error fit with a noise model weights its residuals
    in this way (Wernholt 2004, section 3.4.2); the spectrum serves as the noise model. An axis without
    residuals gets the weight zero.

    residuals
        Residuals of each log, (n, n_axes), sampled alike.
    sample_time_s
        Sample time [s].
    bands
        Number of bands.
    floor
        Least amplitude of a band relative to the strongest band. Integral action makes commands almost free
        of noise at low frequencies. Without a floor, their weights would exceed others by a factor of 1e5,
        and errors of the ends of a log and of the model would decide the fit.

    Raises InputError for no residuals, logs of fewer than 16 samples and different numbers of axes.
    """
    count = whole("bands", bands, 1)
    share = between("floor", floor, 0, 1)
    step = positive("sample_time_s", sample_time_s)
    axes = {r.shape[1] for r in residuals}
    if len(axes) != 1 or min(len(r) for r in residuals) < 2 * _LEAST_LINES:
        raise InputError(
            f"residuals: expected arrays (n, n_axes) of at least {2 * _LEAST_LINES} samples and as many "
            f"axes, got shapes {[r.shape for r in residuals]}"
        )
    frequency, power = _periodograms(residuals, step)
    order = np.argsort(frequency, kind="stable")
    frequency, power = frequency[order], power[order]
    edges = _edges(frequency, count)
    centre = np.array([f.mean() for f in np.split(frequency, edges)])
    mean = np.stack([p.mean(axis=0) for p in np.split(power, edges)], axis=1)
    largest = mean.max(axis=1, keepdims=True)
    floored = np.maximum(mean, share**2 * largest)
    weight = np.divide(1.0, np.sqrt(floored), out=np.zeros_like(mean), where=largest > 0)
    return Weighting(centre, weight)


def _periodograms(residuals: Sequence[Array], step: float) -> tuple[Array, Array]:
    """Return frequencies (n,) [Hz] and power (n, n_axes); white noise of variance s^2 has the power s^2."""
    frequencies, powers = [], []
    for residual in residuals:
        # The taper keeps the strong part of a steep spectrum out of its weak part.
        taper = np.hanning(len(residual) + 2)[1:-1, None]
        spectrum = np.fft.rfft(taper * residual, axis=0)[1:]
        powers.append(np.abs(spectrum) ** 2 / np.sum(taper**2))
        frequencies.append(np.fft.rfftfreq(len(residual), step)[1:])
    return np.concatenate(frequencies), np.concatenate(powers)


def _edges(frequency: Array, count: int) -> list[int]:
    """Return where bands begin, after the first: logarithmic, with enough lines in each."""
    wanted = np.geomspace(frequency[0], frequency[-1], count + 1)[1:-1]
    out: list[int] = []
    for place in np.searchsorted(frequency, wanted):
        first = out[-1] if out else 0
        if place - first >= _LEAST_LINES and len(frequency) - place >= _LEAST_LINES:
            out.append(int(place))
    return out
