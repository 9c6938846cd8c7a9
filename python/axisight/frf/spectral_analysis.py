"""Spectral analysis with smoothed spectra, for periodic and other data."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.sparse import csr_array

from axisight.arguments import Complex, Real, one_of
from axisight.errors import InputError
from axisight.frf._lines import (
    LARGE_CONDITION,
    SMALLEST,
    Quantity,
    expect_options,
    output_unit,
    provenance,
    spectra,
)
from axisight.frf.batch_solve import invert, right_divide
from axisight.frf.confidence import with_freedom
from axisight.frf.response import Flag, frequency_response
from axisight.frf.smoothing import hann_weights
from axisight.records.periodic import PeriodicRecords

HANN_CORRELATION = (2 / 3, 1 / 6)
"""Correlation of DFT lines one and two apart, for white noise with a Hann taper."""


def spectral_analysis(
    records: PeriodicRecords,
    *,
    bandwidth_hz: float,
    taper: Literal["none", "hann"] = "none",
    quantity: Quantity = "position",
    remove_drift: bool = True,
    threads: int = 1,
) -> xr.Dataset:
    """Return G = S_yu S_uu^-1 from spectra smoothed over neighbouring lines.

    Wernholt (2004), (3.47) to (3.49), with matrices for several inputs. Data need not be periodic.
    Give any other record as one period of one experiment, with all lines excited:

        PeriodicRecords(T, u[None, None], y[None, None], np.arange(1, (len(u) + 1) // 2))

    Spectra are summed over periods and experiments. A single experiment separates several inputs if
    they are independent over the bandwidth.

    bandwidth_hz
        Half width of the Hann window over frequency [Hz]. More than n_inputs lines must lie in it.
    taper
        "hann" multiplies each period by a Hann window against leakage, for data that are not
        periodic. Periodic data have no leakage and need none.
    quantity, remove_drift, threads
        As for `mfrf`.

    Returns the Dataset of `axisight.frf.frequency_response` with multiple ``coherence``.
    ``variance`` comes from the part of the output spectrum that G does not explain: noise,
    distortion, leakage and the curvature of G inside the window. ``condition`` is the square root of
    the condition number of S_uu, with inputs scaled to one.

    Bias: data that are not periodic leak, about 1/N. Smoothing flattens resonances, see `smooth`. In
    closed loop, noise pulls G towards minus the inverse of the controller (Wernholt (2004),
    section 3.7), for any length of the data. The estimate is exact for a constant G without noise.

    Raises InputError for a bandwidth that is not positive or too narrow for the number of inputs.
    """
    expect_options(records, quantity, remove_drift, threads)
    one_of("taper", taper, ("none", "hann"))
    alpha = hann_weights(records.frequency_hz, bandwidth_hz)
    tapered = _tapered(records) if taper == "hann" else records
    u, y = spectra(
        tapered, quantity, remove_drift=remove_drift and taper == "none", threads=threads
    )
    u, y = (s.reshape(*s.shape[:2], -1) for s in (u, y))
    freedom = _freedom(alpha, records.lines, taper) * u.shape[2] - records.n_inputs
    if np.all(freedom <= 0):
        raise InputError(
            f"bandwidth_hz: expected more than {records.n_inputs} independent lines in the "
            f"window, got a half width of {bandwidth_hz} Hz"
        )
    s_uu, s_yu = _smoothed(alpha, u, u), _smoothed(alpha, y, u)
    s_yy = np.asarray(alpha @ np.sum(np.abs(y) ** 2, axis=2))
    condition, flag = _condition(s_uu)
    response, singular = right_divide(s_yu, s_uu, threads=threads)
    flag[(singular | (freedom <= 0)) & (flag != Flag.NO_EXCITATION)] = Flag.RANK_DEFICIENT
    good = (flag == Flag.GOOD) | (flag == Flag.ILL_CONDITIONED)
    response[~good] = np.nan
    condition[~good] = np.nan
    explained = np.einsum("koi,koi->ko", response, s_yu.conj()).real
    left = np.maximum(s_yy - explained, 0.0)
    inverse, _ = invert(s_uu, threads=threads)
    gain = np.einsum("kii->ki", inverse).real
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = left[:, :, None] * gain[:, None, :] / freedom[:, None, None]
        coherence = np.clip(1 - left / s_yy, 0.0, 1.0)
    variance[~good] = np.nan
    coherence[~good] = np.nan
    dataset = frequency_response(
        records.frequency_hz,
        response,
        estimator="spectral_analysis",
        variance=variance,
        condition=condition,
        flag=flag,
        coherence=coherence,
        input_unit=records.input_unit,
        output_unit=output_unit(records, quantity),
        attrs=provenance(records, quantity) | {"bandwidth_hz": float(bandwidth_hz), "taper": taper},
    )
    spread = np.broadcast_to(freedom[:, None, None], response.shape)
    return with_freedom(dataset, np.where(good[:, None, None], spread, np.nan))


def _tapered(records: PeriodicRecords) -> PeriodicRecords:
    """Return the records with each period detrended and multiplied by a Hann window."""
    n = np.arange(records.n_samples)
    window = (0.5 - 0.5 * np.cos(2 * np.pi * n / records.n_samples))[:, None]
    ramp = (n - n.mean())[:, None]

    def of(signal: Real) -> Real:
        level = signal - signal.mean(axis=2, keepdims=True)
        slope = (level * ramp).sum(axis=2, keepdims=True) / (ramp**2).sum()
        return np.asarray((level - slope * ramp) * window)

    return replace(records, input=of(records.input), output=of(records.output))


def _smoothed(alpha: csr_array, a: Complex, b: Complex) -> Complex:
    """Return cross spectra, summed over records, then smoothed over lines."""
    crossed = a @ b.conj().swapaxes(1, 2)
    out = np.asarray(alpha @ crossed.reshape(len(crossed), -1))
    return np.ascontiguousarray(out.reshape(crossed.shape))


def _freedom(alpha: csr_array, lines: NDArray[np.int64], taper: str) -> Real:
    """Return the number of independent lines in each window, 1 / sum_kl alpha_k alpha_l rho_kl^2."""
    correlated = alpha
    if taper == "hann":
        for apart, value in enumerate(HANN_CORRELATION, start=1):
            # Pairs of given lines that lie ``apart`` lines from each other.
            low = np.flatnonzero(np.isin(lines + apart, lines))
            high = np.searchsorted(lines, lines[low] + apart)
            size = np.full(len(low), value**2)
            one = csr_array((size, (low, high)), shape=alpha.shape)
            correlated = correlated + alpha @ (one + one.T)
    return 1 / np.asarray(alpha.multiply(correlated).sum(axis=1))


def _condition(s_uu: Complex) -> tuple[Real, NDArray[np.int8]]:
    """Return the square root of the condition of S_uu, with inputs scaled to one, and flags."""
    power = np.einsum("kii->ki", s_uu).real
    silent = np.any(power <= SMALLEST**2 * power.max(axis=0), axis=1)
    scale = 1 / np.sqrt(np.where(power > 0, power, 1.0))
    value = np.linalg.eigvalsh(s_uu * scale[:, :, None] * scale[:, None, :])
    deficient = value[:, 0] <= 1e-14 * value[:, -1]
    condition = np.full(len(s_uu), np.nan)
    usable = ~(silent | deficient)
    condition[usable] = np.sqrt(value[usable, -1] / value[usable, 0])
    flag = np.where(condition > LARGE_CONDITION, Flag.ILL_CONDITIONED, Flag.GOOD)
    flag[deficient] = Flag.RANK_DEFICIENT
    flag[silent] = Flag.NO_EXCITATION
    return condition, flag.astype(np.int8)
