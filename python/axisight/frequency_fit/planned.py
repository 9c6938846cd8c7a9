"""Information of planned responses on the parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight import _core
from axisight.effects import Effect, core_effects
from axisight.errors import InputError
from axisight.fitting import Parameter
from axisight.frequency_fit.measured import (
    MeasuredResponse,
    PoseTuple,
    Sampling,
    check_sampling,
    model_response,
)
from axisight.frequency_fit.options import FrequencyFitOptions, core_options
from axisight.frequency_fit.parameters import Spec, specs
from axisight.frf.quantity import Quantity
from axisight.identifiability import Information, of_log_information
from axisight.robot import Robot

Real = NDArray[np.float64]


def planned_information(
    robot: Robot,
    parameters: Sequence[str | Parameter] | Mapping[str, float],
    operating_points_rad: ArrayLike,
    frequency_hz: ArrayLike,
    *,
    relative_std: ArrayLike = 0.1,
    quantity: Quantity = "acceleration",
    sampling: Sampling = "zero_order_hold",
    effects: Sequence[Effect] = (),
    name: str = "",
    advice: str = "",
) -> Information:
    """Return the information that responses at some operating points would have on the parameters.

    `axisight.identifiability.identifiability` assesses it; `compare_experiments` and
    `recommend_experiments` compare it with other experiments. The scale of a parameter is its own
    value, or one metre for a centre of mass.

    robot, parameters, effects, sampling
        As for :func:`fit_responses`; the model uses the starts of the parameters.
    operating_points_rad
        Angles of the driven joints [rad], (n_points, n_axes).
    frequency_hz
        Lines [Hz], (n_freq,).
    relative_std
        Expected standard deviation of the response relative to its magnitude: a number or an
        array that broadcasts to (n_points, n_freq, n_outputs, n_inputs), for example from
        :func:`axisight.frf.predict_errors`.
    quantity
        Output of the responses: ``position``, ``velocity`` or ``acceleration``. It changes nothing
        for relative errors.
    name, advice
        Name of the experiment and advice, as in `axisight.identifiability.information`.

    Raises InputError for misuse.
    """
    chosen = specs(robot, parameters)
    matrices = pose_information(
        robot,
        chosen,
        operating_points_rad,
        frequency_hz,
        relative_std=relative_std,
        quantity=quantity,
        sampling=sampling,
        effects=effects,
    )
    return of_search(chosen, matrices.sum(axis=0), name=name, advice=advice)


def of_search(
    chosen: Sequence[Spec],
    matrix: Real,
    values: Sequence[float] | Real | None = None,
    *,
    name: str = "",
    advice: str = "",
) -> Information:
    """Return the information of the free parameters; ``matrix`` is that of the searched numbers.

    ``values`` are those of the free parameters, by default their starts.
    """
    free = [spec for spec in chosen if not spec.frozen]
    at = [spec.initial for spec in free] if values is None else values
    sizes = {
        spec.name: float(value) if spec.logarithmic else 1.0
        for spec, value in zip(free, at, strict=True)
    }
    return of_log_information(matrix, sizes, name=name, advice=advice)


def pose_information(
    robot: Robot,
    chosen: Sequence[Spec],
    operating_points_rad: ArrayLike,
    frequency_hz: ArrayLike,
    *,
    relative_std: ArrayLike,
    quantity: Quantity,
    sampling: Sampling,
    effects: Sequence[Effect],
) -> Real:
    """Return the information of every operating point, (n_points, n_free, n_free)."""
    check_sampling(sampling)
    points = np.asarray(operating_points_rad, float)
    if points.ndim != 2 or points.shape[1] != robot.n_axes or not len(points):
        raise InputError(
            f"operating_points_rad: expected shape (n_points, {robot.n_axes}), got {points.shape}"
        )
    f = np.atleast_1d(np.asarray(frequency_hz, float))
    shape = (len(points), len(f), robot.n_axes, robot.n_axes)
    try:
        error = np.broadcast_to(np.asarray(relative_std, float), shape)
    except ValueError:
        raise InputError(
            f"relative_std: expected a shape that broadcasts to {shape}, got "
            f"{np.shape(relative_std)}"
        ) from None
    if not (error > 0).all():
        raise InputError("relative_std: expected positive numbers, got others")
    model = robot.with_parameters({s.name: s.initial for s in chosen})
    poses: list[PoseTuple] = []
    for point, share in zip(points, error, strict=True):
        response = model_response(
            model, f, point.tolist(), quantity=quantity, sampling=sampling, effects=effects
        ).values
        variance = (share * np.abs(response)) ** 2
        response = np.where(response == 0, 1.0, response)
        variance = np.where(variance > 0, variance, np.inf)
        poses.append(MeasuredResponse(tuple(point), f, response, quantity, variance).core())
    options = FrequencyFitOptions(criterion="weighted_least_squares", sampling=sampling)
    return _core.frequency_information(
        robot.core,
        core_effects(robot.placed(effects)),
        list(chosen),
        poses,
        core_options(options),
    )
