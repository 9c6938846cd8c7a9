"""The empirical transfer function estimate of one input, with optional smoothing."""

from __future__ import annotations

from typing import Literal

import numpy as np
import xarray as xr

from axisight.arguments import one_of
from axisight.errors import InputError
from axisight.frf._lines import Quantity, expect_options, spectra
from axisight.frf.arithmetic_mean import arithmetic_mean
from axisight.frf.smoothing import smooth
from axisight.records.periodic import PeriodicRecords


def etfe(
    records: PeriodicRecords,
    *,
    bandwidth_hz: float | None = None,
    weighting: Literal["flat", "input_power"] = "flat",
    quantity: Quantity = "position",
    remove_drift: bool = True,
    threads: int = 1,
) -> xr.Dataset:
    """Return G = Y / U of one input, from averaged periods, as the mean over experiments.

    Wernholt (2004), (3.45). With ``bandwidth_hz`` [Hz], the estimate is smoothed over the lines by
    (3.46), with a Hann window of that half width. ``weighting`` "input_power" also weights each line
    with |U|^2, which gives spectral analysis (3.49). ``quantity``, ``remove_drift``, ``threads``,
    Dataset and variances are those of `mfrf` and `arithmetic_mean`.

    Bias: exact for periodic records without noise. Without smoothing the variance does not
    fall with the length of a record that is not periodic. Smoothing flattens resonances, see
    `smooth`.

    Raises InputError for more than one input (use `mfrf`, then `smooth`), and for "input_power"
    without ``bandwidth_hz``.
    """
    expect_options(records, quantity, remove_drift, threads)
    if records.n_inputs != 1:
        raise InputError(
            f"records.input: ETFE expects one input, got {records.n_inputs}; use mfrf, then smooth"
        )
    one_of("weighting", weighting, ("flat", "input_power"))
    if bandwidth_hz is None and weighting == "input_power":
        raise InputError("weighting: expected a bandwidth_hz with input_power, got none")
    dataset = arithmetic_mean(
        records, quantity=quantity, remove_drift=remove_drift, threads=threads
    )
    if bandwidth_hz is not None:
        weight = None
        if weighting == "input_power":
            u, _ = spectra(records, quantity, remove_drift=remove_drift, threads=threads)
            weight = np.sum(np.abs(u.mean(axis=3)) ** 2, axis=(1, 2))
        dataset = smooth(dataset, bandwidth_hz, weight=weight)
    dataset.attrs["estimator"] = "etfe"
    return dataset
