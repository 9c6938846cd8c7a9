"""Robust method: noise and nonlinear distortion separated over realizations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.arguments import Complex, Real
from axisight.errors import InputError
from axisight.frf._lines import (
    Quantity,
    condition_and_flag,
    expect_options,
    line_spectra,
    lost_lines,
    output_unit,
    provenance,
    spectra,
    worst_flag,
)
from axisight.frf.batch_solve import invert
from axisight.frf.response import DIMS, Flag, frequency_response
from axisight.records.periodic import PeriodicRecords


class Spectra(NamedTuple):
    """DFT lines, (realization, period, line, channel, experiment of the realization)."""

    input: Complex
    output: Complex
    reference: Complex | None


def robust_method(
    records: PeriodicRecords,
    *,
    quantity: Quantity = "position",
    remove_drift: bool = True,
    threads: int = 1,
) -> xr.Dataset:
    """Return the best linear approximation, with its noise variance and distortion variance.

    Sources: Pintelon and Schoukens (2012), section 4.3.1; D'haene, Pintelon, Schoukens and
    Van Gheem (2005), Variance analysis of frequency response function measurements using
    periodic excitations.

    records
        M >= 2 realizations of ``n_inputs`` consecutive experiments, equal in amplitude and
        independent in phase, each of P >= 2 periods in steady state. If the records have a reference
        with as many channels as inputs, the method averages the responses of input and output to it
        and divides them. In closed loop this avoids bias from noise at the input.
    quantity, remove_drift, threads
        As for `mfrf`.

    Scatter over the periods is noise. Scatter over the realizations is noise plus stochastic nonlinear
    distortion:

    - ``variance``: that of the mean over realizations, from their scatter (M - 1 complex degrees
      of freedom). The exact band of probability p has radius
      ``sqrt(q ((1 - p) ** (-1 / q) - 1) variance)`` with q = M - 1.
    - ``noise_variance``: the part of it due to noise, from the scatter over the periods
      (M (P - 1) degrees of freedom).
    - ``distortion_variance`` (frequency_hz, output, input): stochastic nonlinear distortion
      of a single realization, ``M (variance - noise_variance)``, but not below zero. More periods do
      not reduce it.

    Bias: none with respect to the best linear approximation for the class of the excitation, which
    depends on amplitude and spectrum. Without reference, noise at the input biases the estimate like
    the period-averaged MFRF. Drop transients first, because the method takes them for noise.

    ``condition`` is the largest condition number of U over realizations, rows scaled to norm one.

    Raises InputError for a single period or realization, and if the experiments do not form whole
    realizations.
    """
    expect_options(records, quantity, remove_drift, threads)
    n, total = records.n_inputs, records.n_experiments
    if total % n or total < 2 * n:
        raise InputError(
            f"records: expected at least 2 realizations of {n} experiments each (one for each "
            f"input), got {total} experiments"
        )
    count, periods = total // n, records.n_periods
    if periods < 2:
        raise InputError("records: expected at least 2 periods to tell the noise, got 1")
    data = _spectra(records, quantity, remove_drift, threads)
    condition, flag = excitation(data.input)
    divisor = data.input
    if data.reference is not None:
        divisor = data.reference
        other = excitation(divisor)[1]
        worse = (flag == Flag.GOOD) | ((flag == Flag.ILL_CONDITIONED) & lost_lines(other))
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
        output_unit=output_unit(records, quantity),
        attrs=provenance(records, quantity)
        | {"n_realizations": count, "degrees_of_freedom": count - 1},
    )
    distortion = count * np.maximum(variance - noise, 0.0)
    result["distortion_variance"] = (DIMS, distortion, {"units": result["variance"].units})
    return result


def _spectra(
    records: PeriodicRecords, quantity: Quantity, remove_drift: bool, threads: int
) -> Spectra:
    """Return the excited lines of every period."""
    n = records.n_inputs
    u, y = spectra(records, quantity, remove_drift=remove_drift, threads=threads)
    reference = None
    if records.reference is not None and records.reference.shape[3] == n:
        r = line_spectra(records.reference, records.lines, threads=threads)
        reference = by_realization(r, n)
    return Spectra(by_realization(u, n), by_realization(y, n), reference)


def by_realization(signal: Complex, n: int) -> Complex:
    """Return (line, channel, experiment, period) in the axis order of :class:`Spectra`."""
    lines, channels, experiments, periods = signal.shape
    parts = signal.reshape(lines, channels, experiments // n, n, periods)
    return np.ascontiguousarray(parts.transpose(2, 4, 0, 1, 3))


def excitation(signal: Complex) -> tuple[Real, NDArray[np.int8]]:
    """Return the worst condition over realizations of the scaled period mean, and flags."""
    found = [condition_and_flag(u) for u in signal.mean(axis=1)]
    conditions, flags = (np.array(part) for part in zip(*found, strict=True))
    flag = worst_flag(flags)
    return np.where(lost_lines(flag), np.nan, conditions.max(axis=0)), flag


def inverse(matrix: Complex, flag: NDArray[np.int8]) -> Complex:
    """Return inverses over the last two axes, NaN at lines (third last axis) flagged unusable."""
    out, _ = invert(matrix)
    out[..., lost_lines(flag), :, :] = np.nan
    return out


def period_variance(error: Complex) -> Real:
    """Return the variance of the mean over the periods, axis 1."""
    periods = error.shape[1]
    scatter = error - error.mean(axis=1, keepdims=True)
    return np.asarray(np.sum(np.abs(scatter) ** 2, axis=1) / (periods - 1) / periods)


def _divide(data: Spectra, weight: Complex, flag: NDArray[np.int8]) -> tuple[Complex, Complex]:
    """Return the response, and the matrices that turn an error of Y into an error of the response."""
    from_reference = inverse((data.input.mean(axis=1) @ weight).mean(axis=0), flag)
    response = (data.output.mean(axis=1) @ weight).mean(axis=0) @ from_reference
    return response, weight @ from_reference
