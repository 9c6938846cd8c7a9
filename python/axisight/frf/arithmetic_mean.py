"""Arithmetic mean of the responses of several realizations."""

from __future__ import annotations

import xarray as xr

from axisight.frf._lines import Quantity
from axisight.frf._realizations import Realizations, averaged, stack


def arithmetic_mean(
    data: Realizations,
    *,
    quantity: Quantity = "position",
    remove_drift: bool = True,
    threads: int = 1,
) -> xr.Dataset:
    """Average G over realizations, Wernholt (2004), (7.7).

    data
        PeriodicRecords with whole realizations (n_inputs experiments in a row each), a list
        of them, a list of Datasets as `mfrf` returns, or one Dataset with a dimension
        ``realization``. Realizations need not be synchronized.
    quantity, remove_drift, threads
        As for `mfrf`, which estimates each realization; without effect on given Datasets.

    Returns the Dataset of `axisight.frf.frequency_response`. ``variance`` comes from the
    scatter of the realizations: noise and the nonlinear distortion that changes with them;
    ``noise_variance`` from their periods. The two are the same with one realization. A line
    that a realization lacks is averaged over the others; ``condition`` is the worst.

    Bias: exact without noise and distortion. Y U^-1 is a quotient, so that noise on U biases
    every realization; the mean keeps that bias. It is the smallest of all averages where U
    is far above its noise, and the average is ruled by outliers where it is not.

    Raises InputError for a realization with experiments missing or responses that differ in
    shape or frequencies.
    """
    found = stack(data, quantity, remove_drift, threads)
    response = found.mean(found.response)
    return averaged(found, "arithmetic_mean", response, found.response - response)
