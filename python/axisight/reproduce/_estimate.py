"""The estimator ``Y U^-1``, Wernholt (2004), (3.52), from recorded periods."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.records import PeriodicRecords

Complex = NDArray[np.complex128]


def spectra(records: PeriodicRecords) -> tuple[Complex, Complex]:
    """Return U and Y at the excited lines, (n_freq, channel, experiment), averaged over periods."""
    return tuple(  # type: ignore[return-value]
        np.moveaxis(np.fft.rfft(x.mean(axis=1), axis=1)[:, records.lines], 0, -1)
        for x in (records.input, records.output)
    )


def mfrf(input_: Complex, output: Complex) -> Complex:
    """Return ``Y U^-1``, (n_freq, n_out, n_in)."""
    return np.asarray(output @ np.linalg.inv(input_))
