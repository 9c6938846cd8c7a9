"""Prediction-error fit of one axis: step 3 of the thesis's procedure, section 9.3.3."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from axisight import _core
from axisight.errors import InputError
from axisight.graybox.axis_checks import check_data, check_energy, data_warnings
from axisight.graybox.axis_model import AxisData, AxisModel, AxisParameter, number
from axisight.graybox.axis_result import AxisFit, NoiseModel, conclude
from axisight.graybox.noise_filter import estimate_filter

Array = NDArray[np.float64]
NoiseKind = Literal["output_error", "innovations", "ar"]

# Shares of the speed error fed back in rounds before the fit proper, see `FitSettings`.
GRADUAL = (0.2, 0.02)
# Where the search for the innovations gains starts.
FIRST_GAIN = 0.02


@dataclass(frozen=True)
class FitSettings:
    """Settings of `fit_axis`.

    The search stops when the linear model promises to lower the loss by less than
    ``loss_tolerance`` of it, when no parameter moves by more than ``step_tolerance`` of itself,
    or after ``max_iterations`` accepted steps. The tolerances are tight because stiffness-like
    parameters hardly change the loss: with the usual 1e-8 the cubic term is left far off.

    ``gradual`` gives observer gains of searches that come before: the error of the predicted
    motor speed is fed back to all speeds with that share per sample, which takes the local
    minima out of the loss. ``block_s`` is the length of the blocks of the sandwich covariance;
    it should exceed the correlation time of the residuals. ``ar_order`` fixes the order of the
    noise filter, otherwise chosen up to ``most_ar_order``; ``ar_rounds`` bounds the refits.
    """

    max_iterations: int = 100
    loss_tolerance: float = 1e-12
    step_tolerance: float = 1e-11
    gradual: tuple[float, ...] = ()
    block_s: float = 0.25
    ar_order: int | None = None
    most_ar_order: int = 30
    ar_rounds: int = 5

    def __post_init__(self) -> None:
        for name in ("loss_tolerance", "step_tolerance", "block_s"):
            if number(name, getattr(self, name)) <= 0:
                raise InputError(f"{name}: expected a positive number, got {getattr(self, name)}")
        for name in ("max_iterations", "most_ar_order", "ar_rounds"):
            value = getattr(self, name)
            if not isinstance(value, (int, np.integer)) or value < 1:
                raise InputError(f"{name}: expected a whole number from 1, got {value!r}")
        order = self.ar_order
        if order is not None and (not isinstance(order, (int, np.integer)) or order < 1):
            raise InputError(f"ar_order: expected a whole number from 1, got {order!r}")
        for gain in self.gradual:
            if not 0 < number("gradual", gain) < 1:
                raise InputError(f"gradual: expected gains between 0 and 1, got {gain}")


@dataclass(frozen=True)
class Task:
    """Everything a search needs but its start."""

    model: AxisModel
    data: tuple[AxisData, ...]
    table: tuple[AxisParameter, ...]
    free: frozenset[str]
    bounds: Mapping[str, tuple[float, float]]
    settings: FitSettings

    @property
    def free_names(self) -> tuple[str, ...]:
        """Free parameters in the order of the model."""
        return tuple(p.name for p in self.table if p.name in self.free)


def fit_axis(
    model: AxisModel,
    data_sets: Sequence[AxisData] | AxisData,
    start: Mapping[str, float],
    *,
    fixed: Iterable[str] = (),
    bounds: Mapping[str, tuple[float, float]] | None = None,
    free_gear_ratio: bool = False,
    noise_model: NoiseKind = "output_error",
    settings: FitSettings | None = None,
) -> AxisFit:
    """Fit the parameters of an axis to records, all at once, by their prediction errors.

    Parameters
    ----------
    model : structure.
    data_sets : one or more records, of any lengths and sample times; each is simulated on its
        own and their squared errors are added with their weights.
    start : where the search starts, by name (`AxisModel.parameters`); what is left out starts
        where it changes nothing, for instance ``d`` at 0.
    fixed : names of parameters kept at their start.
    bounds : (lower, upper) by name, in place of the defaults (inertias, stiffnesses, dampings
        and frictions are not negative).
    free_gear_ratio : estimate ``r`` too. Motor-side data show r only together with ``J_a``,
        ``k1``, ``d`` (all scale by 1/r^2): fix one of these.
    noise_model : what the prediction error is taken to be.

        ``"output_error"``: the model is simulated with the measured torque alone and what is
        left is white noise on the output (thesis 9.2-9.3). Unbiased in closed loop only if
        that is so: torque that is not modelled is integrated into slowly varying errors that
        the feedback correlates with the input.
        ``"innovations"``: a constant observer gain K on the output error, (3.33), estimated
        with the parameters, so that low-frequency torque errors are followed, not explained.
        ``"ar"``: the residuals of the output error are whitened by an autoregressive filter,
        H = 1/A(q), estimated from them, and the fit is repeated until both agree.
    settings : tolerances and the like.

    Returns
    -------
    `AxisFit`: parameters, uncertainty, status and warnings in words.

    Raises InputError for misuse: missing or unknown names, a start outside its bounds, nothing
    left to fit, data of the wrong kind, records in which the axis gives more energy than it
    got (a sign is wrong), and a start from which the simulation diverges. A search that does
    not converge is told in ``status`` and ``warnings``.

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
    if noise_model not in ("output_error", "innovations", "ar"):
        raise InputError(
            f"noise_model: expected output_error, innovations or ar, got {noise_model!r}"
        )
    token = _core.CancelToken()
    point = first_point(task, values)
    point = search_rounds(task, point, values["r"], token)
    if noise_model == "innovations":
        gains = rigid_gains(model, values["r"], FIRST_GAIN)
        point = search(task, replace(point, gains=gains, predicts=True, free_gains=True), token)
    elif noise_model == "ar":
        point = _whitened(task, point, token)
    noise = NoiseModel(
        noise_model,
        gains=point.gains,
        whitening=point.whitening,
    )
    return conclude(task, point, noise, data_warnings(model, task.data, task.free_names))


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
    """Check the arguments of a fit; return the task and all starting values."""
    data = check_data(model, data_sets)
    held = {fixed} if isinstance(fixed, str) else set(fixed)
    for field, names in (("fixed", held), ("bounds", set(bounds or {})), ("start", set(start))):
        unknown = sorted(names - set(model.parameter_names))
        if unknown:
            raise InputError(
                f"{field}: expected names out of {', '.join(model.parameter_names)}, "
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
    return Task(model, data, model.parameters, free, limits, settings), values


def _interval(name: str, pair: tuple[float, float]) -> tuple[float, float]:
    try:
        low, high = (float(x) for x in pair)
    except (TypeError, ValueError) as error:
        raise InputError(f"bounds: {name}: expected (lower, upper), got {pair!r}") from error
    if not low < high:
        raise InputError(f"bounds: {name}: expected lower below upper, got {low}, {high}")
    return low, high


@dataclass(frozen=True)
class Point:
    """Where a search stands: the core's vector of parameters and how errors are predicted."""

    theta: tuple[float, ...]
    gains: tuple[float, ...] = ()
    predicts: bool = False
    free_gains: bool = False
    whitening: tuple[float, ...] = ()
    status: str = ""
    matrix: Array = field(default_factory=lambda: np.zeros((0, 0)))
    errors: Array = field(default_factory=lambda: np.zeros(0))
    block_gradients: Array = field(default_factory=lambda: np.zeros((0, 0)))
    loss: float = np.nan
    initial_loss: float = np.nan
    iterations: int = 0
    evaluations: int = 0

    def vector(self, task: Task) -> list[float]:
        """All parameters with the present gains."""
        n, first = task.model.n_gains(), len(task.model.vector({})) - task.model.n_gains()
        theta = list(self.theta)
        theta[first : first + n] = self.gains or [0.0] * n
        return theta


def first_point(task: Task, values: Mapping[str, float]) -> Point:
    """The start of a search: parameters, no gains, and the start of every record."""
    theta = task.model.vector(values)
    for record in task.data:
        begin = [0.0] * (2 * task.model.n_masses)
        begin[0] = record.start_angle_rad()
        if task.model.initial == "free" and task.model.output != "position":
            speed = float(record.measured(task.model)[0])
            joint = [values["r"] * speed] * (task.model.n_masses - 1)
            begin[task.model.n_masses :] = [speed, *joint]
        theta += begin
    return Point(tuple(theta))


def rigid_gains(model: AxisModel, ratio: float, share: float) -> tuple[float, ...]:
    """Gains that turn all masses together: no spring is stretched by a correction."""
    springs = model.n_masses - 1
    return (*[0.0] * springs, share, *[ratio * share] * springs)


def free_places(task: Task, point: Point) -> list[int]:
    """Places of everything that may move in the core's vector."""
    model = task.model
    places = [i for name, i in model.places().items() if name in task.free]
    shared, states = len(model.vector({})), 2 * model.n_masses
    if point.free_gains:
        places += range(shared - model.n_gains(), shared)
    for s in range(len(task.data)):
        begin = shared + s * states
        if model.output == "position":
            places.append(begin)
        if model.initial == "free":
            places += range(begin + 1, begin + states)
    return places


def search(task: Task, point: Point, token: _core.CancelToken) -> Point:
    """Minimize from a point; the counts of work add up."""
    model, theta = task.model, point.vector(task)
    free = set(free_places(task, point))
    low = [-np.inf] * len(theta)
    high = [np.inf] * len(theta)
    for name, i in model.places().items():
        low[i], high[i] = task.bounds[name] if name in task.free else (theta[i], theta[i])
        if name.startswith(("J_", "k1", "v_s", "r")):
            # Zero is no inertia, but a search may run there.
            low[i] = max(low[i], 1e-6 * theta[i])
    specs = [
        (x, min(lo, x), max(hi, x), abs(x) or 1.0, i in free)
        for i, (x, lo, hi) in enumerate(zip(theta, low, high, strict=True))
    ]
    found = _core.axis_fit(
        model.core(),
        [d.core(model, task.settings.block_s) for d in task.data],
        specs,
        whitening=list(point.whitening),
        predicts=point.predicts,
        max_iterations=task.settings.max_iterations,
        loss_tolerance=task.settings.loss_tolerance,
        step_tolerance=task.settings.step_tolerance,
        cancel=token,
    )
    status, vector, loss, initial_loss, iterations, evaluations, matrix, errors, blocks = found
    first = len(model.vector({})) - model.n_gains()
    gains = tuple(vector[first : first + model.n_gains()].tolist()) if point.predicts else ()
    return replace(
        point,
        theta=tuple(vector.tolist()),
        gains=gains,
        status=status,
        matrix=matrix,
        errors=errors,
        block_gradients=blocks,
        loss=loss,
        initial_loss=initial_loss,
        iterations=point.iterations + iterations,
        evaluations=point.evaluations + evaluations,
    )


def search_rounds(task: Task, point: Point, ratio: float, token: _core.CancelToken) -> Point:
    """Minimize the output error, in the rounds that the settings ask for."""
    rough = replace(task, settings=replace(task.settings, loss_tolerance=1e-4))
    for gain in task.settings.gradual:
        held = replace(point, gains=rigid_gains(task.model, ratio, gain), predicts=True)
        point = search(rough, held, token)
    return search(task, replace(point, gains=(), predicts=False), token)


def free_run(task: Task, point: Point, i: int) -> Array:
    """Simulate record ``i`` from its estimated start, without feedback of errors."""
    model, record = task.model, task.data[i]
    shared, states = len(model.vector({})), 2 * model.n_masses
    begin = point.theta[shared + i * states : shared + (i + 1) * states]
    theta = [*point.theta[:shared], *begin]
    return _core.axis_simulate(model.core(), record.core(model), theta, predicts=False)[0]


def _whitened(task: Task, point: Point, token: _core.CancelToken) -> Point:
    """Refit with the residuals whitened until the filter no longer changes."""
    for _ in range(task.settings.ar_rounds):
        parts = [
            np.sqrt(d.weight) * (free_run(task, point, i) - d.measured(task.model))
            for i, d in enumerate(task.data)
        ]
        found = estimate_filter(parts, task.settings.ar_order, task.settings.most_ar_order)
        before = point.loss
        point = search(task, replace(point, whitening=tuple(found.tolist())), token)
        if point.whitening and abs(before - point.loss) <= 1e-4 * before:
            break
    return point
