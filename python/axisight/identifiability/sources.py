"""Information from results of other parts of Axisight."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from axisight.effects import Effect
from axisight.errors import InputError
from axisight.fitting import FitOptions, Fitted, Parameter, Weighting, fit
from axisight.identifiability.information import (
    Array,
    Information,
    information,
    of_matrix,
    whitened,
)
from axisight.logs import Log
from axisight.robot import Robot
from axisight.simulation import simulate


def of_regressor(
    regressor: xr.DataArray,
    torque_std_nm: ArrayLike,
    *,
    scales: ArrayLike | None = None,
    name: str = "",
    advice: str = "",
) -> Information:
    """Return the information of a motion for a model linear in its parameters.

    regressor
        DataArray of ``axisight.rigid_body.torque_regressor``, with the dimension ``parameter`` last; all
        other dimensions are measurements.
    torque_std_nm
        Standard deviation of the torque, a number or one for each joint or axis [Nm].
    scales
        Scales of the parameters, in their units. By default the nominal values, or for a zero value the
        largest of the same unit.
    name, advice
        Name of the experiment and advice, as in `information`.

    Raises InputError for another DataArray, and for standard deviations of another shape.
    """
    if not isinstance(regressor, xr.DataArray) or regressor.dims[-1:] != ("parameter",):
        raise InputError("regressor: expected a DataArray with the last dimension 'parameter'")
    names = [str(n) for n in regressor["parameter"].values]
    data = np.asarray(regressor.values, np.float64)
    try:
        std = np.broadcast_to(np.asarray(torque_std_nm, np.float64), data.shape[:-1])
    except ValueError:
        raise InputError(
            f"torque_std_nm: expected a number or one for each torque, {data.shape[1:-1]}, got "
            f"{np.shape(torque_std_nm)}"
        ) from None
    if scales is None:
        if "nominal" not in regressor.coords:
            raise InputError("scales: expected them, as the regressor has no nominal values")
        scales = _typical(np.abs(regressor["nominal"].values), regressor.coords.get("unit"))
    return information(
        data.reshape(-1, len(names)),
        names=names,
        scales=scales,
        noise_std=std.ravel(),
        name=name,
        advice=advice,
    )


def _typical(nominal: Array, unit: xr.DataArray | None) -> Array:
    """Return nominal sizes; for a zero value the largest of the same unit, or one without it."""
    out = nominal.astype(np.float64)
    labels = np.zeros(len(out), dtype="U1") if unit is None else unit.values
    for k in np.flatnonzero(out == 0):
        alike = nominal[labels == labels[k]]
        out[k] = alike.max() if alike.max() > 0 else 1.0
    return out


def of_fit(
    fitted: Fitted, *, scales: ArrayLike | None = None, name: str = "", advice: str = ""
) -> Information:
    """Return the information of the data of a finished `axisight.fit`, without priors.

    The residuals of ``fitted`` are whitened, so the noise has standard deviation one. ``scales`` are
    by default the fitted values. ``name`` and ``advice`` are those of `information`.
    """
    size = np.abs(fitted.values)
    return information(
        fitted.core.jacobian.T,
        names=fitted.names,
        scales=np.where(size > 0, size, 1.0) if scales is None else scales,
        name=name,
        advice=advice,
    )


def of_simulation(
    robot: Robot,
    velocity_ref_rad_s: ArrayLike,
    parameters: Sequence[Parameter],
    *,
    torque_std_nm: ArrayLike,
    effects: Sequence[Effect] = (),
    name: str = "",
    advice: str = "",
) -> Information:
    """Return the information of a planned closed-loop experiment on robot and effect parameters.

    robot, effects
        The assumed machine, which is simulated.
    velocity_ref_rad_s
        Planned references, (n, n_axes), motor side.

    Parameters
    ----------
        As for `axisight.fit`, at their initial values; frozen ones are left out.
    torque_std_nm
        Standard deviation of the commanded torque that no model explains [Nm], a number or one per
        axis.
    name, advice
        Name of the experiment and advice, as in `information`.

    Derivatives are exact. Raises InputError for misuse and a simulation that fails.

    """
    reference = np.asarray(velocity_ref_rad_s, np.float64)
    std = np.broadcast_to(np.asarray(torque_std_nm, np.float64), (robot.n_axes,))
    if not np.all(np.isfinite(std) & (std > 0)):
        raise InputError(f"torque_std_nm: expected positive numbers, got {torque_std_nm!r}")
    run = simulate(robot, reference, effects=effects)
    if run.attrs["status"] != "completed":
        raise InputError(
            f"velocity_ref_rad_s: expected a run that completes, got {run.attrs['status']}"
        )
    log = Log(
        name=name or "planned",
        source=Path("planned"),
        sample_time_s=robot.sample_time_s,
        time_s=np.asarray(np.arange(len(reference)) * robot.sample_time_s, np.float64),
        torque_nm=run["torque_cmd_nm"].values,
        position_rad=run["position_rad"].values,
        velocity_ref_rad_s=reference,
    )
    fitted = fit(
        robot,
        [log],
        [replace(p, prior=None, nuisance=False) for p in parameters],
        effects=effects,
        weighting=Weighting(np.zeros(1), 1 / std[:, None]),
        options=FitOptions(max_iterations=1),
    )
    sizes = [abs(p.initial) or 1.0 for p in parameters if not p.frozen]
    return of_fit(fitted, scales=sizes, name=name, advice=advice)


def of_log_information(
    matrix: ArrayLike,
    values: Mapping[str, float],
    *,
    name: str = "",
    advice: str = "",
) -> Information:
    """Return the information of an experiment whose ``matrix`` is per logarithm of the parameters.

    ``FrequencyFit.information`` is such a matrix. ``values`` by name, in the order of the matrix, are
    the scales: standard deviations are relative to them. Give the value one for a centre of mass,
    which is not searched by its logarithm. ``name`` and ``advice`` are those of `information`. Raises
    InputError for values that are not positive, and as `of_matrix`.
    """
    sizes = np.array(list(values.values()), np.float64)
    if not (np.isfinite(sizes) & (sizes > 0)).all():
        raise InputError(f"values: expected positive numbers, got {dict(values)}")
    per_unit = np.asarray(matrix, np.float64)
    if per_unit.shape == (len(sizes),) * 2:
        per_unit = per_unit / np.outer(sizes, sizes)
    return of_matrix(per_unit, names=list(values), scales=sizes, name=name, advice=advice)


def of_covariance(
    covariance: ArrayLike,
    values: Mapping[str, float],
    *,
    name: str = "",
    advice: str = "",
) -> Information:
    """Return the information of a finished fit from its ``covariance`` (n, n), positive definite.

    ``values`` by name, in the order of the covariance, are the scales; the scale of a zero value is
    one. For ``axisight.graybox.AxisFit`` they are its ``values`` by ``free``. ``name`` and ``advice``
    are those of `information`.
    """
    size = np.abs(np.array(list(values.values()), np.float64))
    return information(
        whitened(np.eye(len(values)), covariance),
        names=list(values),
        scales=np.where(size > 0, size, 1.0),
        name=name,
        advice=advice,
    )
