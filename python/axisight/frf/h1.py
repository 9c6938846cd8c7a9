"""The classical estimates H1 and H2 from cross spectra."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr

from axisight.arguments import Complex, Real, instance
from axisight.errors import InputError
from axisight.frf._lines import (
    Quantity,
    condition_and_flag,
    expect_experiments,
    expect_options,
    in_noise,
    lost_lines,
    output_unit,
    provenance,
    spectra,
)
from axisight.frf.batch_solve import right_divide
from axisight.frf.confidence import with_freedom
from axisight.frf.response import Flag, frequency_response
from axisight.records.periodic import PeriodicRecords


def h1(
    records: PeriodicRecords,
    *,
    quantity: Quantity = "position",
    remove_drift: bool = True,
    threads: int = 1,
) -> xr.Dataset:
    """Return the H1 estimate G = S_yu S_uu^-1, with every period of every experiment as one record.

    S_yu is the sum of Y U^H, and S_uu that of U U^H. Records need not be synchronized.
    Pintelon and Schoukens (2001), section 2.6; Bendat and Piersol, Random Data.

    ``quantity``, ``remove_drift`` and ``threads`` are those of `mfrf`. The Dataset also has the
    multiple ``coherence`` of each output. With more experiments than inputs, ``variance`` comes from
    the residuals Y - G U of the experiments and includes noise and distortion. Otherwise it comes
    from the periods and includes noise only.

    Bias: noise on U makes the response too small, by the noise-to-signal power ratio of U;
    averaging does not help. In closed loop, noise fed back pulls G towards minus the inverse
    of the controller. H1 is exact without noise and distortion. On robots it is the worst of all
    estimators; it is here as the usual reference for comparison.

    Raises InputError for fewer experiments than inputs.
    """
    return _by_instrument(records, "h1", quantity, remove_drift, threads)


def h2(
    records: PeriodicRecords,
    *,
    quantity: Quantity = "position",
    remove_drift: bool = True,
    threads: int = 1,
) -> xr.Dataset:
    """Return the H2 estimate G = S_yy S_uy^-1, for as many outputs as inputs.

    ``quantity``, ``remove_drift``, ``threads``, Dataset and errors are those of `h1`; also raises
    InputError if the numbers of inputs and outputs differ.

    Bias: noise on Y makes the response too large, by the noise-to-signal power ratio of Y;
    noise on U averages out. H2 is exact without noise and distortion.
    """
    instance("records", records, PeriodicRecords)
    if records.n_outputs != records.n_inputs:
        raise InputError(
            f"records.output: H2 expects as many outputs as inputs ({records.n_inputs}), "
            f"got {records.n_outputs}"
        )
    return _by_instrument(records, "h2", quantity, remove_drift, threads)


class _Uncertainty(NamedTuple):
    variance: Real | None
    noise: Real | None
    freedom: Real


def _by_instrument(
    records: PeriodicRecords, name: str, quantity: Quantity, remove_drift: bool, threads: int
) -> xr.Dataset:
    """Return the estimate (sum Y Z^H) (sum U Z^H)^-1, with Z = U for H1 and Z = Y for H2."""
    expect_options(records, quantity, remove_drift, threads)
    expect_experiments(records, "S_uu is singular at every line")
    u, y = spectra(records, quantity, remove_drift=remove_drift, threads=threads)
    flat_u, flat_y = (s.reshape(*s.shape[:2], -1) for s in (u, y))
    z = flat_u if name == "h1" else flat_y
    condition, flag = condition_and_flag(flat_u)
    flag[in_noise(u) & (flag == Flag.GOOD)] = Flag.ILL_CONDITIONED
    crossed = _cross(flat_u, z)
    response, singular = right_divide(_cross(flat_y, z), crossed, threads=threads)
    flag[singular & (flag != Flag.NO_EXCITATION)] = Flag.RANK_DEFICIENT
    lost = lost_lines(flag)
    response[lost] = np.nan
    condition[lost] = np.nan
    residual = flat_y - response @ flat_u
    power = np.sum(np.abs(flat_y) ** 2, axis=2)
    left = np.sum(np.abs(residual) ** 2, axis=2)
    share = np.divide(left, power, out=np.full_like(power, np.nan), where=power > 0)
    # The contribution of each record to the error, (line, output, input, record).
    weight, _ = right_divide(z.conj().swapaxes(1, 2), crossed, threads=threads)
    parts = np.einsum("fir,frj->fijr", residual, weight)
    shape = (*response.shape, records.n_experiments, records.n_periods)
    found = _uncertainty(parts.reshape(shape), records.n_inputs)
    dataset = frequency_response(
        records.frequency_hz,
        response,
        estimator=name,
        variance=found.variance,
        noise_variance=found.noise,
        condition=condition,
        flag=flag,
        coherence=np.clip(1 - share, 0.0, 1.0),
        input_unit=records.input_unit,
        output_unit=output_unit(records, quantity),
        attrs=provenance(records, quantity),
    )
    return with_freedom(dataset, found.freedom)


def _cross(a: Complex, b: Complex) -> Complex:
    return np.asarray(a @ b.conj().swapaxes(1, 2))


def _uncertainty(parts: Complex, n_inputs: int) -> _Uncertainty:
    """Return the variances from the contributions to the error, (..., experiment, period)."""
    n_experiments, n_periods = parts.shape[-2:]
    noise = None
    freedom = float("nan")
    if n_periods > 1:
        scatter = np.abs(parts - parts.mean(axis=-1, keepdims=True)) ** 2
        noise = scatter.sum(axis=(-2, -1)) * n_periods / (n_periods - 1)
        freedom = float(n_experiments * (n_periods - 1))
    variance = noise
    if n_experiments > n_inputs:
        whole = np.abs(parts.sum(axis=-1)) ** 2
        freedom = float(n_experiments - n_inputs)
        variance = whole.sum(axis=-1) * n_experiments / freedom
    return _Uncertainty(variance, noise, np.full(parts.shape[:-2], freedom))
