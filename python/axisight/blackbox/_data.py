"""Shared by all methods: checks of experiments and orders, fits in per cent."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from axisight.errors import InputError
from axisight.records.experiment import Experiment

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Integers = NDArray[np.int64]


def gathered(experiments: Experiment | Sequence[Experiment], name: str) -> list[Experiment]:
    """Return one or several experiments as a list; they must share sample time and channels."""
    found = [experiments] if isinstance(experiments, Experiment) else list(experiments)
    if not found:
        raise InputError(f"{name}: expected at least one experiment, got none")
    for k, e in enumerate(found, 1):
        if not isinstance(e, Experiment):
            raise InputError(f"{name}: expected experiments, got {type(e).__name__} at {k}")
        same = (e.input.shape[1], e.output.shape[1])
        wanted = (found[0].input.shape[1], found[0].output.shape[1])
        if same != wanted:
            raise InputError(
                f"{name}: expected {wanted[0]} inputs and {wanted[1]} outputs as in the first "
                f"experiment, got {same[0]} and {same[1]} in experiment {k}"
            )
        if abs(e.sample_time_s - found[0].sample_time_s) > 1e-9 * found[0].sample_time_s:
            raise InputError(
                f"{name}: expected the sample time {found[0].sample_time_s} s of the first "
                f"experiment, got {e.sample_time_s} s in experiment {k}; resample first"
            )
    return found


def order_matrix(name: str, value: ArrayLike, shape: tuple[int, int], least: int) -> Integers:
    """Return orders or delays broadcast to ``shape``, none below ``least``."""
    array = np.asarray(value)
    if array.dtype.kind not in "iu":
        raise InputError(f"{name}: expected whole numbers, got {value!r}")
    try:
        out = np.broadcast_to(array, shape).astype(np.int64)
    except ValueError:
        raise InputError(
            f"{name}: expected one number or shape {shape}, got shape {array.shape}"
        ) from None
    if np.any(out < least):
        raise InputError(f"{name}: expected numbers from {least} on, got {int(out.min())}")
    return out


def whole(name: str, value: int, least: int) -> int:
    """Return a whole number that is at least ``least``."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise InputError(f"{name}: expected a whole number from {least} on, got {value!r}")
    return int(value)


def lines(frequency_hz: ArrayLike, sample_time_s: float | None) -> Real:
    """Return ascending finite frequencies, up to Nyquist where there is a sample time."""
    f = np.atleast_1d(np.asarray(frequency_hz, np.float64))
    if f.ndim != 1 or not f.size or not np.isfinite(f).all() or np.any(np.diff(f) <= 0):
        raise InputError("frequency_hz: expected ascending finite frequencies, shape (n_freq,)")
    if f[0] < 0:
        raise InputError(f"frequency_hz: expected frequencies from 0 on, got {f[0]:g}")
    if sample_time_s is not None and f[-1] > 0.5 / sample_time_s * (1 + 1e-12):
        raise InputError(
            f"frequency_hz: expected at most {0.5 / sample_time_s:g} Hz (Nyquist), got {f[-1]:g}"
        )
    return f


def slowest_first(roots: Complex) -> Complex:
    """Return poles of discrete time in descending order of magnitude."""
    return np.asarray(roots[np.argsort(-np.abs(roots), kind="stable")])


def parameter_table(names: Sequence[str], values: Real, std: Real, **attrs: object) -> xr.Dataset:
    """Return values and standard errors over ``parameter``, with these attributes."""
    return xr.Dataset(
        {"value": ("parameter", values), "std": ("parameter", std)},
        coords={"parameter": list(names)},
        attrs=attrs,
    )


def response_variance(slope: Complex, covariance: Real) -> Real:
    """Return the variance (n_freq, n_out, n_in) of a response to first order.

    ``slope`` (n_freq, n_out, n_in, n_parameters) are its derivatives.
    """
    return np.asarray(np.einsum("foik,kl,foil->foi", slope, covariance, slope.conj()).real)


def fit_percent(measured: ArrayLike, model: ArrayLike) -> Real:
    """Return the model fit of Wernholt (2004), (3.54), in per cent, one per output.

    ``measured`` and ``model`` are (n,) or (n, n_out); rows where the model is NaN (before the
    first prediction) do not count. 100 is perfect, 0 no better than the mean of the output,
    negative worse. NaN where the output is constant. Raises InputError for shapes that differ.
    """
    y, m = np.asarray(measured, np.float64), np.asarray(model, np.float64)
    if y.shape != m.shape or y.ndim not in (1, 2) or not y.size:
        raise InputError(f"model: expected the shape of measured, {y.shape}, got {m.shape}")
    y, m = (x[:, None] if x.ndim == 1 else x for x in (y, m))
    known = np.isfinite(m).all(axis=1)
    if not known.any():
        raise InputError("model: expected finite values, got none")
    y, m = y[known], m[known]
    spread = np.linalg.norm(y - y.mean(axis=0), axis=0)
    missed = np.linalg.norm(y - m, axis=0)
    out = np.full(y.shape[1], np.nan)
    moved = spread > 0
    out[moved] = 100 * (1 - missed[moved] / spread[moved])
    return out
