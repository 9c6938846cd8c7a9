"""Fast method: noise, odd and even nonlinear distortion from a single realization."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.arguments import Complex, Real
from axisight.errors import InputError
from axisight.frf._lines import (
    Quantity,
    expect_options,
    line_factor,
    output_unit,
    provenance,
    spectra,
)
from axisight.frf.confidence import with_freedom
from axisight.frf.response import frequency_response
from axisight.frf.robust import by_realization, excitation, inverse, period_variance
from axisight.records.periodic import PeriodicRecords

NEIGHBOURS = 6
"""Number of nearest detection lines whose mean gives the distortion at an excited line."""


class FastMethod(NamedTuple):
    """Result of :func:`fast_method`."""

    response: xr.Dataset
    distortion: xr.Dataset


def fast_method(
    records: PeriodicRecords,
    *,
    quantity: Quantity = "position",
    remove_drift: bool = True,
    threads: int = 1,
) -> FastMethod:
    """Return the response and the levels of noise, odd and even distortion.

    Source: Pintelon and Schoukens (2012), section 4.3.2. At a line without excitation a
    steady-state linear system has no output. Any output there, beyond noise, is nonlinear
    distortion: of even degree at even lines and of odd degree at odd lines, if all excited
    lines are odd.

    records
        One realization, that is ``n_inputs`` experiments, of P >= 2 periods in steady state.
        The method uses ``records.detection_lines`` or, without any, all lines free of excitation
        between the first and the last excited one.
    quantity, remove_drift, threads
        As for `mfrf`. The factor i w or (i w)^2 applies to response, variances and distortion alike.

    ``response``, the Dataset of every estimator, is ``Y U^-1`` at the excited lines.
    ``noise_variance`` comes from the scatter over the periods (P - 1 complex degrees of freedom).
    ``variance`` adds the mean distortion power of the 6 nearest detection lines of the same parity; it
    is NaN without such lines. This assumes that distortion at excited lines is as large as at
    detection lines, which holds on random grids.

    ``distortion``, over the detection lines, with coordinates ``line`` and ``kind``
    ("odd" or "even"):

    ================ =================================== =====================================
    variable         dims                                meaning
    ================ =================================== =====================================
    distortion       frequency_hz, output, experiment    ``2 / N (Y_d - G_d U_d)``, complex
                                                         amplitude [output unit]
    noise_variance   the same                            its variance by noise
    uncorrected      the same                            ``2 / N Y_d``
    input_amplitude  frequency_hz, input, experiment     ``2 / N U_d`` [input unit]
    ================ =================================== =====================================

    In a loop, or behind a nonlinear actuator, distortion also reaches the input. ``G_d U_d`` is the
    response of the linear system to it, so it is subtracted. G_d is interpolated linearly between
    excited lines and constant beyond them; its error has a second-order effect, through ``U_d``.
    ``|distortion|^2`` includes the noise: without distortion, ``|distortion|^2 / noise_variance`` is
    F distributed with 2 and 2 (P - 1) degrees of freedom.

    Raises InputError for a single period, for another number of experiments than ``n_inputs``, and
    without a detection line.
    """
    expect_options(records, quantity, remove_drift, threads)
    n, periods = records.n_inputs, records.n_periods
    if records.n_experiments != n:
        raise InputError(
            f"records: expected one realization of {n} experiments (one for each input), got "
            f"{records.n_experiments}; for several see robust_method"
        )
    if periods < 2:
        raise InputError("records: expected at least 2 periods to tell the noise, got 1")
    detection = _detection_lines(records)

    def of(lines: NDArray[np.int64]) -> tuple[Complex, Complex]:
        found = spectra(
            records, "position", remove_drift=remove_drift, threads=threads, lines=lines
        )
        u, y = (by_realization(signal, n) for signal in found)
        return u, y

    excited, free = of(records.lines), of(detection)
    condition, flag = excitation(excited[0])
    u, y = excited[0][0], excited[1][0]
    free_u, free_y = free[0][0], free[1][0]
    weight = inverse(u.mean(axis=0), flag)
    response = y.mean(axis=0) @ weight
    noise = period_variance(((y - response @ u) @ weight)[None])[0]

    between = _interpolate(records.lines, response, detection)
    error = free_y - between @ free_u
    level, level_noise = error.mean(axis=0), period_variance(error[None])[0]
    power = _at_excited(records.lines, detection, np.abs(level) ** 2 - level_noise)
    share = power @ np.abs(weight) ** 2
    factor = line_factor(records.frequency_hz, quantity)[:, None, None]
    result = frequency_response(
        records.frequency_hz,
        response * factor,
        estimator="fast_method",
        variance=(noise + share) * np.abs(factor) ** 2,
        noise_variance=noise * np.abs(factor) ** 2,
        condition=condition,
        flag=flag,
        input_unit=records.input_unit,
        output_unit=output_unit(records, quantity),
        attrs=provenance(records, quantity),
    )
    result = with_freedom(result, _freedom(noise, share, periods, len(detection)))
    scale = 2 / records.n_samples
    free_hz = detection / (records.n_samples * records.sample_time_s)
    derived = scale * line_factor(free_hz, quantity)[:, None, None]
    uncorrected, amplitude = free_y.mean(axis=0), free_u.mean(axis=0)
    levels = {
        "distortion": derived * level,
        "noise_variance": np.abs(derived) ** 2 * level_noise,
        "uncorrected": derived * uncorrected,
        "input_amplitude": scale * amplitude,
    }
    return FastMethod(result, _distortion(records, quantity, detection, levels))


def _freedom(noise: Real, share: Real, periods: int, n_detection: int) -> Real:
    """Return the complex degrees of freedom of the sum of two variances (Satterthwaite 1946)."""
    with np.errstate(invalid="ignore", divide="ignore"):
        spread = noise**2 / (periods - 1) + share**2 / min(NEIGHBOURS, n_detection)
        return np.asarray((noise + share) ** 2 / spread)


def _detection_lines(records: PeriodicRecords) -> NDArray[np.int64]:
    lines = records.detection_lines
    if not lines.size:
        first, last = records.lines[[0, -1]]
        lines = np.setdiff1d(np.arange(first, last), records.lines)
    if not lines.size:
        raise InputError("detection_lines: expected at least one line free of excitation, got none")
    return lines


def _interpolate(lines: NDArray[np.int64], response: Complex, at: NDArray[np.int64]) -> Complex:
    """Return the response at other lines, interpolated linearly without the lines that are NaN."""
    known = np.all(np.isfinite(response), axis=(1, 2))
    flat = response.reshape(len(lines), -1)[known]
    if not len(flat):
        return np.full((len(at), *response.shape[1:]), np.nan, np.complex128)
    columns = [np.interp(at, lines[known], column) for column in flat.T]
    return np.stack(columns, axis=-1).reshape(len(at), *response.shape[1:])


def _at_excited(excited: NDArray[np.int64], detection: NDArray[np.int64], power: Real) -> Real:
    """Return the mean power of the nearest detection lines of the same parity, NaN without any."""
    out = np.full((len(excited), *power.shape[1:]), np.nan)
    for parity in (0, 1):
        here, there = excited % 2 == parity, detection % 2 == parity
        if here.any() and there.any():
            distance = np.abs(excited[here, None] - detection[there])
            nearest = np.argsort(distance, axis=1, kind="stable")[:, :NEIGHBOURS]
            out[here] = np.maximum(power[there][nearest].mean(axis=1), 0.0)
    return out


def _distortion(
    records: PeriodicRecords,
    quantity: Quantity,
    lines: NDArray[np.int64],
    levels: dict[str, NDArray[np.inexact]],
) -> xr.Dataset:
    unit = output_unit(records, quantity)
    dims = ("frequency_hz", "output", "experiment")
    frequency_hz = lines / (records.n_samples * records.sample_time_s)
    return xr.Dataset(
        {
            "distortion": (dims, levels["distortion"], {"units": unit}),
            "noise_variance": (dims, levels["noise_variance"], {"units": f"{unit}^2"}),
            "uncorrected": (dims, levels["uncorrected"], {"units": unit}),
            "input_amplitude": (
                ("frequency_hz", "input", "experiment"),
                levels["input_amplitude"],
                {"units": records.input_unit},
            ),
        },
        coords={
            "frequency_hz": (dims[:1], frequency_hz, {"units": "Hz"}),
            "line": (dims[:1], lines),
            "kind": (dims[:1], np.where(lines % 2 == 1, "odd", "even")),
            "output": np.arange(1, records.n_outputs + 1),
            "input": np.arange(1, records.n_inputs + 1),
            "experiment": np.arange(1, records.n_experiments + 1),
        },
        attrs={"estimator": "fast_method"} | provenance(records, quantity),
    )
