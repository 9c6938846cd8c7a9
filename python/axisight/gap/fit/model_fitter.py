"""A model under trial: the robot's own parameters, effects, and the fit of both to logs."""

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
from axisight.gap.fit.rank_deficiency import deviations_seen
from axisight.gap.fit.work_count import WorkCount
from axisight.gap.simulator.natural_sizes import NaturalSizes
from axisight.gap.simulator.own_parameters import for_core
from axisight.gap.simulator.tolerances import spring_changes, tolerance_of
from axisight.robot import Robot

Array = NDArray[np.float64]


# Share of the loss that another step of a fit has to be worth.
_TOLERANCE = 1e-4
_TRIAL_TOLERANCE = 1e-3


@dataclass(frozen=True)
class _Setup:
    """What one fit is made of."""

    effects: list[Effect]
    parameters: list[Parameter]
    own: list[Parameter]
    warm: list[tuple[int, _core.Column]]


class ModelFitter(ABC):
    """Fits models to one set of logs; subclasses say by which error.

    A model that cannot be simulated is an answer, `Diverged`; misuse raises InputError.
    ``adds_up``: effects of an axis add up in the error, and hide one another where several are
    missing: they are tried in pairs too.
    """

    adds_up = False

    def __init__(
        self, robot: Robot, weighting: Weighting, tolerances: Mapping[str, float], block_s: float
    ) -> None:
        self.robot = robot
        self.weighting = weighting
        self.block_s = block_s
        self.cancel = _core.CancelToken()
        # One count for a fitter and all that are made of it.
        self.work = WorkCount()
        self.tolerances = tolerances
        self.natural: NaturalSizes | None = None
        self.own = [
            robot_parameter(robot, name, relative_tolerance=tolerance)
            for name, value in robot_parameters(robot).items()
            if (tolerance := tolerance_of(tolerances, name)) is not None
            # What the simulator leaves out has no tolerance: it would be an effect.
            and value != 0
            and self.takes_part(name)
        ]

    def within_tolerance(self, effect: Effect) -> bool:
        """Whether an effect is no more than ordinary scatter of a parameter."""
        if springs := spring_changes(effect):
            return max(map(abs, springs)) < self.tolerated(effect)
        change = effect.values()[0]
        for own in self.robot.effects:
            if own.label == effect.label:
                change -= own.values()[0]
        return abs(change) < self.tolerated(effect)

    def tolerated(self, effect: Effect) -> float:
        """Return up to which size an effect is ordinary scatter of a parameter (three deviations)."""
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
        """Whether a robot parameter matters to this error."""
        return bool(name)

    def bends(self, name: str) -> bool:
        """Whether a parameter of the simulator changes what others do too much to keep their sensitivities."""
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
        """Run the fit in the core, around the runs ``near`` if there are any."""

    @abstractmethod
    def linearize(
        self,
        effects: Sequence[Effect],
        parameters: Sequence[Parameter],
        options: FitOptions,
        warm: list[tuple[int, _core.Column]],
        near: _core.Courses | None,
    ) -> _core.Linearization | Diverged:
        """Evaluate the model in the core, at the initial values."""

    def part(self, logs: Sequence[int]) -> ModelFitter:
        """Return the same for some of the logs, by their numbers; one is cancelled with the other."""
        other = copy(self)
        other._keep(logs)
        return other

    def within(self, tolerances: float) -> ModelFitter:
        """Return the same with the simulator's own parameters kept within so many of their tolerances."""
        other = copy(self)
        other.own = [_kept_within(p, tolerances) for p in self.own]
        return other

    def beginnings(self) -> ModelFitter | None:
        """Return the same for the first halves of the logs; None where only the whole will do."""
        return None

    def begun(self, model: FittedModel) -> tuple[ModelFitter, FittedModel] | None:
        """Return the same for the first halves of the logs, with a model as it is; None to take the whole.

        Its sensitivities are those of the whole, cut: weights smear little over the end.
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
        # The very same values: fits of what this model screens begin at those of the whole.
        same = replace(found, robot_values=model.robot_values, log=np.unique(model.log)[found.log])
        return other, same

    def counted(self) -> Array | None:
        """Return what every residual counts for (n_residuals,), from 0 to 1; None where all are one."""
        return None

    def tempered(self, factor: Array) -> ModelFitter:
        """Return the same with the errors of every axis times a factor (n_axes,)."""
        del factor
        return self

    @abstractmethod
    def _keep(self, logs: Sequence[int]) -> None:
        """Keep only some of the logs, by their numbers."""

    def runs(
        self, model: FittedModel, robot_values: Mapping[str, float] | None = None
    ) -> _core.Courses | Diverged | None:
        """Return runs of a model around which others close to it cost less; None without any.

        ``robot_values``: the simulator's own parameters, where they are not the model's.
        """
        held = [False] * len(model.free)
        setup = self._setup(model.free, model, robot_values, held, lazy=False)
        return self.run(*self._for_core(setup))

    def _for_core(self, setup: _Setup) -> tuple[list[Effect], list[Parameter]]:
        return for_core(self.robot, setup.effects, setup.parameters)

    def run(
        self, effects: Sequence[Effect], parameters: Sequence[Parameter]
    ) -> _core.Courses | Diverged | None:
        """Run the model in the core, at the initial values."""
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

        An effect that the robot has itself is replaced by the free one of its label.
        The simulator's parameters begin at ``robot_values``, else where
        ``start`` ended, else at their nominal values; ``lazy`` takes their
        sensitivities from ``start``; else they are computed where the fit begins, and
        ``refreshes`` times anew where it has settled: small changes of masses and stiffness
        hardly bend them. ``fresh`` computes them at every step, for effects that do bend them.
        ``near`` are `runs` of a model close by. ``worth`` is the loss that another step has to
        bring, where it is not a share of it.
        """
        # What a candidate changes of the sensitivities of effects elsewhere can wait.
        here = free[-1].effect.axis if free else None
        held = [lazy and None not in (here, f.effect.axis) and f.effect.axis != here for f in free]
        setup = self._setup(free, start, robot_values, held, lazy=lazy, fresh=fresh)
        # What is to be compared with others is fitted to less than the formulas agree; so is what
        # others are to be compared with.
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
        result = self.solve(*self._for_core(setup), options, setup.warm, near)
        if isinstance(result, Diverged):
            return result
        self.work.fit(result.iterations, result.evaluations)
        return _fitted_model(result, setup, list(free), renewed=renewed, counted=self.counted())

    def evaluate(
        self,
        free: Sequence[Hypothesis],
        start: FittedModel | None = None,
        *,
        robot_values: Mapping[str, float] | None = None,
        near: _core.Courses | None = None,
    ) -> NormalEquations | Diverged:
        """Return the model where a lazy `fit` would begin."""
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
        """Return the loss where a `fit` would begin."""
        setup = self._setup(free, start, robot_values, [True] * len(free), lazy=True)
        fixed = [replace(p, frozen=True) for p in setup.parameters]
        found = self._evaluated(replace(setup, parameters=fixed, warm=[]), near)
        return found if isinstance(found, Diverged) else found.total

    def evaluate_each(
        self, options: Sequence[Hypothesis], start: FittedModel, near: _core.Courses | None = None
    ) -> list[NormalEquations] | Diverged:
        """Return what `evaluate` would for each of several effects that do nothing as they are.

        They do not disturb one another: one evaluation serves all. One that stands in for a
        parameter of the simulator finds it where ``start`` has it, not at its nominal value.
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
        options = self._options()
        result = self.linearize(*self._for_core(setup), options, setup.warm, near)
        if isinstance(result, Diverged):
            return result
        self.work.linearization()
        return replace(_linearized(result, setup), jacobian=tuple(result.columns))

    def replaced(self, free: Sequence[Hypothesis]) -> set[str]:
        """Return the robot's parameters that effects stand in for."""
        names = (_same_quantity(self.robot, f.effect) for f in free)
        return {name for name in names if name is not None}

    def _options(
        self, max_iterations: int = 0, refreshes: int = 0, tolerance: float = _TOLERANCE
    ) -> FitOptions:
        return FitOptions(
            max_iterations=max_iterations,
            loss_tolerance=tolerance,
            step_tolerance=1e-4,
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
        """Return parameters and warm columns.

        ``held``: effects whose columns ``start`` may have; ``fixed_by``: effects, all unless
        given, that hold the robot's parameters they stand in for at their values.
        """
        begin: Mapping[str, float] = {} if start is None else start.robot_values
        if robot_values is not None:
            begin = robot_values
        # One that the simulator has itself is tried with other values: it takes its place.
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
    """Return the rows (first, behind the last) of the residual that belong to first halves of logs."""
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
    """Return the robot parameter that an effect stands in for: it is then held at its value."""
    stands_for = effect_info(effect.name).stands_for
    if effect.axis is None or stands_for is None:
        return None
    return robot.axis_parameter(effect.axis, stands_for[0])


def _names(setup: _Setup) -> list[tuple[int | None, str]]:
    return [(p.effect, p.name) for p in setup.parameters]


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
    """Return the standard deviations (n_parameters,), infinite where the data do not show a parameter."""
    variance = np.diag(result.sandwich)
    if np.isfinite(variance).all():
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)))
    # One that they do not show leaves the normal equations without an inverse.
    scatter = at.gradient.T @ at.gradient + at.prior_matrix
    return deviations_seen(at.matrix.sum(axis=0) + at.prior_matrix, scatter)


def _samples(start: NDArray[np.int64], size: NDArray[np.int64], counted: Array | None) -> Array:
    """Return what the residuals of every block count for in all (n_blocks,)."""
    if counted is None:
        return size.astype(np.float64)
    total = np.concatenate([[0.0], np.cumsum(counted)])
    return np.asarray(total[start + size] - total[start])
