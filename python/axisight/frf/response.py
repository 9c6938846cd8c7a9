"""What every estimator returns: a frequency response with its uncertainty.

An ``xarray.Dataset`` over ``frequency_hz``, ``output`` and ``input`` (axes count from 1):

================== ============================= ==========================================
variable           dims                          meaning
================== ============================= ==========================================
response           frequency_hz, output, input   G(i w), complex [output unit / input unit]
variance           frequency_hz, output, input   E|dG|^2 of the estimate: noise and
                                                 nonlinear distortion; NaN where unknown
noise_variance     the same, optional            the share of the noise in it
condition          frequency_hz                  condition number of U, rows scaled to unit norm;
                                                 NaN if not used
flag               frequency_hz                  see :class:`Flag`
coherence          frequency_hz, output          multiple coherence, optional
degrees_of_freedom frequency_hz, output, input   complex, of ``variance``; optional, used by
                                                 :func:`axisight.frf.confidence_radius`
================== ============================= ==========================================

With a circular complex normal error the band of probability p about G is a disc of radius
``sqrt(-ln(1 - p) * variance)``; for 95 % that is ``1.73 sqrt(variance)``. With few degrees of
freedom it is wider: :func:`axisight.frf.confidence_radius`.

A line that cannot be estimated is NaN and flagged; a number is never infinite.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight import _core
from axisight.errors import InputError

DIMS = ("frequency_hz", "output", "input")


class Flag(IntEnum):
    """Why a line is not to be trusted."""

    GOOD = 0
    RANK_DEFICIENT = 1
    """The experiments do not excite all inputs at this line: NaN."""
    ILL_CONDITIONED = 2
    """The response is given, but errors are amplified more than a thousandfold, or the weakest
    direction of the input is lost in its noise."""
    NO_EXCITATION = 3
    """An input has no amplitude at this line: NaN."""


def frequency_response(
    frequency_hz: NDArray[np.float64],
    response: NDArray[np.complex128],
    *,
    estimator: str,
    variance: NDArray[np.float64] | None = None,
    noise_variance: NDArray[np.float64] | None = None,
    condition: NDArray[np.float64] | None = None,
    flag: NDArray[np.int8] | None = None,
    coherence: NDArray[np.float64] | None = None,
    degrees_of_freedom: NDArray[np.float64] | None = None,
    input_unit: str = "Nm",
    output_unit: str = "rad",
    attrs: dict[str, Any] | None = None,
) -> xr.Dataset:
    """Return the Dataset described above from arrays of shape (n_freq, n_out, n_in).

    frequency_hz
        Frequencies [Hz], (n_freq,), ascending.
    response
        G, complex; ``variance`` and ``noise_variance`` are real, of the same shape.
    estimator
        Its name, for the attributes.
    input_unit, output_unit
        Units of the channels, for labels.
    condition, flag, coherence
        (n_freq,), (n_freq,) and (n_freq, n_out).
    degrees_of_freedom
        Complex, of ``variance``, of its shape.
    attrs
        More provenance, e.g. numbers of experiments and periods.

    A line where any element is not finite becomes NaN throughout, and is flagged.

    Raises InputError for shapes that do not fit.
    """
    shape = response.shape
    if len(shape) != 3 or shape[0] != len(frequency_hz):
        raise InputError(
            f"response: expected shape ({len(frequency_hz)}, n_out, n_in), got {shape}"
        )
    unit = f"{output_unit}/{input_unit}"
    n = shape[0]
    known = np.asarray(np.isfinite(response).all(axis=(1, 2)))
    response = np.where(known[:, None, None], response, np.nan)
    variables: dict[str, Any] = {"response": (DIMS, response, {"units": unit})}
    squared = {"variance": variance, "noise_variance": noise_variance}
    if variance is None:
        squared["variance"] = np.full(shape, np.nan)
    for name, value in squared.items():
        if value is not None:
            _expect(name, value, shape)
            finite = np.where(np.isfinite(value) & known[:, None, None], value, np.nan)
            variables[name] = (DIMS, finite, {"units": f"({unit})^2"})
    condition = np.full(n, np.nan) if condition is None else condition
    flag = np.zeros(n, np.int8) if flag is None else flag.astype(np.int8)
    _expect("condition", condition, (n,))
    _expect("flag", flag, (n,))
    # A line without numbers is never good, whatever took them.
    lost = ~known & np.isin(flag, (Flag.GOOD, Flag.ILL_CONDITIONED))
    flag = np.where(lost, Flag.RANK_DEFICIENT, flag).astype(np.int8)
    variables["condition"] = (DIMS[:1], condition, {"units": "1"})
    meanings = {"flag_values": [f.value for f in Flag], "flag_meanings": _meanings()}
    variables["flag"] = (DIMS[:1], flag, meanings)
    if coherence is not None:
        _expect("coherence", coherence, shape[:2])
        variables["coherence"] = (DIMS[:2], coherence, {"units": "1"})
    if degrees_of_freedom is not None:
        _expect("degrees_of_freedom", degrees_of_freedom, shape)
        variables["degrees_of_freedom"] = (DIMS, degrees_of_freedom, {"units": "1"})
    return xr.Dataset(
        variables,
        coords={
            "frequency_hz": (DIMS[:1], np.asarray(frequency_hz, float), {"units": "Hz"}),
            "output": np.arange(1, shape[1] + 1),
            "input": np.arange(1, shape[2] + 1),
        },
        attrs={
            "estimator": estimator,
            "input_unit": input_unit,
            "output_unit": output_unit,
            "axisight_version": _core.__version__,
            **(attrs or {}),
        },
    )


def _meanings() -> str:
    return " ".join(f.name.lower() for f in Flag)


def _expect(name: str, value: NDArray[Any], shape: tuple[int, ...]) -> None:
    if value.shape != shape:
        raise InputError(f"{name}: expected shape {shape}, got {value.shape}")
