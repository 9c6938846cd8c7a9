"""Errors predicted from a model before an experiment, to choose its design.

Ripple repeats with the motion, so it is the same in every period and every repetition. Only a
simulation of the motion predicts it. Sensor noise enters by its variance, including its leakage.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import cast, get_args

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from axisight.arguments import (
    instance,
    lines_below,
    one_of,
    reals,
    several,
    threads_of,
    whole,
)
from axisight.effects import Effect
from axisight.errors import InputError
from axisight.frf.errors import error_variance, estimation_error, signal_to_noise_ratio
from axisight.frf.leakage import noise_leakage_power
from axisight.frf.loop import velocity_gains
from axisight.robot import Robot
from axisight.simulation import Model, simulate_batch

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

_MOST_PERIODS = 10**6
_DIMS = ("frequency_hz", "output", "input")


def predict_errors(
    robot: Robot,
    references_rad_s: ArrayLike,
    lines: ArrayLike,
    *,
    effects: Iterable[Effect] = (),
    waiting_periods: int = 1,
    n_periods: int = 1,
    model: Model = "linear",
    threads: int = 0,
) -> xr.Dataset:
    """Return the expected errors of ``Y U^-1`` under a design, from torque to acceleration.

    Parameters
    ----------
    robot : with a ``pi_velocity`` or ``p_velocity`` controller and its sensor noise.
    references_rad_s : one period of motor velocity references, of one or more realizations:
        (n_realizations, n_experiments, n_samples, n_axes) [rad/s], with n_experiments = n_axes.
        They include square wave, amplitude and directions T.
    lines : excited lines k; frequencies ``k / (N T)``.
    effects : the disturbances: ``torque_ripple`` and ``resolver_ripple``.
    waiting_periods : periods simulated before the evaluated one. A transient that remains is
        part of the error, as in the experiment.
    n_periods : measured periods; they average the noise, not the ripple.
    model, threads : as in :func:`axisight.simulate_batch`.

    Returns
    -------
    A Dataset. Over (frequency_hz, output, input):

    - ``response``: the true response, complex
    - ``bias``: mean error over realizations, complex
    - ``realization_variance``: scatter of the error over realizations, NaN for a single one
    - ``noise_variance``: variance by noise of one realization
    - ``relative_error``: rms error of one realization over ``|G|``

    Over (frequency_hz, axis, experiment), as medians over realizations: ``input_snr``, (8.10), NaN
    without ripple, and ``output_snr``, (8.11), with noise. See :func:`averaged_relative_error` for
    several realizations.

    Raises InputError for shapes that do not fit, lines out of range, and a simulation that fails.

    """
    velocity_gains(robot)
    added = [instance("effects", effect, Effect) for effect in several("effects", effects)]
    one_of("model", model, get_args(Model))
    n = robot.n_axes
    what = f"shape (n_realizations, {n}, n_samples, {n})"
    refs = reals("references_rad_s", references_rad_s, what, 4)
    if refs.shape[1] != n or refs.shape[3] != n:
        raise InputError(f"references_rad_s: expected {what}, got {refs.shape}")
    k = lines_below("lines", lines, refs.shape[2])
    if not k.size:
        raise InputError("lines: expected at least one, got none")
    waiting_periods = whole("waiting_periods", waiting_periods, 0, _MOST_PERIODS)
    n_periods = whole("n_periods", n_periods, 1, _MOST_PERIODS)
    threads_of(threads)
    frequency = k / (refs.shape[2] * robot.sample_time_s)
    true = robot.zoh_response(frequency).values
    noise = refs.shape[2] * robot.position_noise_std**2
    leaked = noise_leakage_power(robot, frequency, n_periods * refs.shape[2])
    power = noise / n_periods + leaked / n_periods**2
    found = []
    for one in refs:
        repeated = np.tile(one, (1, waiting_periods + 1, 1))
        run = simulate_batch(robot, repeated, effects=added, model=model, threads=threads)
        if not (run["status"] == "completed").all():
            raise InputError(f"references_rad_s: the simulation ended as {run['status'].values}")
        found.append(_one(run, refs.shape[2], k, true, power))
    return _dataset(frequency, true, found, robot.axis_numbers())


def averaged_relative_error(prediction: xr.Dataset, n_realizations: int) -> xr.DataArray:
    """Return the root mean square relative error after averaging over realizations.

    It is ``sqrt(|bias|^2 + (realization + noise variance) / M) / |G|`` for the arithmetic mean of
    M = ``n_realizations`` estimates, (7.7). The bias in ``prediction`` includes the scatter of its few
    realizations; the expected share of that scatter is subtracted. Raises InputError for a prediction
    from one realization.
    """
    count = int(_predicted("prediction", prediction).attrs["n_realizations"])
    whole("n_realizations", n_realizations)
    if count < 2:
        raise InputError(f"prediction: expected one from at least 2 realizations, got {count}")
    scatter = prediction["realization_variance"]
    bias = np.maximum(np.abs(prediction["bias"]) ** 2 - scatter / count, 0.0)
    variance = (scatter + prediction["noise_variance"]) / n_realizations
    error = np.sqrt(bias + variance) / np.abs(prediction["response"])
    return cast(xr.DataArray, error).rename("relative_error").assign_attrs(units="1")


def compare_designs(predictions: Mapping[str, xr.Dataset]) -> pd.DataFrame:
    """Return the mean over frequency of the predicted relative error, one row per design.

    Columns: ``design``, ``1,1`` ... (output, input) and ``mean`` over all elements. Raises InputError
    unless ``predictions`` maps names to Datasets of :func:`predict_errors`.
    """
    rows = []
    if not isinstance(predictions, Mapping):
        kind = type(predictions).__name__
        raise InputError(f"predictions: expected {{name: Dataset}}, got {kind}")
    for name, prediction in predictions.items():
        _predicted(f"predictions[{name!r}]", prediction)
        mean = prediction["relative_error"].mean("frequency_hz")
        elements = {
            f"{int(i)},{int(j)}": float(mean.sel(output=i, input=j))
            for i in mean["output"]
            for j in mean["input"]
        }
        rows.append({"design": name, **elements, "mean": float(mean.mean())})
    return pd.DataFrame(rows)


def _predicted(field: str, value: object) -> xr.Dataset:
    """Return ``value`` if it is a Dataset of :func:`predict_errors`; raises InputError for others."""
    needed = {"response", "bias", "realization_variance", "noise_variance", "relative_error"}
    if (
        not isinstance(value, xr.Dataset)
        or not needed <= set(value.data_vars)
        or "n_realizations" not in value.attrs
    ):
        raise InputError(
            f"{field}: expected a Dataset of predict_errors, got {type(value).__name__}"
        )
    return value


_Errors = tuple[Complex, Real, Real, Real]


def _one(run: xr.Dataset, n: int, lines: NDArray[np.int64], true: Complex, power: Real) -> _Errors:
    """Return error, noise variance and signal-to-noise ratios of one realization."""
    names = ("torque_cmd_nm", "position_rad", "torque_disturbance_nm", "position_disturbance_rad")
    u, y, v_u, v_y = (_spectrum(run[name].values[:, -n:], lines) for name in names)
    error = estimation_error(y - true @ u, u)
    variance = error_variance(power, u)
    to_acceleration = (2 * np.pi * lines / (n * float(run["time"][1]))) ** 2
    v_y = np.sqrt(np.abs(v_y) ** 2 + power[:, :, None])
    scale = to_acceleration[:, None, None]
    return (
        -scale * error,
        scale**2 * variance,
        signal_to_noise_ratio(u, v_u),
        signal_to_noise_ratio(y, v_y),
    )


def _spectrum(x: Real, lines: NDArray[np.int64]) -> Complex:
    """Return the DFT at the lines, (n_freq, axis, experiment)."""
    return np.moveaxis(np.fft.rfft(x, axis=1)[:, lines], 0, -1)


def _dataset(frequency: Real, true: Complex, found: list[_Errors], axes: list[int]) -> xr.Dataset:
    error, noise, input_snr, output_snr = (np.array(part) for part in zip(*found, strict=True))
    response = -((2 * np.pi * frequency[:, None, None]) ** 2) * true
    scatter = np.full(response.shape, np.nan)
    if len(error) > 1:
        scatter = np.sum(np.abs(error - error.mean(0)) ** 2, axis=0) / (len(error) - 1)
    noise_variance = noise.mean(0)
    squared = np.mean(np.abs(error) ** 2, axis=0) + noise_variance
    unit = "rad/s^2/Nm"
    snr_dims = ("frequency_hz", "axis", "experiment")
    return xr.Dataset(
        {
            "response": (_DIMS, response, {"units": unit}),
            "bias": (_DIMS, error.mean(0), {"units": unit}),
            "realization_variance": (_DIMS, scatter, {"units": f"({unit})^2"}),
            "noise_variance": (_DIMS, noise_variance, {"units": f"({unit})^2"}),
            "relative_error": (_DIMS, np.sqrt(squared) / np.abs(response), {"units": "1"}),
            "input_snr": (snr_dims, np.median(input_snr, axis=0), {"units": "1"}),
            "output_snr": (snr_dims, np.median(output_snr, axis=0), {"units": "1"}),
        },
        coords={
            "frequency_hz": ("frequency_hz", frequency, {"units": "Hz"}),
            "output": axes,
            "input": axes,
            "axis": axes,
            "experiment": axes,
        },
        attrs={"n_realizations": len(found)},
    )
