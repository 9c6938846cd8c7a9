"""Harmonic mean of the responses of several realizations."""

from __future__ import annotations

import numpy as np
import xarray as xr

from axisight.errors import InputError
from axisight.frf._lines import Quantity
from axisight.frf._realizations import Realizations, averaged, stack
from axisight.frf.batch_solve import invert
from axisight.frf.response import Flag


def harmonic_mean(
    data: Realizations,
    *,
    quantity: Quantity = "position",
    remove_drift: bool = True,
    threads: int = 1,
) -> xr.Dataset:
    """Return the inverse of the mean of the inverse responses G_j^-1.

    Wernholt and Moberg (2008). ``data``, ``quantity``, ``remove_drift``, ``threads``,
    Dataset and errors are those of `arithmetic_mean`. The variance is that of the mean inverse,
    carried over by dG = -G d(G^-1) G. A realization loses the lines where its G_j is singular.

    Bias: exact without noise and distortion. G^-1 = U Y^-1 divides by the output, so that noise on U
    averages out and noise on Y biases the result. Use it in closed loop if the controller feeds noise
    into U and the output is measured well. Do not use it where Y is small (anti-resonances).

    Also raises InputError if the numbers of inputs and outputs differ.
    """
    found = stack(data, quantity, remove_drift, threads)
    n_outputs, n_inputs = found.response.shape[2:]
    if n_outputs != n_inputs:
        raise InputError(
            f"data: a harmonic mean expects as many outputs as inputs, got {n_outputs} and "
            f"{n_inputs}"
        )
    inverse, singular = invert(found.response, threads=threads)
    found.flag[singular & (found.flag == Flag.GOOD)] = Flag.RANK_DEFICIENT
    found.response[singular] = np.nan
    mean = found.mean(inverse)
    response, lost = invert(mean, threads=threads)
    found.response[:, lost] = np.nan
    with np.errstate(invalid="ignore"):
        deviation = -response @ (inverse - mean) @ response
    return averaged(found, "harmonic_mean", response, deviation)
