"""Fits the simulator's own parameters and effects to logs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from axisight import _core
from axisight.effects import Effect, effect_info
from axisight.fitting import (
    FitOptions,
    Parameter,
    Weighting,
    effect_parameter,
    robot_parameter,
    robot_parameters,
)
from axisight.fitting.divergence import Diverged
from axisight.gap.fit.fitted_model import FittedModel, Hypothesis, NormalEquations
from axisight.gap.fit.gear_rows import GearRows, fit_loss, gear_rows
from axisight.gap.fit.held_out import linear_step
from axisight.gap.fit.rank_deficiency import deviations_seen
from axisight.gap.fit.time_limit import TimeLimit
from axisight.gap.fit.work_count import WorkCount
from axisight.gap.simulator.gear_readings import GearReadings
from axisight.gap.simulator.natural_sizes import NaturalSizes
from axisight.gap.simulator.own_parameters import for_core
from axisight.gap.simulator.tolerances import spring_changes, tolerance_of
from axisight.robot import Robot

Array = NDArray[np.float64]


# Relative fall of the loss at which a fit ends: for fits of causes, and for fits of candidates.
_TOLERANCE = 1e-4
_TRIAL_TOLERANCE = 1e-3


@dataclass(frozen=True)
class _Setup:
    """Effects, parameters and reused sensitivities (``warm``) of one fit."""

    effects: list[Effect]
    parameters: list[Parameter]
    own: list[Parameter]
    warm: list[tuple[int, _core.Column]]


class ModelFitter(ABC):
    """Fits models to one set of logs; subclasses define the error that is minimised.

    A model that cannot be simulated is returned as `Diverged`; misuse raises InputError. ``adds_up``: the errors of the
    effects of an axis add up and can hide one another. Missing effects are then tried in pairs, too. ``silent``: axes
    (from 0) that are not judged.
    """

    adds_up = False
    step_tolerance = 1e-4
    silent: tuple[int, ...] = ()

    def __init__(
        self, robot: Robot, weighting: Weighting, tolerances: Mapping[str, float], block_s: float
    ) -> None:
        self.robot = robot
        self.weighting = weighting
        self.block_s = block_s
        self.cancel = _core.CancelToken()
        # A fitter and all its copies share one count.
        self.work = WorkCount()
        self.time_limit = TimeLimit.none()
        self.tolerances = tolerances
        self.natural: NaturalSizes | None = None
        self.gears: GearReadings | None = None
        self.own = [
            robot_parameter(robot, name, relative_tolerance=tolerance)
            for name, value in robot_parameters(robot).items()
            if (tolerance := tolerance_of(tolerances, name)) is not None
            # A parameter that is zero in the simulator has no tolerance. A value there would be an effect.
            and value != 0
            and self.takes_part(name)
        ]

    def within_tolerance(self, effect: Effect) -> bool:
        """Whether an effect is no larger than the tolerance of the parameter that it changes (three deviations)."""
        if springs := spring_changes(effect):
            return max(map(abs, springs)) < self.tolerated(effect)
        change = effect.values()[0]
        for own in self.robot.effects:
            if own.label == effect.label:
                change -= own.values()[0]
        return abs(change) < self.tolerated(effect)

    def tolerated(self, effect: Effect) -> float:
        """Return the size up to which an effect is within the tolerance of its parameter (three deviations)."""
        name = _same_quantity(self.robot, effect)
        spring = bool(spring_changes(effect))
        if spring and effect.axis is not None:
            name = self.robot.axis_parameter(effect.axis, "stiffness")
        if name is None:
            return 0.0
        tolerance = tolerance_of(self.tolerances, name) or 0.0
        relative = spring or _is_relative(effect.name)
        nominal = 1.0 if relative else robot_parameters(self.robot)[name]
        return 3 * tolerance * nominal

    def takes_part(self, name: str) -> bool:
        """Whether a robot parameter enters this error."""
        return bool(name)

    def bends(self, name: str) -> bool:
        """Whether an own parameter changes the sensitivities of others too much for them to be reused."""
        del name
        return False

    @abstractmethod
    def solve(
        self,
        effects: Sequence[Effect],
        parameters: Sequence[Parameter],
        options: FitOptions,
        warm: list[tuple[int, _core.Column]],
        near: _core.Courses | None,
    ) -> _core.FitResult | Diverged:
        """Run the fit in the core, starting from the runs ``near`` if there are any."""

    @abstractmethod
    def linearize(
        self,
        effects: Sequence[Effect],
        parameters: Sequence[Parameter],
        options: FitOptions,
        warm: list[tuple[int, _core.Column]],
        near: _core.Courses | None,
    ) -> _core.Linearization | Diverged:
        """Evaluate the model and its sensitivities in the core, at the initial values."""

    def part(self, logs: Sequence[int]) -> ModelFitter:
        """Return a copy for some of the logs, by their numbers; both share one cancellation."""
        other = copy(self)
        other.gears = None if self.gears is None else self.gears.part(logs)
        other._keep(logs)
        return other

    def until(self, limit: TimeLimit) -> ModelFitter:
        """Return a copy that raises TimeUp once a time limit is reached, before a fit or an evaluation begins."""
        other = copy(self)
        other.time_limit = limit
        return other

    def within(self, tolerances: float) -> ModelFitter:
        """Return a copy whose own parameters stay within this many of their tolerances."""
        other = copy(self)
        other.own = [_kept_within(p, tolerances) for p in self.own]
        return other

    def beginnings(self) -> ModelFitter | None:
        """Return a copy for the first halves of the logs; None if this error needs whole logs."""
        return None

    def begun(self, model: FittedModel) -> tuple[ModelFitter, FittedModel] | None:
        """Return a copy for the first halves of the logs, with the model there; None if only whole logs can be used.

        The model keeps its values. Its sensitivities are the first halves of those of the whole logs; the weighting
        filter mixes only a little of the second half into them.
        """
        other = self.beginnings()
        if other is None:
            return None
        rows = _first_halves(model)
        cut = {key: column.part(rows) for key, column in model.columns.items()}
        setup = other._setup(
            model.free, replace(model, columns=cut), None, [True] * len(model.free), lazy=True
        )
        found = other._solved(setup, model.free, other._options(), None, renewed=model.renewed)
        if isinstance(found, Diverged):
            return None
        # Values stay exactly the same: fits of screened candidates start at the values of the whole logs.
        same = replace(found, robot_values=model.robot_values, log=np.unique(model.log)[found.log])
        return other, same

    def counted(self) -> Array | None:
        """Return the weight of every residual (n_residuals,), from 0 to 1; None if all are one."""
        return None

    def tempered(self, factor: Array) -> ModelFitter:
        """Return a copy whose errors are multiplied by a factor of each axis (n_axes,)."""
        del factor
        return self

    @abstractmethod
    def _keep(self, logs: Sequence[int]) -> None:
        """Keep only some of the logs, by their numbers."""

    def runs(
        self, model: FittedModel, robot_values: Mapping[str, float] | None = None
    ) -> _core.Courses | Diverged | None:
        """Return simulated runs of a model, from which similar models are simulated faster; None if there are none.

        ``robot_values``: own parameters in place of the model's.
        """
        held = [False] * len(model.free)
        setup = self._setup(model.free, model, robot_values, held, lazy=False)
        return self.run(*self._for_core(setup))

    def _for_core(self, setup: _Setup) -> tuple[list[Effect], list[Parameter]]:
        return for_core(self.robot, setup.effects, setup.parameters)

    def run(
        self, effects: Sequence[Effect], parameters: Sequence[Parameter]
    ) -> _core.Courses | Diverged | None:
        """Simulate the model in the core, at the initial values."""
        del effects, parameters
        return None

    def fit(
        self,
        free: Sequence[Hypothesis],
        start: FittedModel | None = None,
        *,
        robot_values: Mapping[str, float] | None = None,
        lazy: bool = False,
        near: _core.Courses | None = None,
        max_iterations: int = 15,
        refreshes: int = 0,
        fresh: bool = False,
        worth: float | None = None,
    ) -> FittedModel | Diverged:
        """Fit the simulator's own parameters and the effects ``free``.

        A free effect replaces the effect of the same label that the robot already has. The own parameters begin at
        ``robot_values``, else where ``start`` ended, else at their nominal values.

        - ``lazy``: own parameters take their sensitivities from ``start``. Else these are computed where the fit begins
          and ``refreshes`` times where it has settled; small changes of masses and stiffness hardly alter them.
        - ``fresh``: computes all sensitivities at every step, for effects that do alter them.
        - ``near``: `runs` of a similar model.
        - ``worth``: fall of the loss at which the fit ends, in place of a relative one.
        """
        # A candidate on one axis changes sensitivities of effects on other axes too little to renew them at once.
        here = free[-1].effect.axis if free else None
        held = [lazy and None not in (here, f.effect.axis) and f.effect.axis != here for f in free]
        setup = self._setup(free, start, robot_values, held, lazy=lazy, fresh=fresh)
        # Candidates, and the model that they are compared with, need less precision than formulas of one effect differ.
        tolerance = _TRIAL_TOLERANCE if lazy or not free else _TOLERANCE
        if worth is not None and start is not None:
            tolerance = worth / max(start.total, worth)
        options = self._options(max_iterations, refreshes, tolerance)
        renewed = not lazy and near is None
        return self._solved(setup, free, options, near, renewed=renewed)

    def _solved(
        self,
        setup: _Setup,
        free: Sequence[Hypothesis],
        options: FitOptions,
        near: _core.Courses | None,
        *,
        renewed: bool,
    ) -> FittedModel | Diverged:
        self.time_limit.check()
        result = self.solve(*self._for_core(setup), options, setup.warm, near)
        if isinstance(result, Diverged):
            return result
        self.work.fit(result.iterations, result.evaluations)
        found = _fitted_model(result, setup, list(free), renewed=renewed, counted=self.counted())
        if self.gears is None:
            return found
        return self._continued(
            found, self._gear_rows(found, setup, result.theta), setup, options, near
        )

    def _continued(
        self,
        found: FittedModel,
        rows: GearRows,
        setup: _Setup,
        options: FitOptions,
        near: _core.Courses | None,
    ) -> FittedModel:
        """Return a fit with the rows of gears, continued while they promise a gain: the core fits without them."""
        best = rows.added_to_fit(found)
        for _ in range(options.max_iterations):
            step = linear_step(best)
            if rows.fall(step) < options.loss_tolerance * best.total:
                break
            moved = _moved(setup, best, step)
            still = replace(options, max_iterations=0)
            result = self.solve(*self._for_core(moved), still, moved.warm, near)
            if isinstance(result, Diverged):
                break
            self.work.fit(1, result.evaluations)
            there = _fitted_model(
                result, moved, best.free, renewed=best.renewed, counted=self.counted()
            )
            next_rows = self._gear_rows(there, moved, result.theta)
            there = next_rows.added_to_fit(there)
            if not fit_loss(there) < fit_loss(best):
                break
            best, rows = replace(there, status=best.status), next_rows
        return best

    def _gear_rows(self, at: NormalEquations, setup: _Setup, theta: Array) -> GearRows:
        """Return the rows of gears at the values ``theta`` (n_parameters,) of all parameters of a fit."""
        assert self.gears is not None
        own: dict[str, float] = {}
        effects = list(setup.effects)
        steps: dict[tuple[int | None, str], float] = {}
        for p, value in zip(setup.parameters, theta.tolist(), strict=True):
            if p.effect is None:
                own[p.name] = value
            else:
                effects[p.effect] = effects[p.effect].with_values({p.name: value})
            up, down = p.upper - value, value - p.lower
            steps[p.effect, p.name] = min(p.scale, up) if up >= down else -min(p.scale, down)
        return gear_rows(self.gears, at.parameters, own, effects, [steps[n] for n in at.parameters])

    def evaluate(
        self,
        free: Sequence[Hypothesis],
        start: FittedModel | None = None,
        *,
        robot_values: Mapping[str, float] | None = None,
        near: _core.Courses | None = None,
    ) -> NormalEquations | Diverged:
        """Return the normal equations at the point where a lazy `fit` would begin."""
        setup = self._setup(free, start, robot_values, [True] * len(free), lazy=True)
        return self._evaluated(setup, near)

    def loss(
        self,
        free: Sequence[Hypothesis],
        start: FittedModel | None = None,
        *,
        robot_values: Mapping[str, float] | None = None,
        near: _core.Courses | None = None,
    ) -> float | Diverged:
        """Return the loss at the point where a `fit` would begin."""
        setup = self._setup(free, start, robot_values, [True] * len(free), lazy=True)
        fixed = [replace(p, frozen=True) for p in setup.parameters]
        found = self._evaluated(replace(setup, parameters=fixed, warm=[]), near)
        return found if isinstance(found, Diverged) else found.total

    def evaluate_each(
        self, options: Sequence[Hypothesis], start: FittedModel, near: _core.Courses | None = None
    ) -> list[NormalEquations] | Diverged:
        """Return the result of `evaluate` for each of several effects without influence at their start values.

        Such effects do not change one another, so one evaluation serves all. An effect that replaces an own parameter
        starts where ``start`` has that parameter, not at its nominal value.
        """
        free, n = [*start.free, *options], len(start.free)
        setup = self._setup(free, start, None, [True] * len(free), lazy=True, fixed_by=start.free)
        together = self._evaluated(setup, near)
        if isinstance(together, Diverged):
            return together
        return [
            together.without(n + i, among=range(n, len(free)), fixed=self.replaced([option]))
            for i, option in enumerate(options)
        ]

    def _evaluated(self, setup: _Setup, near: _core.Courses | None) -> NormalEquations | Diverged:
        self.time_limit.check()
        options = self._options()
        result = self.linearize(*self._for_core(setup), options, setup.warm, near)
        if isinstance(result, Diverged):
            return result
        self.work.linearization()
        found = replace(_linearized(result, setup), jacobian=tuple(result.columns))
        if self.gears is None:
            return found
        blocks = np.array(result.blocks, dtype=np.int64).reshape(-1, 4)
        return self._gear_rows(found, setup, result.theta).added(found, blocks[:, 0], blocks[:, 1])

    def lasting(self, option: Hypothesis) -> bool:
        """Whether the sensitivities of a candidate to this error are all in its columns, which later models reuse."""
        return self.gears is None or not any(
            self.gears.feels(name, option.effect) for name in option.free
        )

    def replaced(self, free: Sequence[Hypothesis]) -> set[str]:
        """Return the robot's parameters that the effects replace."""
        names = (_same_quantity(self.robot, f.effect) for f in free)
        return {name for name in names if name is not None}

    def _options(
        self, max_iterations: int = 0, refreshes: int = 0, tolerance: float = _TOLERANCE
    ) -> FitOptions:
        return FitOptions(
            max_iterations=max_iterations,
            loss_tolerance=tolerance,
            step_tolerance=self.step_tolerance,
            nuisance_refreshes=refreshes,
        )

    def _setup(
        self,
        free: Sequence[Hypothesis],
        start: FittedModel | None,
        robot_values: Mapping[str, float] | None,
        held: Sequence[bool],
        *,
        lazy: bool,
        fresh: bool = False,
        fixed_by: Sequence[Hypothesis] | None = None,
    ) -> _Setup:
        """Return the effects, parameters and reused sensitivities of a fit.

        ``held``: for each effect, whether it may reuse columns of ``start``; ``fixed_by``: the effects that fix the own
        parameters that they replace, by default all.
        """
        begin: Mapping[str, float] = {} if start is None else start.robot_values
        if robot_values is not None:
            begin = robot_values
        # An effect that the simulator already has is replaced by the hypothesis of the same label.
        tried = [f.effect for f in free]
        same = self.replaced(free if fixed_by is None else fixed_by)
        own = [
            replace(p, frozen=True)
            if p.name in same
            else replace(
                p,
                initial=min(max(begin.get(p.name, p.initial), p.lower), p.upper),
                nuisance=not fresh and (lazy or not self.bends(p.name)),
            )
            for p in self.own
        ]
        columns = start.columns if lazy and start is not None else {}
        known = (
            set()
            if start is None
            else {f for f, _ in columns} & {e.label for e in start.effects if e in tried}
        )
        added = []
        for i, f in enumerate(free):
            keep = held[i] and f.effect.label in known
            added += [
                replace(self._trial_parameter(tried, i, f, name), nuisance=keep) for name in f.free
            ]
        parameters = own + added
        keys: list[tuple[str | None, str]] = [(None, p.name) for p in own]
        keys += [
            (tried[p.effect].label if p.nuisance and p.effect is not None else "", p.name)
            for p in added
        ]
        warm = [(i, columns[key]) for i, key in enumerate(keys) if key in columns]
        return _Setup(tried, parameters, own, warm)

    def _trial_parameter(
        self, effects: Sequence[Effect], i: int, free: Hypothesis, name: str
    ) -> Parameter:
        parameter = effect_parameter(effects, i, name)
        lower, upper = free.limits(name)
        return replace(
            parameter,
            initial=min(max(parameter.initial, lower), upper),
            lower=lower,
            upper=upper,
            scale=parameter.scale if self.natural is None else self.natural.of(effects[i], name),
            prior=free.priors.get(name),
        )


def _kept_within(parameter: Parameter, tolerances: float) -> Parameter:
    if parameter.prior is None:
        return parameter
    mean, std = parameter.prior
    reach = tolerances * std
    lower, upper = max(parameter.lower, mean - reach), min(parameter.upper, mean + reach)
    return replace(parameter, lower=lower, upper=upper)


def _first_halves(model: FittedModel) -> list[tuple[int, int]]:
    """Return the rows (first, behind the last) of the residuals in the first half of each log and axis."""
    rows = []
    for log in np.unique(model.log):
        for axis in np.unique(model.axis):
            mine = (model.log == log) & (model.axis == axis)
            first = int(model.start[mine].min())
            rows.append((first, first + int(model.size[mine].sum()) // 2))
    return rows


def _is_relative(effect: str) -> bool:
    stands_for = effect_info(effect).stands_for
    return stands_for is not None and stands_for[1] == "relative"


def _same_quantity(robot: Robot, effect: Effect) -> str | None:
    """Return the own parameter that an effect replaces, which is then fixed; None if there is none."""
    stands_for = effect_info(effect.name).stands_for
    if effect.axis is None or stands_for is None:
        return None
    return robot.axis_parameter(effect.axis, stands_for[0])


def _names(setup: _Setup) -> list[tuple[int | None, str]]:
    return [(p.effect, p.name) for p in setup.parameters]


def _moved(setup: _Setup, found: FittedModel, step: Array) -> _Setup:
    """Return the setup of a fit with start values a step (n_free,) from where it ended, within the bounds."""
    by = dict(zip(found.parameters, step.tolist(), strict=True))
    parameters = []
    for p, key in zip(setup.parameters, _names(setup), strict=True):
        place, name = key
        values = found.robot_values if place is None else found.effects[place].parameters or {}
        at = values[name] + by.get(key, 0.0)
        parameters.append(replace(p, initial=min(max(at, p.lower), p.upper)))
    return replace(setup, parameters=parameters)


def _linearized(result: _core.FitResult | _core.Linearization, setup: _Setup) -> NormalEquations:
    every, columns = _names(setup), result.free
    used = [setup.parameters[i] for i in columns]
    precision = np.array([0.0 if p.prior is None else p.prior[1] ** -2 for p in used])
    mean = np.array([0.0 if p.prior is None else p.prior[0] for p in used])
    return NormalEquations(
        parameters=tuple(every[i] for i in columns),
        at_bound=tuple(every[i] for i in result.at_bound),
        matrix=result.block_matrix,
        gradient=result.block_gradient,
        loss=result.block_loss,
        prior_matrix=np.diag(precision),
        prior_gradient=precision * (result.theta[columns] - mean),
        room={
            every[i]: (p.lower - float(at), p.upper - float(at))
            for i, p, at in zip(columns, used, result.theta[columns], strict=True)
            if p.effect is not None
        },
    )


def _fitted_model(
    result: _core.FitResult,
    setup: _Setup,
    free: Sequence[Hypothesis],
    *,
    renewed: bool,
    counted: Array | None,
) -> FittedModel:
    at = _linearized(result, setup)
    values: list[dict[str, float]] = [dict(f.effect.parameters or {}) for f in free]
    for (place, name), value in zip(_names(setup), result.theta, strict=True):
        if place is not None:
            values[place][name] = float(value)
    fitted = tuple(f.effect.with_values(v) for f, v in zip(free, values, strict=True))
    blocks = np.array(result.blocks, dtype=np.int64).reshape(-1, 4)
    columns = result.columns
    std = _deviations(result, at)
    return FittedModel(
        parameters=at.parameters,
        at_bound=at.at_bound,
        matrix=at.matrix,
        gradient=at.gradient,
        loss=at.loss,
        prior_matrix=at.prior_matrix,
        prior_gradient=at.prior_gradient,
        room=at.room,
        effects=fitted,
        free=tuple(replace(f, effect=e) for f, e in zip(free, fitted, strict=True)),
        robot_values={p.name: float(result.theta[i]) for i, p in enumerate(setup.own)},
        std={n: float(s) for n, s in zip(at.parameters, std, strict=True)},
        status=result.status,
        renewed=renewed,
        up_to_date=result.up_to_date,
        condition=result.condition,
        log=blocks[:, 0],
        axis=blocks[:, 1],
        start=blocks[:, 2],
        size=blocks[:, 3],
        samples=_samples(blocks[:, 2], blocks[:, 3], counted),
        residual=result.residual,
        columns={
            (None if place is None else fitted[place].label, name): columns[i]
            for i, (place, name) in enumerate(at.parameters)
        },
    )


def _deviations(result: _core.FitResult, at: NormalEquations) -> Array:
    """Return the standard deviations (n_parameters,), infinite for parameters that the data do not determine."""
    variance = np.diag(result.sandwich)
    if np.isfinite(variance).all():
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)))
    # Such a parameter makes the normal equations singular.
    scatter = at.gradient.T @ at.gradient + at.prior_matrix
    return deviations_seen(at.matrix.sum(axis=0) + at.prior_matrix, scatter)


def _samples(start: NDArray[np.int64], size: NDArray[np.int64], counted: Array | None) -> Array:
    """Return the total weight of the residuals of every block (n_blocks,)."""
    if counted is None:
        return size.astype(np.float64)
    total = np.concatenate([[0.0], np.cumsum(counted)])
    return np.asarray(total[start + size] - total[start])
