"""Robust method: noise and nonlinear distortion separated over realizations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.frf.response import DIMS, Flag, frequency_response
from axisight.records.periodic import PeriodicRecords

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]

SILENT = 1e-12
"""Share of the largest amplitude that rounding may leave at a line without excitation."""


class Spectra(NamedTuple):
    """DFT lines, (realization, period, line, channel, experiment of the realization)."""

    input: Complex
    output: Complex
    reference: Complex | None


def robust_method(records: PeriodicRecords) -> xr.Dataset:
    """Return the best linear approximation, with its noise and its distortion variance.

    Sources: Pintelon and Schoukens (2012), section 4.3.1; D'haene, Pintelon, Schoukens and
    Van Gheem (2005), Variance analysis of frequency response function measurements using
    periodic excitations.

    records
        M >= 2 realizations of ``n_inputs`` experiments in a row, equal in amplitude and
        independent in phase, of P >= 2 periods each in steady state. A recorded reference
        with as many channels as inputs is used: responses from it to input and output are
        averaged and divided, which in closed loop is unbiased by noise at the input.

    Scatter over the periods is noise; scatter over the realizations is noise and stochastic
    nonlinear distortion together:

    - ``variance``: of the mean over realizations, from their scatter (M - 1 complex degrees
      of freedom). The exact band of probability p has radius
      ``sqrt(q ((1 - p) ** (-1 / q) - 1) variance)`` with q = M - 1.
    - ``noise_variance``: the share of the noise, from the scatter over the periods
      (M (P - 1) degrees of freedom).
    - ``distortion_variance`` (frequency_hz, output, input): stochastic nonlinear distortion
      of a single realization, ``M (variance - noise_variance)``, zero where the difference
      is below zero. It stays when more periods are measured.

    Bias: none towards the best linear approximation of the excitation's class, which itself
    depends on amplitude and spectrum. Without reference, noise at the input biases as it
    does the period-averaged MFRF. Transients are taken for noise: drop them first.

    ``condition`` is the largest over realizations of U with its rows scaled to norm one.

    Raises InputError for a single period or realization and for experiments that do not
    make whole realizations.
    """
    n, total = records.n_inputs, records.n_experiments
    if total % n or total < 2 * n:
        raise InputError(
            f"records: expected at least 2 realizations of {n} experiments each (one for each "
            f"input), got {total} experiments"
        )
    count, periods = total // n, records.n_periods
    if periods < 2:
        raise InputError("records: expected at least 2 periods to tell the noise, got 1")
    data = spectra(records, records.lines)
    condition, flag = excitation(data.input)
    divisor = data.input
    if data.reference is not None:
        divisor = data.reference
        other = excitation(divisor)[1]
        lost = (other == Flag.RANK_DEFICIENT) | (other == Flag.NO_EXCITATION)
        worse = (flag == Flag.GOOD) | ((flag == Flag.ILL_CONDITIONED) & lost)
        flag = np.where(worse, other, flag)
    weight = inverse(divisor.mean(axis=1), flag)
    response, weight = _divide(data, weight, flag)
    error = (data.output - response @ data.input) @ weight[:, None]
    mean = error.mean(axis=1)
    variance = np.sum(np.abs(mean) ** 2, axis=0) / (count - 1) / count
    noise = period_variance(error).sum(axis=0) / count**2
    result = frequency_response(
        records.frequency_hz,
        response,
        estimator="robust_method",
        variance=variance,
        noise_variance=noise,
        condition=condition,
        flag=flag,
        input_unit=records.input_unit,
        output_unit=records.output_unit,
        attrs={"n_realizations": count, "n_periods": periods, "degrees_of_freedom": count - 1},
    )
    distortion = count * np.maximum(variance - noise, 0.0)
    result["distortion_variance"] = (DIMS, distortion, {"units": result["variance"].units})
    return result


def spectra(records: PeriodicRecords, lines: NDArray[np.int64]) -> Spectra:
    """Return lines of the DFT of every period."""
    n = records.n_inputs

    def transform(signal: Real) -> Complex:
        out = np.fft.rfft(signal, axis=2)[:, :, lines]
        out = out.reshape(-1, n, *out.shape[1:])
        return np.ascontiguousarray(np.moveaxis(out, 1, -1))

    reference = records.reference
    usable = reference is not None and reference.shape[3] == n
    return Spectra(
        transform(records.input),
        transform(records.output),
        transform(reference) if usable and reference is not None else None,
    )


def excitation(signal: Complex) -> tuple[Real, NDArray[np.int8]]:
    """Return the worst condition over realizations of the scaled period mean, and flags."""
    u = signal.mean(axis=1)
    rows = np.linalg.norm(u, axis=-1)
    silent = np.any(rows <= SILENT * rows.max(axis=1, keepdims=True), axis=(0, 2))
    scaled = u / np.where(rows > 0, rows, 1.0)[..., None]
    values = np.linalg.svd(scaled, compute_uv=False)
    deficient = np.any(values[..., -1] <= SILENT * values[..., 0], axis=0)
    good = ~(silent | deficient)
    condition = np.full(good.shape, np.nan)
    condition[good] = np.max(values[:, good, 0] / values[:, good, -1], axis=0)
    flag = np.where(np.nan_to_num(condition) > 1e3, Flag.ILL_CONDITIONED, Flag.GOOD)
    flag = np.where(deficient, Flag.RANK_DEFICIENT, flag)
    flag = np.where(silent, Flag.NO_EXCITATION, flag)
    return condition, flag.astype(np.int8)


def inverse(matrix: Complex, flag: NDArray[np.int8]) -> Complex:
    """Invert over the last two axes; lines (third last axis) flagged unusable are NaN."""
    out = np.full(matrix.shape, np.nan, np.complex128)
    good = (flag == Flag.GOOD) | (flag == Flag.ILL_CONDITIONED)
    out[..., good, :, :] = np.linalg.inv(matrix[..., good, :, :])
    return out


def period_variance(error: Complex) -> Real:
    """Return the variance of the mean over the periods, axis 1."""
    periods = error.shape[1]
    scatter = error - error.mean(axis=1, keepdims=True)
    return np.asarray(np.sum(np.abs(scatter) ** 2, axis=1) / (periods - 1) / periods)


def _divide(data: Spectra, weight: Complex, flag: NDArray[np.int8]) -> tuple[Complex, Complex]:
    """Return the response and the matrices that turn an error of Y into one of it."""
    from_reference = inverse((data.input.mean(axis=1) @ weight).mean(axis=0), flag)
    response = (data.output.mean(axis=1) @ weight).mean(axis=0) @ from_reference
    return response, weight @ from_reference
