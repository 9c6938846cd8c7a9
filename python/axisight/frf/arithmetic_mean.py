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
    """Return the mean of G over realizations, Wernholt (2004), (7.7).

    data
        PeriodicRecords with whole realizations (each n_inputs consecutive experiments), a list
        of them, a list of Datasets of `mfrf`, or one Dataset with a dimension ``realization``.
        Realizations need not be synchronized.
    quantity, remove_drift, threads
        As for `mfrf`, which estimates each realization; they do not affect given Datasets.

    Returns the Dataset of `axisight.frf.frequency_response`. ``variance`` comes from the scatter of
    the realizations and includes noise and nonlinear distortion. ``noise_variance`` comes from their
    periods. With one realization both are the same. A line that a realization lacks is averaged over
    the others; ``condition`` is the worst.

    Bias: exact without noise and distortion. Noise on U biases the quotient Y U^-1 of every
    realization, and the mean keeps that bias. The bias is the smallest of all averages if U is far
    above its noise; otherwise outliers dominate the mean.

    Raises InputError for a realization with missing experiments, and for responses that differ in
    shape or frequencies.
    """
    found = stack(data, quantity, remove_drift, threads)
    response = found.mean(found.response)
    return averaged(found, "arithmetic_mean", response, found.response - response)
