"""The estimate ``Y U^-1``, Wernholt (2004), (3.52), where spectra are kept and not records."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.frf import right_divide

Complex = NDArray[np.complex128]


def mfrf(input_: Complex, output: Complex) -> Complex:
    """Return ``Y U^-1``, (..., n_freq, n_out, n_in); NaN where U is singular."""
    return right_divide(output, input_)[0]
