"""Logarithmic (geometric) mean of the responses of several realizations."""

from __future__ import annotations

from typing import Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.arguments import Complex, one_of
from axisight.errors import InputError
from axisight.frf._lines import Quantity, spectra
from axisight.frf._realizations import Realizations, averaged, stack
from axisight.records.periodic import PeriodicRecords


def logarithmic_mean(
    data: Realizations,
    *,
    phase: Literal["angle", "arithmetic", "cross_spectrum"] = "angle",
    quantity: Quantity = "position",
    remove_drift: bool = True,
    threads: int = 1,
) -> xr.Dataset:
    """Return the mean of log|G| and of the phase over realizations, Wernholt (2004), (7.8) to (7.10).

    phase
        "angle" is the mean of the angles (7.10), each counted from the direction of the mean of the
        unit phasors, so that angles near plus and minus 180 degrees average correctly. "arithmetic" is
        the phase of the arithmetic mean (7.7). "cross_spectrum" is the phase of the mean of
        ``Y conj(U)`` (7.9), which weights every realization with the power of its input; it needs
        PeriodicRecords of one input.
    data, quantity, remove_drift, threads
        As for `arithmetic_mean`, like Dataset, variances and errors. The variance is that of the mean
        of log G, times |G|^2.

    Bias: exact without noise and distortion. Outliers from a small U have less influence than on the
    arithmetic mean. The mean is still inconsistent: if the error is as large as G (elements off the
    diagonal at low frequency, notches), log|G| is too large for any number of realizations. An
    element that is exactly zero in one realization is zero.
    """
    one_of("phase", phase, ("angle", "arithmetic", "cross_spectrum"))
    found = stack(data, quantity, remove_drift, threads)
    crossed = None
    if phase == "cross_spectrum":
        crossed = _crossed(data, found.usable, quantity, remove_drift, threads)
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
        elif crossed is not None:
            direction = np.angle(crossed)
        response = np.exp(mean_size + 1j * direction)
        silent = np.isneginf(mean_size)
        response[silent] = 0.0
        deviation = response * ((size - mean_size) + 1j * (turned - mean_turn))
    deviation[:, silent] = single[:, silent]
    return averaged(found, "logarithmic_mean", response, deviation, phase=phase)


def _crossed(
    data: Realizations,
    usable: NDArray[np.bool_],
    quantity: Quantity,
    remove_drift: bool,
    threads: int,
) -> Complex:
    """Return the sum of ``Y conj(U)`` over usable realizations, (n_freq, n_out, 1), periods averaged."""
    sets = [data] if isinstance(data, PeriodicRecords | xr.Dataset) else list(data)
    parts = []
    for records in sets:
        if not isinstance(records, PeriodicRecords) or records.n_inputs != 1:
            raise InputError(
                "phase: expected PeriodicRecords of one input for cross_spectrum, got "
                + (
                    f"{records.n_inputs} inputs"
                    if isinstance(records, PeriodicRecords)
                    else type(records).__name__
                )
            )
        u, y = spectra(records, quantity, remove_drift=remove_drift, threads=threads)
        # With one input every experiment is a realization: (n_freq, n_out, realization).
        parts.append(y.mean(axis=3) * u.mean(axis=3).conj())
    every = np.moveaxis(np.concatenate(parts, axis=2), 2, 0)[..., None]
    return np.asarray(np.where(usable, every, 0).sum(axis=0))
