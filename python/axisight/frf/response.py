"""The Dataset that every estimator returns: a frequency response with its uncertainty.

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
freedom the disc is wider, see :func:`axisight.frf.confidence_radius`.

A line that cannot be estimated is NaN and flagged; a response is never infinite.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight import _core
from axisight.arguments import complex_array, instance, real_array, reals, shown, words
from axisight.errors import InputError

DIMS = ("frequency_hz", "output", "input")


class Flag(IntEnum):
    """Quality of an estimate at a line, and the reason if it cannot be trusted."""

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
    """Return the Dataset of an estimate, as described in this module, from its arrays.

    frequency_hz
        Frequencies [Hz], (n_freq,), ascending.
    response
        G, complex, (n_freq, n_out, n_in); ``variance`` and ``noise_variance`` are real, of the same
        shape.
    estimator
        Name of the estimator, for the attributes.
    input_unit, output_unit
        Units of the channels, for labels.
    condition, flag, coherence
        (n_freq,), (n_freq,) and (n_freq, n_out).
    degrees_of_freedom
        Complex degrees of freedom of ``variance``, of the same shape.
    attrs
        More provenance, e.g. numbers of experiments and periods.

    If any element of a line is not finite, the whole line becomes NaN and is flagged. An infinite
    variance marks an element as unknown; fits leave it out.

    Raises InputError for shapes that do not fit, frequencies that do not ascend, and unknown flags.
    """
    frequency_hz = reals("frequency_hz", frequency_hz, "frequencies of shape (n_freq,)", 1)
    if np.any(np.diff(frequency_hz) <= 0):
        raise InputError("frequency_hz: expected ascending frequencies")
    for name, text in (
        ("estimator", estimator),
        ("input_unit", input_unit),
        ("output_unit", output_unit),
    ):
        words(name, text)
    instance("attrs", {} if attrs is None else attrs, dict)
    response = complex_array("response", response)
    shape = response.shape
    if len(shape) != 3 or shape[0] != len(frequency_hz) or 0 in shape:
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
            given = _expect(name, value, shape)
            at_known = np.where(known[:, None, None], given, np.nan)
            variables[name] = (DIMS, at_known, {"units": f"({unit})^2"})
    condition = _expect("condition", np.full(n, np.nan) if condition is None else condition, (n,))
    flag = _expect("flag", np.zeros(n, np.int8) if flag is None else flag, (n,))
    if not np.isin(flag, list(Flag)).all():
        raise InputError(f"flag: expected flags {', '.join(str(int(f)) for f in Flag)}")
    condition = np.where(np.isfinite(condition), condition, np.nan)
    # A line without numbers is never good, for any reason.
    lost = ~known & np.isin(flag, (Flag.GOOD, Flag.ILL_CONDITIONED))
    flag = np.where(lost, Flag.RANK_DEFICIENT, flag).astype(np.int8)
    variables["condition"] = (DIMS[:1], condition, {"units": "1"})
    meanings = {"flag_values": [f.value for f in Flag], "flag_meanings": _meanings()}
    variables["flag"] = (DIMS[:1], flag, meanings)
    if coherence is not None:
        coherence = _expect("coherence", coherence, shape[:2])
        coherence = np.where(np.isfinite(coherence), coherence, np.nan)
        variables["coherence"] = (DIMS[:2], coherence, {"units": "1"})
    if degrees_of_freedom is not None:
        freedom = _expect("degrees_of_freedom", degrees_of_freedom, shape)
        freedom = np.where(np.isfinite(freedom), freedom, np.nan)
        variables["degrees_of_freedom"] = (DIMS, freedom, {"units": "1"})
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


def estimate_of(field: str, value: object, *, uncertain: bool = True) -> xr.Dataset:
    """Return ``value`` if it is a Dataset of `frequency_response`; raises InputError for anything else.

    The variance may be absent unless ``uncertain``.
    """
    if not isinstance(value, xr.Dataset):
        raise InputError(f"{field}: expected a frequency response, got {type(value).__name__}")
    needed: dict[str, tuple[str, ...]] = {
        "response": DIMS,
        "frequency_hz": DIMS[:1],
        "condition": DIMS[:1],
        "flag": DIMS[:1],
    }
    if uncertain:
        needed["variance"] = DIMS
    for name, dims in needed.items():
        if name not in value.variables or value[name].dims != dims:
            raise InputError(
                f"{field}: expected a frequency response, with variable {name} over {', '.join(dims)}, got "
                f"a Dataset with {', '.join(map(str, value.variables)) or 'nothing'}"
            )
    return value


def _meanings() -> str:
    return " ".join(f.name.lower() for f in Flag)


def _expect(name: str, value: object, shape: tuple[int, ...]) -> NDArray[Any]:
    array = real_array(value)
    if array is None or array.shape != shape:
        got = shown(value) if array is None else str(array.shape)
        raise InputError(f"{name}: expected real numbers of shape {shape}, got {got}")
    return array
