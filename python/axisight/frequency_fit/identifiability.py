"""Which combinations of parameters data does not determine, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from axisight import _core
from axisight.effects import Effect, core_effects
from axisight.errors import InputError
from axisight.fitting import Parameter
from axisight.frequency_fit.measured import (
    MeasuredResponse,
    PoseTuple,
    Quantity,
    Sampling,
    check_sampling,
    model_response,
)
from axisight.frequency_fit.options import FrequencyFitOptions, core_options
from axisight.frequency_fit.parameters import Spec, specs
from axisight.robot import Robot

Real = NDArray[np.float64]

UNKNOWN_BEYOND = 0.5
"""A relative standard deviation from which on a combination counts as not identified."""
NOTHING_BEYOND = 3.0
"""A relative standard deviation, a factor of twenty, that counts as knowing nothing."""
NUMERICAL_RANK = 1e-13
"""Eigenvalues of information, scaled to unit diagonal, below this share of the largest are zero."""
SHOWN = 0.1
"""Parameters with at least this share of the largest exponent are named."""


@dataclass(frozen=True)
class Combination:
    """A product of powers of parameters, and how well it is known.

    ``exponents`` by name, the largest one; ``std`` is the standard deviation of the logarithm
    of the product, that is relative; infinite if nothing is known.
    """

    exponents: dict[str, float]
    std: float

    def __str__(self) -> str:
        """In words."""
        names = list(self.exponents)
        size = "not at all" if self.std > NOTHING_BEYOND else f"to {100 * self.std:.0f} % only"
        if len(names) == 1:
            return f"{names[0]} is determined {size}"
        powers = " · ".join(
            name if abs(power - 1) < 0.005 else f"{name}^{power:.2f}"
            for name, power in self.exponents.items()
        )
        return f"the combination {powers} is determined {size}: its parameters trade off"


@dataclass(frozen=True)
class Identifiability:
    """What an experiment tells of parameters, before it is done.

    names
        Free parameters.
    relative_std
        Standard deviation each would have, relative to its value (absolute in metres for
        centres of mass), (n_parameters,); infinite where the information is singular.
    correlation
        (n_parameters, n_parameters).
    condition
        Condition number of the information, scaled to unit diagonal.
    unidentified
        Combinations not determined to better than half their value.
    information
        Of the searched numbers: logarithms, except for centres of mass [m].
    """

    names: tuple[str, ...]
    relative_std: Real
    correlation: Real
    condition: float
    unidentified: tuple[Combination, ...]
    information: Real

    def table(self) -> pd.DataFrame:
        """Return names and relative standard deviations, worst first."""
        found = pd.DataFrame({"parameter": self.names, "relative_std": self.relative_std})
        return found.sort_values("relative_std", ascending=False, ignore_index=True)

    def advice(self) -> tuple[str, ...]:
        """Return a sentence for each combination that is not determined."""
        return advice(self.unidentified)


def advice(unidentified: Sequence[Combination]) -> tuple[str, ...]:
    """Return a sentence for each combination that is not determined."""
    return tuple(
        f"{combination}; freeze one of {', '.join(combination.exponents)}, give it a prior, or "
        "add lines and operating points that tell them apart (see choose_poses)"
        if len(combination.exponents) > 1
        else f"{combination}; freeze it, give it a prior, or add lines and operating points "
        "where it matters (see choose_poses)"
        for combination in unidentified
    )


def identifiability(
    robot: Robot,
    parameters: Sequence[str | Parameter] | Mapping[str, float],
    operating_points_rad: ArrayLike,
    frequency_hz: ArrayLike,
    *,
    relative_std: ArrayLike = 0.1,
    quantity: Quantity = "acceleration",
    sampling: Sampling = "zero_order_hold",
    effects: Sequence[Effect] = (),
) -> Identifiability:
    """Return what responses at some operating points would tell of parameters.

    robot, parameters, effects, sampling
        As for :func:`fit_responses`; the model is taken at the starts of the parameters.
    operating_points_rad
        Driven joints [rad], (n_points, n_axes).
    frequency_hz
        Lines [Hz], (n_freq,).
    relative_std
        Standard deviation expected of the response relative to its magnitude: a number or an
        array that broadcasts to (n_points, n_freq, n_outputs, n_inputs), for example from
        :func:`axisight.frf.predict_errors`.
    quantity
        What the responses will be of; without influence while errors are relative.

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
    return assess(chosen, matrices.sum(axis=0))


def assess(chosen: Sequence[Spec], information: Real, scale: float = 1.0) -> Identifiability:
    """Assess an information matrix; ``scale`` is the variance of a residual."""
    names = tuple(spec.name for spec in chosen if not spec.frozen)
    size = np.sqrt(np.diag(information))
    unit = information / np.outer(np.where(size > 0, size, 1.0), np.where(size > 0, size, 1.0))
    values, vectors = np.linalg.eigh(unit)
    singular = values <= NUMERICAL_RANK * values[-1]
    condition = np.inf if singular.any() else float(values[-1] / values[0])
    combinations = []
    std = np.full(len(names), np.inf)
    correlation = np.full(information.shape, np.nan)
    if not singular.any():
        covariance = (vectors / values) @ vectors.T / np.outer(size, size) * scale
        std = np.sqrt(np.diag(covariance))
        correlation = covariance / np.outer(std, std)
        spread, directions = np.linalg.eigh(covariance)
        for s, direction in zip(spread[::-1], directions.T[::-1], strict=True):
            if np.sqrt(s) > UNKNOWN_BEYOND:
                combinations.append(_combination(names, direction, float(np.sqrt(s))))
    else:
        # A parameter without influence is its own direction, whatever its scale.
        natural = (
            vectors[:, singular]
            / np.where(size > 0, size, size[size > 0].min(initial=1.0))[:, None]
        )
        for direction in _sparse(natural):
            combinations.append(_combination(names, direction, np.inf))
    return Identifiability(
        names, std, correlation, condition, tuple(combinations), np.asarray(information)
    )


def _sparse(directions: Real) -> Real:
    """Return directions (n_directions, n) of the same span, each with a parameter of its own."""
    rows = directions.T.copy()
    for row in range(len(rows)):
        rest = np.abs(rows[row:])
        best, pivot = divmod(int(np.argmax(rest)), rest.shape[1])
        rows[[row, row + best]] = rows[[row + best, row]]
        rows[row] /= rows[row, pivot]
        for other in range(len(rows)):
            if other != row:
                rows[other] -= rows[other, pivot] * rows[row]
    return rows


def _combination(names: Sequence[str], direction: Real, std: float) -> Combination:
    power = direction / direction[np.argmax(np.abs(direction))]
    order = np.argsort(-np.abs(power), kind="stable")
    shown = [i for i in order if abs(power[i]) >= SHOWN]
    return Combination({names[i]: float(power[i]) for i in shown}, std)


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
    model = Robot(robot.core.with_parameters([(s.name, s.initial) for s in chosen]), robot.effects)
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
        core_effects([*robot.effects, *effects]),
        list(chosen),
        poses,
        core_options(options),
    )
