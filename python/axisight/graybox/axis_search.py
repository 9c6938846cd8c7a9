"""Searches for the parameters of an axis: the task, the state of a search, and its rounds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from axisight import _core
from axisight.errors import InputError
from axisight.graybox.axis_model import AxisData, AxisModel, AxisParameter, number

Array = NDArray[np.float64]

# Shares of the speed error fed back in rounds before the search proper, see `FitSettings`.
GRADUAL = (0.2, 0.02)
# Statuses of a search that converged.
CONVERGED = ("loss_converged", "step_converged", "exact")
# Tolerance of rough rounds, which only give a start.
ROUGH = 1e-4


@dataclass(frozen=True)
class FitSettings:
    """Settings of `fit_axis`.

    The search stops when the linear model predicts a fall of the loss by less than
    ``loss_tolerance`` of itself, when no parameter moves by more than ``step_tolerance`` of itself,
    or after ``max_iterations`` accepted steps. The tolerances are tight because stiffness-like
    parameters hardly change the loss: with the usual 1e-8 the cubic term has a large error.

    ``gradual`` are the observer gains of rough searches. They feed that share of the error of the
    predicted motor speed back to all speeds at every sample, which removes some local minima of the
    loss and adds others. The fit searches both from the start and after the rough searches, and keeps
    the lower loss; a warning tells if both disagree. ``()`` leaves out the rough searches and saves
    two thirds of the work.

    ``block_s`` [s] is the length of the blocks of the sandwich covariance; it should exceed the
    correlation time of the residuals. None is 0.25 s, or less if the records would give fewer than
    four blocks for each parameter. ``ar_order`` fixes the order of the noise filter; without it the
    order is chosen up to ``most_ar_order``. ``ar_rounds`` limits the refits. Raises InputError naming
    the field.
    """

    max_iterations: int = 100
    loss_tolerance: float = 1e-12
    step_tolerance: float = 1e-11
    gradual: tuple[float, ...] = GRADUAL
    block_s: float | None = None
    ar_order: int | None = None
    most_ar_order: int = 30
    ar_rounds: int = 5

    def __post_init__(self) -> None:
        """Check all numbers."""
        for name in ("loss_tolerance", "step_tolerance", "block_s"):
            value = getattr(self, name)
            if (name != "block_s" or value is not None) and number(name, value) <= 0:
                raise InputError(f"{name}: expected a positive number, got {value}")
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
    """Model, data and settings of a search."""

    model: AxisModel
    data: tuple[AxisData, ...]
    table: tuple[AxisParameter, ...]
    free: frozenset[str]
    bounds: Mapping[str, tuple[float, float]]
    settings: FitSettings
    start: Mapping[str, float] = field(default_factory=dict)
    # Warnings about records that may start in motion although the model starts at rest.
    doubts: tuple[str, ...] = ()

    @property
    def free_names(self) -> tuple[str, ...]:
        """Free parameters in the order of the model."""
        return tuple(p.name for p in self.table if p.name in self.free)


# Blocks per parameter: fewest for which their scatter means anything, and the wanted number.
LEAST_BLOCKS, ENOUGH_BLOCKS = 3, 4
LONGEST_BLOCK_S = 0.25


def block_length_s(task: Task, n: int) -> float:
    """Return the length of the blocks of the sandwich covariance of ``n`` parameters [s]."""
    if task.settings.block_s is not None:
        return task.settings.block_s
    total = sum(len(d) * d.sample_time_s for d in task.data)
    return min(LONGEST_BLOCK_S, total / (ENOUGH_BLOCKS * max(n, 1)))


@dataclass(frozen=True)
class Point:
    """The state of a search: the core's vector of parameters, and the noise model."""

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
    # Final losses of the other searches from the same start.
    others: tuple[float, ...] = ()

    def vector(self, task: Task) -> list[float]:
        """Return all parameters with the present gains."""
        n, first = task.model.n_gains(), len(task.model.vector({})) - task.model.n_gains()
        theta = list(self.theta)
        theta[first : first + n] = self.gains or [0.0] * n
        return theta


def first_point(task: Task, values: Mapping[str, float]) -> Point:
    """Return the start of a search: parameters, no gains, and the start of every record."""
    theta = task.model.vector(values)
    for record in task.data:
        begin = [0.0] * (2 * task.model.n_masses)
        begin[0] = record.start_angle_rad()
        if task.model.initial == "free" and task.model.output != "position":
            # The first sample has no backward difference.
            first = int(task.model.output == "velocity_difference")
            speed = float(record.measured(task.model)[first])
            joint = [values["r"] * speed] * (task.model.n_masses - 1)
            begin[task.model.n_masses :] = [speed, *joint]
        theta += begin
    return Point(tuple(theta))


def rigid_gains(model: AxisModel, ratio: float, share: float) -> tuple[float, ...]:
    """Return gains that correct all masses alike, so that a correction deflects no spring."""
    springs = model.n_masses - 1
    return (*[0.0] * springs, share, *[ratio * share] * springs)


def free_places(task: Task, point: Point) -> list[int]:
    """Return the indices of all free entries of the core's vector."""
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
    """Return the minimum reached from ``point``; iterations and evaluations include those of ``point``."""
    model, theta = task.model, point.vector(task)
    free = set(free_places(task, point))
    low = [-np.inf] * len(theta)
    high = [np.inf] * len(theta)
    for name, i in model.places().items():
        low[i], high[i] = task.bounds[name] if name in task.free else (theta[i], theta[i])
        if name.startswith(("J_", "k1", "v_s", "r")):
            # An inertia cannot be zero, but a search may run towards zero.
            low[i] = max(low[i], 1e-6 * theta[i])
    specs = [
        (x, min(lo, x), max(hi, x), abs(x) or 1.0, i in free)
        for i, (x, lo, hi) in enumerate(zip(theta, low, high, strict=True))
    ]
    found = _core.axis_fit(
        model.core(),
        [d.core(model, block_length_s(task, len(free))) for d in task.data],
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
    """Return the better minimum of the output error, from a direct search and from one after rough rounds.

    Neither search always finds the global minimum, and they fail on different records.
    """
    ends: list[Point] = []
    failure = None
    for rounds in dict.fromkeys(((), tuple(task.settings.gradual))):
        try:
            ends.append(_search_after(task, point, rounds, ratio, token))
        except InputError as error:  # the motion diverged, but the other search may succeed
            failure = error
    if not ends:
        assert failure is not None
        raise failure
    best = min(ends, key=lambda end: end.loss)
    return replace(
        best,
        iterations=sum(end.iterations for end in ends),
        evaluations=sum(end.evaluations for end in ends),
        others=tuple(end.loss for end in ends if end is not best),
    )


def _search_after(
    task: Task, point: Point, rounds: tuple[float, ...], ratio: float, token: _core.CancelToken
) -> Point:
    rough = replace(task, settings=replace(task.settings, loss_tolerance=ROUGH))
    for gain in rounds:
        held = replace(point, gains=rigid_gains(task.model, ratio, gain), predicts=True)
        point = search(rough, held, token)
    return search(task, replace(point, gains=(), predicts=False), token)


def error_variance(task: Task, point: Point) -> float:
    """Return the variance of the weighted prediction errors at the end of a search.

    Degrees of freedom are the samples minus all estimated numbers, and minus the first samples of
    each record that a noise filter leaves out.
    """
    left_out = len(point.whitening) * len(task.data)
    freedom = point.errors.size - left_out - len(point.matrix)
    return float(point.errors @ point.errors) / max(freedom, 1)


# Losses within this share of the energy of the data belong to one minimum.
SAME_MINIMUM = 1e-6
# A loss below this share (a fit of 99 %) explains the data, so no lower minimum is missed.
EXPLAINED = 1e-4


def disagreement(task: Task, point: Point) -> list[str]:
    """Return a warning if searches from the same start ended at different losses."""
    energy = sum(d.weight * float(np.sum(d.measured(task.model) ** 2)) for d in task.data)
    other = max(point.others, default=point.loss)
    if point.loss <= EXPLAINED * energy:
        return []
    if other - point.loss <= max(SAME_MINIMUM * energy, 1e-3 * point.loss):
        return []
    return [
        f"local minima: two searches from this start ended at losses {point.loss:.4g} (kept) and "
        f"{other:.4g}; a lower one may exist: try multistart_axis"
    ]


def free_run(task: Task, point: Point, i: int) -> Array:
    """Return record ``i`` simulated from its estimated start, without feedback of errors."""
    model, record = task.model, task.data[i]
    shared, states = len(model.vector({})), 2 * model.n_masses
    begin = point.theta[shared + i * states : shared + (i + 1) * states]
    theta = [*point.theta[:shared], *begin]
    return _core.axis_simulate(model.core(), record.core(model), theta, predicts=False)[0]
