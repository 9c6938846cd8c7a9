"""Prediction-error fit of one axis: step 3 of the thesis's procedure, section 9.3.3."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from axisight import _core
from axisight.errors import InputError
from axisight.graybox.axis_checks import check_data, check_energy, check_start, data_warnings
from axisight.graybox.axis_findings import start_findings
from axisight.graybox.axis_model import AxisData, AxisModel, number
from axisight.graybox.axis_result import AxisFit, NoiseModel, conclude
from axisight.graybox.axis_search import (
    CONVERGED,
    FitSettings,
    Point,
    Task,
    disagreement,
    error_variance,
    first_point,
    free_places,
    free_run,
    rigid_gains,
    search,
    search_rounds,
)
from axisight.graybox.noise_filter import estimate_filter
from axisight.graybox.normal_matrix import inverse_normal

NoiseKind = Literal["output_error", "innovations", "ar"]

# Start of the search for the innovations gains.
FIRST_GAIN = 0.02
# Parameters and noise filter agree if a new filter moves parameters by less than this [standard errors].
AGREED = 0.05
# Most refits with weights from the residuals, and the relative change at which they end.
WEIGHT_ROUNDS = 10
SAME_WEIGHT = 0.01


def fit_axis(
    model: AxisModel,
    data_sets: Sequence[AxisData] | AxisData,
    start: Mapping[str, float],
    *,
    fixed: Iterable[str] = (),
    bounds: Mapping[str, tuple[float, float]] | None = None,
    free_gear_ratio: bool = False,
    noise_model: NoiseKind = "output_error",
    weights: Literal["given", "residuals"] = "given",
    settings: FitSettings | None = None,
) -> AxisFit:
    """Fit the parameters of an axis to all records together, by their prediction errors.

    Parameters
    ----------
    model : structure of the axis.
    data_sets : one or more records, of any lengths and sample times. Each is simulated on its own;
        the loss is the weighted sum of their squared errors.
    start : start of the search by name (`AxisModel.parameters`). Parameters left out start at their
        neutral value, for instance ``d`` at 0.
    fixed : names of parameters kept at their start.
    bounds : (lower, upper) by name, instead of the defaults (inertias, stiffnesses, dampings
        and frictions are not negative).
    free_gear_ratio : estimate ``r`` too. Motor-side data show r only together with ``J_a``,
        ``k1``, ``d`` (all scale by 1/r^2), so fix one of these.
    noise_model : assumption on the prediction error.

        ``"output_error"``: the measured torque alone drives the model, and the error is white noise on
        the output (thesis 9.2-9.3). In closed loop the fit is biased if that does not hold: the plant
        integrates torque errors into slow output errors, which feedback correlates with the input.
        ``"innovations"``: a constant observer gain K on the output error, (3.33), is estimated with
        the parameters. The observer then follows low-frequency torque errors.
        ``"ar"``: an autoregressive filter H = 1/A(q) whitens the residuals of the output error. It is
        estimated from them, and the fit is repeated until both agree.
    weights : ``"given"`` takes those of the records. ``"residuals"`` takes one over the variance of
        each record's residuals, and refits until the weights no longer change. Use it if noise differs
        between records, but not if one record shows an effect that the model lacks.
    settings : tolerances and limits of the search.

    Returns
    -------
    `AxisFit`: parameters, uncertainty, status and warnings in words.

    Raises InputError for misuse:

    - missing or unknown names, a start outside its bounds, no parameter left to fit
    - data of the wrong kind
    - records in which the axis returns more energy than it got, because a sign is wrong
    - records that begin in motion although the model starts at rest
    - a start from which the simulation diverges

    ``status`` and ``warnings`` tell if a search does not converge.

    """
    task, values = prepare(
        model,
        data_sets,
        start,
        fixed=fixed,
        bounds=bounds,
        free_gear_ratio=free_gear_ratio,
        settings=settings or FitSettings(),
    )
    _check_choices(noise_model, weights)
    token = _core.CancelToken()
    point = first_point(task, values)
    point = search_rounds(task, point, values["r"], token)
    warnings = (
        *data_warnings(model, task.data, task.free_names),
        *start_findings(task, point, token),
        *disagreement(task, point),
    )
    point = _with_noise(task, point, noise_model, token)
    if weights == "residuals":
        task, point, said = _reweighted(task, point, noise_model, token)
        warnings += said
    noise = NoiseModel(noise_model, gains=point.gains, whitening=point.whitening)
    return conclude(task, point, noise, warnings)


def _check_choices(noise_model: str, weights: str) -> None:
    if noise_model not in ("output_error", "innovations", "ar"):
        raise InputError(
            f"noise_model: expected output_error, innovations or ar, got {noise_model!r}"
        )
    if weights not in ("given", "residuals"):
        raise InputError(f"weights: expected given or residuals, got {weights!r}")


def prepare(
    model: AxisModel,
    data_sets: Sequence[AxisData] | AxisData,
    start: Mapping[str, float],
    *,
    fixed: Iterable[str],
    bounds: Mapping[str, tuple[float, float]] | None,
    free_gear_ratio: bool,
    settings: FitSettings,
) -> tuple[Task, dict[str, float]]:
    """Return the task and all starting values, after a check of the arguments of a fit."""
    data = check_data(model, data_sets)
    held = {fixed} if isinstance(fixed, str) else set(fixed)
    for argument, names in (("fixed", held), ("bounds", set(bounds or {})), ("start", set(start))):
        unknown = sorted(names - set(model.parameter_names))
        if unknown:
            raise InputError(
                f"{argument}: expected names out of {', '.join(model.parameter_names)}, "
                f"got {', '.join(unknown)}"
            )
    limits = {p.name: (p.lower, p.upper) for p in model.parameters}
    for name, pair in (bounds or {}).items():
        limits[name] = _interval(name, pair)
    for name, value in start.items():
        low, high = limits[name]
        if not low <= number(f"start: {name}", value) <= high:
            raise InputError(f"start: {name}: expected {low:g} to {high:g}, got {value}")
    values = model.complete(start)
    if not free_gear_ratio:
        held.add("r")
    free = frozenset(set(model.parameter_names) - held)
    if not free:
        raise InputError("fixed: expected at least one parameter left to fit, got all fixed")
    check_energy(model, data)
    doubts = check_start(model, data, values)
    return Task(model, data, model.parameters, free, limits, settings, values, doubts), values


def _interval(name: str, pair: tuple[float, float]) -> tuple[float, float]:
    try:
        low, high = (float(x) for x in pair)
    except (TypeError, ValueError) as error:
        raise InputError(f"bounds: {name}: expected (lower, upper), got {pair!r}") from error
    if not low < high:
        raise InputError(f"bounds: {name}: expected lower below upper, got {low}, {high}")
    return low, high


def _with_noise(task: Task, point: Point, kind: NoiseKind, token: _core.CancelToken) -> Point:
    """Return the refit with the noise model, from the end of an output-error fit."""
    if kind == "innovations":
        gains = point.gains or rigid_gains(task.model, task.start["r"], FIRST_GAIN)
        return search(task, replace(point, gains=gains, predicts=True, free_gains=True), token)
    return _whitened(task, point, token) if kind == "ar" else point


def _reweighted(
    task: Task, point: Point, kind: NoiseKind, token: _core.CancelToken
) -> tuple[Task, Point, tuple[str, ...]]:
    """Return the refit whose weights, one over the variance of the residuals, no longer change."""
    lengths = np.cumsum([len(d) for d in task.data])[:-1]
    for _ in range(WEIGHT_ROUNDS):
        old = np.array([d.weight for d in task.data])
        power = [np.mean(e**2) for e in np.split(point.errors, lengths)] / old
        if np.min(power) <= 0:
            return task, point, ("a record without residuals has no weight: weights as given",)
        new = power[0] / power
        if np.all(np.abs(new / (old / old[0]) - 1) < SAME_WEIGHT):
            return task, point, ()
        records = zip(task.data, new.tolist(), strict=True)
        task = replace(task, data=tuple(replace(d, weight=w) for d, w in records))
        point = search(task, replace(point, whitening=()), token) if kind == "ar" else point
        point = search(task, point, token) if kind == "output_error" else point
        point = _with_noise(task, point, kind, token)
    return task, point, (f"weights still change after {WEIGHT_ROUNDS} rounds: give them instead",)


def _whitened(task: Task, point: Point, token: _core.CancelToken) -> Point:
    """Return the refit with whitened residuals at which neither parameters nor filter change.

    If they still change after all rounds, the status is ``noise_rounds``.
    """
    places = free_places(task, point)
    for _ in range(task.settings.ar_rounds):
        parts = [
            np.sqrt(d.weight) * (free_run(task, point, i) - d.measured(task.model))
            for i, d in enumerate(task.data)
        ]
        found = estimate_filter(parts, task.settings.ar_order, task.settings.most_ar_order)
        whitening = tuple(found.tolist())
        before = np.array(point.theta)[places]
        same_order = len(whitening) == len(point.whitening)
        if not (whitening or point.whitening):
            return point  # the residuals are white without a filter
        point = search(task, replace(point, whitening=whitening), token)
        inverse, _ = inverse_normal(point.matrix)
        size = np.sqrt(error_variance(task, point) * np.diag(inverse))
        moved = np.abs(np.array(point.theta)[places] - before)
        if same_order and np.all(moved <= AGREED * size):
            return point
    return replace(point, status="noise_rounds") if point.status in CONVERGED else point
