"""Logarithmic (geometric) mean of the responses of several realizations."""

from __future__ import annotations

from typing import Literal

import numpy as np
import xarray as xr

from axisight.errors import InputError
from axisight.frf._lines import Quantity
from axisight.frf._realizations import Realizations, averaged, stack


def logarithmic_mean(
    data: Realizations,
    *,
    phase: Literal["angle", "arithmetic"] = "angle",
    quantity: Quantity = "position",
    remove_drift: bool = True,
    threads: int = 1,
) -> xr.Dataset:
    """Average log|G| and the phase over realizations, Wernholt (2004), (7.8) to (7.10).

    phase
        "angle" is the mean of the angles (7.10), each counted from the direction of the mean
        of the unit phasors, so that angles about plus and minus 180 degrees are neighbours;
        "arithmetic" is the phase of the arithmetic mean (7.7). (7.9) is for one input and one
        output only; "arithmetic" on records without noise on U is the same.
    data, quantity, remove_drift, threads
        As for `arithmetic_mean`; Dataset, variances and errors too. The variance is that of
        the mean of log G, times |G|^2.

    Bias: exact without noise and distortion. Less ruled by outliers of a small U than the
    arithmetic mean; inconsistent all the same: where the error is as large as G itself
    (elements off the diagonal at low frequency, notches) log|G| is too large and stays so
    with any number of realizations. An element that is exactly zero in one realization is
    zero.
    """
    if phase not in ("angle", "arithmetic"):
        raise InputError(f"phase: expected angle or arithmetic, got {phase!r}")
    found = stack(data, quantity, remove_drift, threads)
    single = found.response
    with np.errstate(divide="ignore", invalid="ignore"):
        size = np.log(np.abs(single))
        unit = np.where(np.abs(single) > 0, single / np.abs(single), 1.0)
        towards = found.mean(unit)
        turned = np.angle(unit * np.conj(towards))
        mean_size = found.mean(size.astype(complex)).real
        mean_turn = found.mean(turned.astype(complex)).real
        direction = np.angle(towards) + mean_turn
        if phase == "arithmetic":
            direction = np.angle(found.mean(single))
        response = np.exp(mean_size + 1j * direction)
        silent = np.isneginf(mean_size)
        response[silent] = 0.0
        deviation = response * ((size - mean_size) + 1j * (turned - mean_turn))
    deviation[:, silent] = single[:, silent]
    return averaged(found, "logarithmic_mean", response, deviation, phase=phase)
