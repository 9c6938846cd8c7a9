"""Frequency responses to and from python-control, SciPy and NetCDF.

All of them use the sign of ``exp(+i w t)``: a lag has a negative phase. They differ in the order of
axes and the unit of frequency:

========================================= ===================== ==========================
where                                     response              frequency
========================================= ===================== ==========================
Dataset                                   (n_freq, n_out, n_in) Hz
``control.FrequencyResponseData``         (n_out, n_in, n_freq) rad/s
``scipy.signal.freqresp``, continuous     (n_freq,)             rad/s
``scipy.signal.dfreqresp``, discrete      (n_freq,)             rad/sample
========================================= ===================== ==========================
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import scipy
import xarray as xr
from numpy.typing import NDArray

from axisight.arguments import complex_array, path_of, positive, reals, whole
from axisight.errors import InputError, MissingExtraError
from axisight.frf.response import DIMS, frequency_response

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def to_control(response: xr.Dataset) -> Any:
    """Return a ``control.FrequencyResponseData`` of the lines that are not NaN.

    ``response`` is a Dataset of :func:`frequency_response`. The result has no uncertainty and no
    flags. Raises InputError if no line is left, and MissingExtraError without python-control.
    """
    control = _control()
    data = _response(response)
    good = np.isfinite(data).all(axis=(1, 2))
    if not good.any():
        raise InputError("response: expected a line with numbers, got NaN at all of them")
    omega = 2 * np.pi * response["frequency_hz"].values[good]
    return control.FrequencyResponseData(np.moveaxis(data[good], 0, 2), omega)


def from_control(frd: Any, *, input_unit: str = "Nm", output_unit: str = "rad") -> xr.Dataset:
    """Return the Dataset of a ``control.FrequencyResponseData``, lines in ascending order.

    The variance is NaN, because ``frd`` has none. ``input_unit`` and ``output_unit`` are labels.
    Raises InputError for another type (use :func:`evaluate` for a model, which has no lines), and
    MissingExtraError without python-control.
    """
    control = _control()
    if not isinstance(frd, control.FrequencyResponseData):
        raise InputError(
            f"frd: expected a control.FrequencyResponseData, got {type(frd).__name__}; a model is "
            "evaluated at chosen lines by evaluate()"
        )
    order = np.argsort(frd.omega)
    data = np.moveaxis(np.asarray(frd.frdata, complex), 2, 0)[order]
    frequency_hz = np.asarray(frd.omega, float)[order] / (2 * np.pi)
    return frequency_response(
        frequency_hz,
        data,
        estimator="control.FrequencyResponseData",
        input_unit=input_unit,
        output_unit=output_unit,
    )


def to_scipy(
    response: xr.Dataset, *, output: int = 1, input: int = 1, sample_time_s: float | None = None
) -> tuple[Real, Complex]:
    """Return ``(w, H)`` of one element as ``scipy.signal.freqresp`` does, each (n_freq,).

    ``output`` and ``input`` count from 1. ``w`` is in rad/s, or, if ``sample_time_s`` [s] is given,
    in rad/sample like ``dfreqresp``. Raises InputError for an element that does not exist.
    """
    _response(response)
    for name, value in (("output", output), ("input", input)):
        if whole(name, value) not in response[name].values:
            raise InputError(f"{name}: expected one of {response[name].values}, got {value}")
    element = response["response"].sel(output=output, input=input).values
    scale = 1.0 if sample_time_s is None else positive("sample_time_s", sample_time_s)
    return 2 * np.pi * scale * response["frequency_hz"].values, element


def from_scipy(
    w: Real,
    h: Complex,
    *,
    sample_time_s: float | None = None,
    input_unit: str = "Nm",
    output_unit: str = "rad",
) -> xr.Dataset:
    """Return the Dataset of ``(w, H)`` from ``scipy.signal.freqresp``, ``dfreqresp`` or the like.

    w
        (n_freq,), ascending, in rad/s, or in rad/sample if ``sample_time_s`` is given.
    h
        (n_freq,) for one element, or (n_freq, n_out, n_in).
    sample_time_s
        Sample time of a discrete response [s].
    input_unit, output_unit
        Units, for labels.

    Raises InputError for shapes that do not fit and frequencies that do not ascend.
    """
    w = reals("w", w, "frequencies of shape (n_freq,)", 1)
    h = complex_array("h", h)
    if h.ndim not in (1, 3) or len(h) != len(w) or 0 in h.shape:
        raise InputError(
            f"h: expected shape (n_freq,) or (n_freq, n_out, n_in) for w of shape {w.shape}, got "
            f"{h.shape}"
        )
    if not np.all(np.diff(w) > 0):
        raise InputError("w: expected ascending frequencies")
    scale = 1.0 if sample_time_s is None else positive("sample_time_s", sample_time_s)
    return frequency_response(
        w / (2 * np.pi * scale),
        h[:, None, None] if h.ndim == 1 else h,
        estimator="scipy.signal",
        input_unit=input_unit,
        output_unit=output_unit,
    )


def evaluate(
    system: scipy.signal.lti | scipy.signal.dlti,
    frequency_hz: Real,
    *,
    input_unit: str = "Nm",
    output_unit: str = "rad",
) -> xr.Dataset:
    """Return the exact response of a SciPy system at the given lines, variance zero.

    system
        ``scipy.signal.lti`` (at ``s = i w``) or ``dlti`` (at ``z = exp(i w T)``), in any
        representation. State-space systems may have several inputs and outputs; they are solved line
        by line, because a conversion to polynomials would lose digits.
    frequency_hz
        Lines [Hz], (n_freq,), ascending.
    input_unit, output_unit
        Units, for labels.

    A line on a pole is NaN. Raises InputError for another type, a discrete system without a
    sample time, and lines that do not ascend or lie above its Nyquist frequency.
    """
    frequency = reals("frequency_hz", frequency_hz, "frequencies of shape (n_freq,)", 1)
    if not np.all(np.diff(frequency) > 0):
        raise InputError("frequency_hz: expected ascending frequencies")
    if isinstance(system, scipy.signal.dlti):
        if system.dt is True or not system.dt:
            raise InputError("system: expected a discrete system with its sample time, got dt=True")
        if frequency.size and frequency[-1] > 0.5 / system.dt * (1 + 1e-12):
            raise InputError(
                f"frequency_hz: expected at most {0.5 / system.dt:g} Hz (Nyquist), got {frequency[-1]:g}"
            )
        at = np.exp(2j * np.pi * frequency * system.dt)
    elif isinstance(system, scipy.signal.lti):
        at = 2j * np.pi * frequency
    else:
        raise InputError(
            f"system: expected a scipy.signal lti or dlti, got {type(system).__name__}"
        )
    response = _evaluated(system, at)
    return frequency_response(
        frequency,
        response,
        estimator="exact",
        variance=np.where(np.isfinite(response), 0.0, np.nan),
        input_unit=input_unit,
        output_unit=output_unit,
    )


def _evaluated(system: Any, at: Complex) -> Complex:
    with np.errstate(divide="ignore", invalid="ignore"):
        if isinstance(system, scipy.signal.StateSpace):
            a, b, c, d = system.A, system.B, system.C, system.D
            response = np.full((len(at), *d.shape), np.nan, complex)
            for k, s in enumerate(at):
                try:
                    response[k] = c @ np.linalg.solve(s * np.eye(len(a)) - a, b) + d
                except np.linalg.LinAlgError:
                    continue  # on a pole: stays NaN
        elif isinstance(system, scipy.signal.ZerosPolesGain):
            factors = system.gain * np.prod(at[:, None] - np.atleast_1d(system.zeros), axis=1)
            poles = np.prod(at[:, None] - np.atleast_1d(system.poles), axis=1)
            response = (factors / poles)[:, None, None]
        else:
            numerator = np.atleast_2d(system.num)
            values = [np.polyval(row, at) / np.polyval(system.den, at) for row in numerator]
            response = np.stack(values, axis=1)[:, :, None]
    return np.asarray(np.where(np.isfinite(response), response, np.nan + 0j))


def save_netcdf(response: xr.Dataset, path: Path | str) -> None:
    """Write a response to a NetCDF 3 file, complex variables as ``NAME_real`` and ``NAME_imag``.

    ``response`` is any Dataset of this package over ``frequency_hz``, including the distortion of
    :func:`fast_method`; :func:`load_netcdf` reads it again. Raises InputError for an attribute that
    NetCDF cannot hold, and for a path that cannot be written.
    """
    target = path_of("path", path)
    _expect_lines(response)
    parts: dict[str, Any] = {}
    for name, value in response.data_vars.items():
        if np.iscomplexobj(value):
            parts[f"{name}_real"] = (value.dims, value.values.real, value.attrs)
            parts[f"{name}_imag"] = (value.dims, value.values.imag, value.attrs)
        else:
            parts[str(name)] = value
    plain = xr.Dataset(parts, coords=response.coords, attrs=response.attrs)
    try:
        plain.to_netcdf(target, engine="scipy")
    except (TypeError, ValueError) as error:
        raise InputError(f"response: expected attributes NetCDF can hold: {error}") from error
    except OSError as error:
        raise InputError(f"path: {target} cannot be written: {error}") from error


def load_netcdf(path: Path | str) -> xr.Dataset:
    """Return the Dataset that :func:`save_netcdf` wrote to ``path``.

    Raises InputError if the file cannot be read or has no variable over frequency.
    """
    source = path_of("path", path)
    try:
        with xr.open_dataset(source, engine="scipy") as file:
            plain = file.load()
    except (OSError, TypeError, ValueError, IndexError, KeyError, EOFError) as error:
        raise InputError(f"path: expected a NetCDF file, got {source}: {error}") from error
    variables: dict[str, Any] = {}
    for key, value in plain.data_vars.items():
        name = str(key)
        if name.endswith("_real") and f"{name[:-5]}_imag" in plain:
            both = np.empty(value.shape, complex)
            both.real, both.imag = value.values, plain[f"{name[:-5]}_imag"].values
            variables[name[:-5]] = (value.dims, both, value.attrs)
        elif not (name.endswith("_imag") and f"{name[:-5]}_real" in plain):
            variables[name] = value
    coords = {
        name: (c.dims, c.values.astype(np.int64) if c.dtype.kind == "i" else c.values, c.attrs)
        for name, c in plain.coords.items()
    }
    loaded = xr.Dataset(variables, attrs=plain.attrs).assign_coords(coords)
    _expect_lines(loaded)
    return loaded


def _expect_lines(response: object) -> None:
    """Raise InputError unless this is a Dataset over frequency: a response, or distortion."""
    if not isinstance(response, xr.Dataset):
        raise InputError(f"response: expected a Dataset, got {type(response).__name__}")
    if "frequency_hz" not in response.dims:
        dims = ", ".join(map(str, response.dims)) or "nothing"
        raise InputError(f"response: expected a Dataset over frequency_hz, got one over {dims}")


def _response(response: xr.Dataset) -> Complex:
    """Return the array (n_freq, n_out, n_in); raises InputError for another Dataset."""
    found = response.get("response") if isinstance(response, xr.Dataset) else None
    if found is None or set(found.dims) != set(DIMS):
        raise InputError(f"response: expected a Dataset with a variable response over {DIMS}")
    return np.asarray(found.transpose(*DIMS).values, complex)


def _control() -> Any:
    """Return the module ``control``; raises MissingExtraError if it is not installed."""
    try:
        return importlib.import_module("control")
    except ImportError as error:
        raise MissingExtraError(
            "python-control is not installed: pip install 'axisight[control]'"
        ) from error
