"""Smoothing of a frequency response over neighbouring lines."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array

from axisight.arguments import positive, reals, shown
from axisight.errors import InputError
from axisight.frf.confidence import with_freedom
from axisight.frf.response import Flag, estimate_of

Real = NDArray[np.float64]


def hann_weights(frequency_hz: Real, bandwidth_hz: float) -> csr_array:
    """Return weights alpha, (n_freq, n_freq), one row per smoothed line; each row sums to one.

    The weights are a Hann window over frequency that reaches zero at ``bandwidth_hz`` from its
    middle. At the ends of the band the window is narrower and stays symmetric, so that a straight
    line stays straight. Raises InputError for a bandwidth that is not positive.
    """
    bandwidth_hz = positive("bandwidth_hz", bandwidth_hz)
    frequency = np.asarray(frequency_hz, float)
    spacing = np.min(np.diff(frequency)) if len(frequency) > 1 else 1.0
    # One spacing more than the distance to the end, so that the outermost line keeps itself.
    room = np.minimum(frequency - frequency[0], frequency[-1] - frequency) + spacing
    # A much narrower window also holds one line only, but would divide by nearly zero.
    width = np.minimum(max(bandwidth_hz, 1e-3 * spacing), room) * (1 - 1e-9)
    first = np.searchsorted(frequency, frequency - width, side="right")
    count = np.searchsorted(frequency, frequency + width, side="left") - first
    start = np.concatenate([[0], np.cumsum(count)])
    row = np.repeat(np.arange(len(frequency)), count)
    column = np.arange(start[-1]) - start[row] + first[row]
    value = 1 + np.cos(np.pi * (frequency[row] - frequency[column]) / width[row])
    value /= np.add.reduceat(value, start[:-1])[row]
    return csr_array((value, column, start), shape=(len(frequency), len(frequency)))


def smooth(dataset: xr.Dataset, bandwidth_hz: float, *, weight: Real | None = None) -> xr.Dataset:
    """Return ``dataset`` with its response smoothed over the lines, Wernholt (2004), (3.46).

        G(w) = sum_k alpha_k(w) G(w_k) / sum_k alpha_k(w)

    Here alpha is a Hann window of half width ``bandwidth_hz`` [Hz], times ``weight`` (n_freq,) if
    given, for instance the power of the input. Lines that are NaN take no part and stay NaN.
    Variances are those of the weighted mean of independent lines.

    Bias: about h^2/6 (1 - 6/pi^2) times the second derivative of G over frequency, with h the half
    width. Smoothing flattens and widens resonances; a window narrower than a resonance (3 dB) is safe.

    Raises InputError for a bandwidth that is not positive, and for a wrong or negative weight.
    """
    frequency = estimate_of("dataset", dataset)["frequency_hz"].values
    alpha = hann_weights(frequency, bandwidth_hz)
    if weight is not None:
        what = f"{len(frequency)} numbers not below zero"
        weight = reals("weight", weight, what, 1)
        if weight.shape != frequency.shape or not np.all(weight >= 0):
            raise InputError(f"weight: expected {what}, got {shown(weight.tolist())}")
        alpha = alpha @ diags_array(weight)
    response = dataset["response"].values
    good = np.isfinite(response).all(axis=(1, 2))
    alpha = alpha @ diags_array(good.astype(float))
    total = np.asarray(alpha.sum(axis=1))
    lost = ~good | (total <= 0)
    alpha = diags_array(np.divide(1.0, total, out=np.zeros_like(total), where=total > 0)) @ alpha

    def mean(values: NDArray[Any], weights: csr_array) -> NDArray[Any]:
        usable = np.where(good[:, None, None], values, 0).reshape(len(frequency), -1)
        out = np.asarray(weights @ usable).reshape(values.shape)
        out[lost] = np.nan
        return out

    changed = {"response": dataset["response"].copy(data=mean(response, alpha))}
    for name in ("variance", "noise_variance"):
        if name in dataset:
            changed[name] = dataset[name].copy(data=mean(dataset[name].values, alpha.power(2)))
    flag = dataset["flag"].values.copy()
    flag[lost & (flag == Flag.GOOD)] = Flag.NO_EXCITATION
    out = dataset.assign(changed | {"flag": dataset["flag"].copy(data=flag)})
    if "degrees_of_freedom" in dataset:
        # Effective number of independent lines in each window.
        lines = 1 / np.asarray(alpha.power(2).sum(axis=1)).clip(1e-12)
        freedom = dataset["degrees_of_freedom"].values * lines[:, None, None]
        out = with_freedom(out, np.where(lost[:, None, None], np.nan, freedom))
    out.attrs = dataset.attrs | {"smoothing_bandwidth_hz": float(bandwidth_hz)}
    return out
