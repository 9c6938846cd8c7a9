"""Smoothing of a frequency response over neighbouring lines."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.frf.confidence import with_freedom
from axisight.frf.response import Flag

Real = NDArray[np.float64]


def hann_weights(frequency_hz: Real, bandwidth_hz: float) -> Real:
    """Weights alpha, (n_freq, n_freq), a row for each frequency smoothed at; each sums to one.

    A Hann window over frequency, zero ``bandwidth_hz`` away from the middle. At the ends of
    the band it is kept symmetric by narrowing it, so that a straight line stays straight.
    Raises InputError for a bandwidth that is not positive.
    """
    if not (np.isfinite(bandwidth_hz) and bandwidth_hz > 0):
        raise InputError(f"bandwidth_hz: expected a positive width, got {bandwidth_hz}")
    frequency = np.asarray(frequency_hz, float)
    spacing = np.min(np.diff(frequency)) if len(frequency) > 1 else 1.0
    # One spacing beyond the outermost line: there a single line is left.
    room = np.minimum(frequency - frequency[0], frequency[-1] - frequency) + spacing
    width = np.minimum(bandwidth_hz, room)[:, None]
    distance = np.abs(frequency[:, None] - frequency[None, :])
    inside = distance < width * (1 - 1e-9)
    alpha = np.where(inside, 0.5 * (1 + np.cos(np.pi * distance / width)), 0.0)
    return np.asarray(alpha / alpha.sum(axis=1, keepdims=True))


def smooth(dataset: xr.Dataset, bandwidth_hz: float, *, weight: Real | None = None) -> xr.Dataset:
    """Smooth a frequency response over its lines, Wernholt (2004), (3.46).

        G(w) = sum_k alpha_k(w) G(w_k) / sum_k alpha_k(w)

    with alpha a Hann window of half width ``bandwidth_hz``, times ``weight`` (n_freq,) where
    given (for instance the power of the input). Lines that are NaN take no part and stay
    NaN. Variances are those of the weighted mean of independent lines.

    Bias: about h^2/6 (1 - 6/pi^2) of the second derivative of G over frequency with h the
    half width: resonances are flattened and widened. Narrower than a resonance (3 dB) is safe.

    Raises InputError for a bandwidth that is not positive, a wrong or negative weight.
    """
    frequency = dataset["frequency_hz"].values
    alpha = hann_weights(frequency, bandwidth_hz)
    if weight is not None:
        weight = np.asarray(weight, float)
        if weight.shape != frequency.shape or not np.all(weight >= 0):
            raise InputError(
                f"weight: expected {len(frequency)} numbers not below zero, got {weight!r}"
            )
        alpha = alpha * weight
    response = dataset["response"].values
    good = np.isfinite(response).all(axis=(1, 2))
    alpha = alpha * good
    total = alpha.sum(axis=1, keepdims=True)
    alpha = np.divide(alpha, total, out=np.zeros_like(alpha), where=total > 0)
    lost = ~good | (total[:, 0] <= 0)

    def mean(values: NDArray[np.generic], power: int) -> NDArray[np.generic]:
        usable = np.where(good[:, None, None], values, 0)
        out = np.tensordot(alpha**power, usable, axes=1)
        out[lost] = np.nan
        return np.asarray(out)

    changed = {"response": dataset["response"].copy(data=mean(response, 1))}
    for name in ("variance", "noise_variance"):
        if name in dataset:
            changed[name] = dataset[name].copy(data=mean(dataset[name].values, 2))
    flag = dataset["flag"].values.copy()
    flag[lost & (flag == Flag.GOOD)] = Flag.NO_EXCITATION
    out = dataset.assign(changed | {"flag": dataset["flag"].copy(data=flag)})
    if "degrees_of_freedom" in dataset:
        freedom = dataset["degrees_of_freedom"].values / np.sum(alpha**2, axis=1)[
            :, None, None
        ].clip(1e-12)
        out = with_freedom(out, np.where(lost[:, None, None], np.nan, freedom))
    out.attrs = dataset.attrs | {"smoothing_bandwidth_hz": float(bandwidth_hz)}
    return out
