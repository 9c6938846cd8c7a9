"""Refuse impossible effects, contradictions and wrong covariances in robot files and sidecars."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight.effects import Effect, effect_info
from axisight.errors import InputError, RobotError

Array = NDArray[np.float64]

# Rounding may make the least eigenvalue of a correlation matrix negative by this share of the largest one,
# also if the covariance was transformed.
ROUNDING = 1e-6


def check_effects(effects: Iterable[Effect], n_axes: int) -> None:
    """Raise an error unless a robot of ``n_axes`` axes can have these effects.

    This is InputError for axes that the robot or the effect does not have, and RobotError for parameters
    outside the bounds in the table of effects (such as negative Coulomb friction).
    """
    for effect in effects:
        info = effect_info(effect.name)
        if info.scope == "arm" and effect.axis is not None:
            raise InputError(
                f"effects: {effect.label}: expected no axis, it acts on the whole arm, got axis "
                f"{effect.axis}"
            )
        if info.scope == "axis" and not 1 <= (effect.axis or 0) <= n_axes:
            got = "none" if effect.axis is None else str(effect.axis)
            raise InputError(
                f"effects: {effect.label}: expected an axis from 1 to {n_axes}, got {got}"
            )
        if info.scope == "axes" and max(effect.axes or (n_axes + 1,)) > n_axes:
            got = "none" if effect.axes is None else str(effect.axes)
            raise InputError(
                f"effects: {effect.label}: expected two axes from 1 to {n_axes}, got {got}"
            )
        given = effect.parameters or {}
        for p in info.parameters:
            value = given.get(p.name, p.neutral)
            # Not `value < lower or value > upper`, which accepts NaN.
            if not p.lower <= value <= p.upper:
                raise RobotError(
                    f"effects: {effect.label}.{p.name}: expected {p.lower:g} to {p.upper:g} "
                    f"{p.unit}, got {value!r}"
                )


def check_agreement(names: Sequence[str], values: Array, effects: Iterable[Effect]) -> None:
    """Raise InputError, naming the first, if values differ from the parameters of the effects themselves."""
    found = dict(zip(names, values.tolist(), strict=True))
    for effect in effects:
        given = effect.parameters or {}
        for p in effect_info(effect.name).parameters:
            name = f"{effect.label}.{p.name}"
            own = given.get(p.name, p.neutral)
            if name in found and not math.isclose(found[name], own, rel_tol=1e-12):
                raise InputError(
                    f"{name}: expected {own!r} as the effect in effects has it, got {found[name]!r}"
                )


def checked_covariance(value: ArrayLike, n: int) -> Array:
    """Return a covariance (n, n); raise InputError unless it is symmetric and positive semidefinite."""
    matrix = np.asarray(value, np.float64)
    if matrix.shape != (n, n) or not np.isfinite(matrix).all():
        raise InputError(
            f"covariance: expected finite numbers, shape ({n}, {n}), got {matrix.shape}"
        )
    variance = np.diag(matrix)
    size = np.sqrt(np.abs(np.outer(variance, variance)))
    if np.any(np.abs(matrix - matrix.T) > 1e-9 * size) or np.any(variance < 0):
        raise InputError("covariance: expected a symmetric matrix of non-negative variances")
    deviation = np.sqrt(np.where(variance > 0, variance, 1.0))
    eigenvalues = np.linalg.eigvalsh(matrix / np.outer(deviation, deviation)) if n else np.zeros(1)
    if eigenvalues[0] < -ROUNDING * max(eigenvalues[-1], 1.0):
        raise InputError(
            "covariance: expected a positive semidefinite matrix, got a correlation matrix with "
            f"eigenvalue {eigenvalues[0]:.3g}"
        )
    return matrix
