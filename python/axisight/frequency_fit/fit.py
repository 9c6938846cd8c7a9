"""Fitting the linearized robot to measured frequency responses."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from axisight import _core
from axisight.effects import Effect, core_effects
from axisight.errors import InputError
from axisight.fitting import Parameter
from axisight.fitting.loads import with_loads
from axisight.frequency_fit.measured import MeasuredResponse, measured, model_response
from axisight.frequency_fit.options import FrequencyFitOptions, core_options
from axisight.frequency_fit.parameters import Spec, specs
from axisight.frequency_fit.planned import of_search
from axisight.frequency_fit.result import (
    NORMAL_95,
    FrequencyFit,
    covariances,
    warn,
)
from axisight.frequency_fit.trust import trust
from axisight.identifiability import identifiability
from axisight.robot import Robot
from axisight.statistics.starts import StartRange, drawn_start

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

__all__ = ["FrequencyFitOptions", "fit_responses"]


def fit_responses(
    robot: Robot,
    responses: Sequence[MeasuredResponse | tuple[ArrayLike, xr.Dataset | xr.DataArray]],
    parameters: Sequence[str | Parameter] | Mapping[str, float],
    *,
    effects: Sequence[Effect] = (),
    options: FrequencyFitOptions | None = None,
) -> FrequencyFit:
    """Fit parameters of the linearized robot to responses at several operating points.

    Source: Wernholt (2004), (3.42) to (3.44). The robot is linearized at the equilibrium of its
    elastic joints under gravity, at every operating point. The gradient is exact and includes the
    dependence of the equilibrium on the parameters.

    robot
        The model; parameters that are not fitted keep their values.
    responses
        :class:`MeasuredResponse`, or pairs of the angles of the driven joints [rad] and the response
        from an estimator of `axisight.frf` (a Dataset, or a DataArray with units). The response is
        from torque to position, velocity or acceleration of the motors, according to its units.
    parameters to fit
        Names (starting at the robot's values), a dict of names and starts, or
        :class:`axisight.Parameter` with bounds and priors. Names are those of
        :func:`axisight.robot_parameters`. The search is over logarithms, except for centres of mass,
        and within a factor of 100 unless bounds are given.
    effects
        Effects that leave the robot linear: payload, joint_stiffness, joint_damping, motor_inertia.
        A response with a ``load`` has its own payload. Effects replace the robot's own effects of the
        same name and axis; its other effects act too.
    options
        See :class:`FrequencyFitOptions`.

    A weighted criterion needs the variance of every response. Residuals are model minus
    measurement, whitened. Non-convergence is a status, and warnings name combinations that the data
    do not determine. Raises InputError for misuse.
    """
    chosen = options or FrequencyFitOptions()
    wanted = specs(robot, parameters)
    if isinstance(responses, xr.Dataset | xr.DataArray | MeasuredResponse | str):
        raise InputError("responses: expected a list, got one; put it into a list")
    data = [measured(item, robot, chosen.sampling) for item in responses]
    if not data:
        raise InputError("responses: expected at least one operating point, got none")
    if chosen.weighted:
        for i, one in enumerate(data, 1):
            if one.variance is None and one.covariance is None:
                raise InputError(
                    f"response {i}: expected a variance or covariance for the criterion "
                    f"{chosen.criterion}, got none; average several periods or realizations, or "
                    "use least_squares or log_least_squares"
                )
    if chosen.neighbours and all(one.degrees_of_freedom is None for one in data):
        raise InputError(
            f"neighbours: expected responses with degrees_of_freedom to pool the variance of "
            f"{chosen.neighbours} lines, got none that tells"
        )
    chosen = replace(chosen, block_lines=_block_lines(chosen, wanted, data))
    nothing: list[Complex | None] = [None] * len(data)
    every, own = with_loads(robot, robot.placed(effects), [one.load for one in data])
    weighing = _weighing(data, chosen, nothing)

    def search(
        start: Sequence[Spec], reference: Sequence[Complex | None], weighing: Sequence[Real | None]
    ) -> _core.FrequencyFitResult:
        return _core.fit_frequency_responses(
            robot.core,
            core_effects(every),
            list(start),
            [
                one.core(g, w, values)
                for one, g, w, values in zip(data, reference, weighing, own, strict=True)
            ],
            core_options(chosen),
        )

    results = _from_starts(wanted, chosen, lambda start: search(start, nothing, weighing))
    result = results[0]
    passes = [result]
    pooled = any(weights is not None for weights in weighing)
    renewed = chosen.weighted and (chosen.logarithmic or pooled)
    for _ in range(chosen.reweightings if renewed else 0):
        fitted = _with_values(robot, wanted, result.values)
        reference = [_modelled(fitted, one, chosen, effects) for one in data]
        weighing = _weighing(data, chosen, reference)
        start = [
            replace(s, initial=float(np.clip(v, s.lower, s.upper)))
            for s, v in zip(wanted, result.values, strict=True)
        ]
        result = search(start, reference if chosen.logarithmic else nothing, weighing)
        passes.append(result)
    return _wrap(robot, wanted, data, weighing, chosen, passes, _table(results))


def _weighing(
    data: Sequence[MeasuredResponse],
    options: FrequencyFitOptions,
    reference: Sequence[Complex | None],
) -> list[Real | None]:
    if not options.weighted:
        return [None] * len(data)
    return [one.pooled(options.neighbours, g) for one, g in zip(data, reference, strict=True)]


def _modelled(
    robot: Robot,
    measured: MeasuredResponse,
    options: FrequencyFitOptions,
    effects: Sequence[Effect],
) -> Complex:
    if measured.load is not None:
        effects = [*effects, Effect("payload", None, measured.load.parameters)]
    found: Complex = model_response(
        robot,
        measured.frequency_hz,
        measured.joint_angle_rad,
        quantity=measured.quantity,
        sampling=options.sampling,
        effects=effects,
    ).values
    return found


BLOCKS_PER_PARAMETER = 5
"""Fewer blocks of residuals leave the sandwich covariance without degrees of freedom."""


def _block_lines(
    options: FrequencyFitOptions, wanted: Sequence[Spec], data: Sequence[MeasuredResponse]
) -> int:
    """Return the chosen block length, or a shorter one that leaves enough blocks."""
    lines = sum(len(one.frequency_hz) for one in data)
    blocks = BLOCKS_PER_PARAMETER * sum(not spec.frozen for spec in wanted)
    return max(1, min(options.block_lines, lines // blocks))


def _from_starts(
    wanted: Sequence[Spec],
    options: FrequencyFitOptions,
    search: Callable[[Sequence[Spec]], _core.FrequencyFitResult],
) -> list[_core.FrequencyFitResult]:
    """Return the searches from all starting points, best first, without starts where the model fails."""
    found = [search(wanted)]
    ranges = [_range(spec, options.start_spread) for spec in wanted]
    for number in range(1, options.starts):
        drawn = drawn_start([s.initial for s in wanted], ranges, options.seed, number)
        start = [replace(s, initial=x) for s, x in zip(wanted, drawn, strict=True)]
        try:
            found.append(search(start))
        except InputError:
            # The first start worked, so the data are valid: the arm has no equilibrium at this start.
            continue
    return sorted(found, key=lambda r: r.loss)


def _range(spec: Spec, spread: float) -> StartRange | None:
    """Return the range of random starts, about the initial value; None for a frozen parameter."""
    if spec.frozen:
        return None
    bounds = (spec.lower, spec.upper)
    if spec.logarithmic:
        return StartRange(spec.initial / (1 + spread), spec.initial * (1 + spread), True, bounds)
    reach = spread * max(abs(spec.initial), 0.1)
    return StartRange(spec.initial - reach, spec.initial + reach, False, bounds)


def _table(results: Sequence[_core.FrequencyFitResult]) -> pd.DataFrame:
    return pd.DataFrame(
        {
            "loss": [r.loss for r in results],
            "status": [r.status for r in results],
            "iterations": [r.iterations for r in results],
        }
    )


def _with_values(robot: Robot, wanted: Sequence[Spec], values: Real) -> Robot:
    return robot.with_parameters({s.name: float(v) for s, v in zip(wanted, values, strict=True)})


def _wrap(
    robot: Robot,
    wanted: Sequence[Spec],
    data: Sequence[MeasuredResponse],
    weighing: Sequence[Real | None],
    options: FrequencyFitOptions,
    passes: Sequence[_core.FrequencyFitResult],
    starts: pd.DataFrame,
) -> FrequencyFit:
    result = passes[-1]
    free = [wanted[i] for i in result.free]
    prior = np.array([_prior_information(spec) for spec in free])
    blocks = sum(-(-len(one.frequency_hz) // options.block_lines) for one in data)
    found = covariances(result, prior, blocks)
    doubt = trust(data, weighing, result.residual, found.misfit, weighted=options.weighted)
    sandwich = options.uncertainty == "sandwich" or (
        options.uncertainty == "auto" and (not doubt.holds or options.loss != "squared")
    )
    response = found.response * doubt.inflation
    own = found.sandwich if sandwich else response
    scale = 1.0 if options.weighted else found.misfit
    names = tuple(spec.name for spec in free)
    matrix = result.information / scale
    identifiable = identifiability(of_search(wanted, matrix, result.values[result.free]))
    at_bound = tuple(wanted[i].name for i in result.at_bound)
    slopes, values = result.slopes, result.values[result.free]
    with np.errstate(invalid="ignore"):
        spread = np.sqrt(np.diag(own))
        correlation = own / np.outer(spread, spread)
    return FrequencyFit(
        names=names,
        values=values,
        std=slopes * spread,
        interval=_interval(free, values, spread),
        covariance=own * np.outer(slopes, slopes),
        correlation=correlation,
        std_response=slopes * np.sqrt(np.diag(response)),
        std_sandwich=slopes * np.sqrt(np.diag(found.sandwich)),
        std_from="sandwich" if sandwich else "response",
        status=result.status,
        misfit=found.misfit,
        loss=result.loss,
        initial_loss=passes[0].initial_loss,
        n_residuals=result.n_residuals,
        iterations=sum(one.iterations for one in passes),
        evaluations=sum(one.evaluations for one in passes),
        at_bound=at_bound,
        identifiability=identifiable,
        information=matrix,
        warnings=warn(
            result,
            identifiable,
            at_bound,
            doubt=doubt,
            dropped=sum(one.dropped_lines for one in data),
            sandwich=sandwich,
        ),
        starts=starts,
        robot=_with_values(robot, wanted, result.values),
        core=result,
    )


def _prior_information(spec: Spec) -> float:
    if spec.prior is None:
        return 0.0
    mean, std = spec.prior
    return float((mean / std) ** 2 if spec.logarithmic else 1 / std**2)


def _interval(free: Sequence[Spec], values: Real, spread: Real) -> Real:
    logarithmic = np.array([spec.logarithmic for spec in free])
    reach = NORMAL_95 * spread
    with np.errstate(over="ignore"):
        lower = np.where(logarithmic, values * np.exp(-reach), values - reach)
        upper = np.where(logarithmic, values * np.exp(reach), values + reach)
    return np.stack([lower, upper], axis=1)
