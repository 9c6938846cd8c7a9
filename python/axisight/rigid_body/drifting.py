"""Parameters that drift while the robot moves, such as friction that warms up, over time."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from axisight.arguments import instance, positive
from axisight.errors import IdentifiabilityError, InputError
from axisight.rigid_body.estimate import numbers, regression_factors
from axisight.rigid_body.regressor import rows
from axisight.rigid_body.result import RigidBodyEstimate
from axisight.statistics.random_walk import random_walk

Array = NDArray[np.float64]


def track_parameters(
    estimate: RigidBodyEstimate,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike,
    torque_nm: ArrayLike,
    *,
    sample_time_s: float,
    drift_per_sqrt_s: Mapping[str, float],
    block_s: float = 0.5,
    threads: int = 0,
) -> xr.Dataset:
    """Return base parameters over time, where some of them change by a random walk.

    The model is linear in its parameters, so the Kalman filter is exact and needs no linearization. It runs over
    blocks of samples in square-root information form, with the smoother of Rauch, Tung and Striebel (`random_walk`).
    Without drift, the last filtered values are those of weighted least squares, (4.5) of Wernholt (2004).

    Parameters
    ----------
    estimate : of `identify_rigid_body` with constant parameters. It sets the base parameters, the known ones and the
        noise: the standard deviation of each row's residual, multiplied by the median ratio of the standard errors
        with and without correlation of the residuals.
    q, v, a, torque_nm : one continuous motion, as in `identify_rigid_body`.
    sample_time_s : sample time of the motion [s].
    drift_per_sqrt_s : by name of base parameter, the standard deviation of its change in one second; it grows with
        the square root of time [unit of the parameter / sqrt(s)]. Parameters not named are constant.
    block_s : length of a block [s]; the parameters change from one block to the next.
    threads : number of threads, 0 for all cores; the result does not depend on it.

    Returns
    -------
    Dataset with dims (time, parameter) at the ends of the blocks: ``filtered`` (from the past) and ``smoothed`` (from
    all data), with ``filtered_standard_error`` and ``smoothed_standard_error``. Filtered values are NaN until the data
    determine all parameters.

    Raises InputError for wrong shapes, unknown names, negative drifts or a block longer than half of the motion, and
    IdentifiabilityError for data that do not determine the parameters.

    """
    instance("estimate", estimate, RigidBodyEstimate)
    motion = estimate.model.motion(q, v, a)
    torque = rows("torque_nm", torque_nm, estimate.model.n_rows)
    if len(torque) != len(motion[0]):
        raise InputError(f"torque_nm: expected {len(motion[0])} rows as q, got {len(torque)}")
    step = positive("sample_time_s", sample_time_s)
    count = int(len(torque) * step / positive("block_s", block_s))
    if count < 2:
        raise InputError(
            f"block_s: expected less than half of the motion of {len(torque) * step:.4g} s, got {block_s:g}"
        )
    drift = _drifts(estimate, drift_per_sqrt_s) * np.sqrt(len(torque) * step / count)
    factors = regression_factors(
        estimate.base, motion, torque, estimate.known, None, count, threads
    )
    weighted = factors.blocks / _noise_nm(estimate)[:, None, None]
    try:
        track = random_walk(weighted.reshape(count, -1, factors.k + 1), drift)
    except np.linalg.LinAlgError:
        raise IdentifiabilityError(
            "torque_nm: the motion does not determine all base parameters; "
            "estimate them with deficient='group' first"
        ) from None
    ends = (np.arange(1, count + 1) * len(torque) // count) * step
    parts = {
        "filtered": track.filtered,
        "filtered_standard_error": _errors(track.filtered_covariance),
        "smoothed": track.smoothed,
        "smoothed_standard_error": _errors(track.smoothed_covariance),
    }
    return xr.Dataset(
        {name: (("time", "parameter"), x) for name, x in parts.items()},
        coords={
            "time": ("time", ends, {"units": "s"}),
            "parameter": estimate.names,
            "unit": ("parameter", estimate.base.units),
        },
    )


def _drifts(estimate: RigidBodyEstimate, given: Mapping[str, float]) -> Array:
    drift = numbers("drift_per_sqrt_s", given)
    unknown = sorted(set(drift) - set(estimate.names))
    if unknown:
        raise InputError(
            f"drift_per_sqrt_s: expected names of base parameters ({', '.join(estimate.names)}), "
            f"got {', '.join(unknown)}"
        )
    if min(drift.values(), default=0.0) < 0:
        raise InputError(f"drift_per_sqrt_s: expected no negative number, got {drift}")
    return np.array([drift.get(name, 0.0) for name in estimate.names])


def _noise_nm(estimate: RigidBodyEstimate) -> Array:
    """Return the standard deviation of each row's residual [Nm], larger where residuals are correlated."""
    white = np.sqrt(np.diag(estimate.covariance_white))
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = estimate.standard_error / white
    ratio = ratio[np.isfinite(ratio)]
    return estimate.residual_std_nm * max(float(np.median(ratio)) if len(ratio) else 1.0, 1.0)


def _errors(covariance: Array) -> Array:
    return np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
