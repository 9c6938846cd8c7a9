"""Held-out losses and linear steps of fitted models, from the normal equations of their data blocks."""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from axisight.effects import effect_info
from axisight.fitting import PRIOR_REACH
from axisight.gap.fit.fitted_model import FittedModel, NormalEquations

Array = NDArray[np.float64]


def held_out_loss(fitted: FittedModel, like: FittedModel | None = None) -> Array:
    """Return the loss of every block (n_blocks,) predicted without its own log.

    Each log in turn is left out. The parameters are re-estimated on the others by one Gauss-Newton step from the common
    fit, which is exact for linear parameters, and the blocks of the log are scored. The blocks of a single log are left
    out in five interleaved groups.

    A log that alone determines an effect is left out in stretches of time: the other logs would only fit noise. A model
    that is compared with a fit ``like`` of the same data uses the groups of ``like``.
    """
    kept = _KEPT.setdefault(fitted, WeakKeyDictionary())
    like = fitted if like is None else like
    known = kept.get(like)
    if known is None:
        known = kept[like] = _held_out_loss(fitted, _groups(like))
    return known


# Cache of held-out losses, by model and by the model whose groups were used; the search asks for them repeatedly.
_KEPT: WeakKeyDictionary[FittedModel, WeakKeyDictionary[FittedModel, Array]] = WeakKeyDictionary()


def _held_out_loss(fitted: FittedModel, groups: NDArray[np.int64]) -> Array:
    """Return the loss of every block (n_blocks,) predicted without its group, as a read-only array."""
    out = np.zeros(len(fitted.loss))
    steps = straight_steps_without_each(fitted, groups)
    for group, step in zip(np.unique(groups), steps, strict=True):
        inside = groups == group
        out[inside] = predicted_loss(fitted, inside, step)
    out.flags.writeable = False
    return out


# Share of the information of all logs on an effect's parameter from which one log counts as its only source.
_ALONE = 0.9
# Stretches of time in which such a log is left out.
_STRETCHES = 4
# Interleaved groups of a single log.
_INTERLEAVED = 5


def _groups(fitted: FittedModel) -> NDArray[np.int64]:
    """Return the number of the group (n_blocks,) with which each block is left out."""
    logs, number = np.unique(fitted.log, return_inverse=True)
    if len(logs) == 1:
        return np.arange(len(number)) % _INTERLEAVED
    groups = number * _STRETCHES
    for log in _only_sources(fitted, number):
        for axis in np.unique(fitted.axis):
            # The blocks of one axis of a log are in the order of time.
            here = np.flatnonzero((number == log) & (fitted.axis == axis))
            groups[here] += np.arange(len(here)) * _STRETCHES // len(here)
    return groups


def _only_sources(fitted: FittedModel, number: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the numbers of the logs that hold nearly all information on every parameter of the effects.

    Every parameter, so that a law with one number more is scored in the same groups as the simpler law.
    """
    effects = [i for i, (place, _) in enumerate(fitted.parameters) if place is not None]
    told = np.einsum("bii->bi", fitted.matrix)[:, effects]
    by_log = np.array([told[number == k].sum(axis=0) for k in range(number.max() + 1)])
    every = (by_log > _ALONE * by_log.sum(axis=0)).all(axis=1)
    return np.flatnonzero(every) if effects else np.zeros(0, dtype=np.int64)


def steps_without_each(fitted: FittedModel, groups: NDArray[np.int64]) -> Array:
    """Return the steps of the parameters (n_groups, n_parameters) in re-fits without one group each, to first order.

    ``groups`` (n_blocks,): the group of each block; rows are in the order of their numbers.
    """
    kept = _STEPS.setdefault(fitted, {})
    key = groups.tobytes()
    if key not in kept:
        anywhere = np.full(len(fitted.parameters), np.inf)
        kept[key] = _steps_without_each(fitted, groups, anywhere, anywhere)
    return kept[key]


# Cache of these steps, by model and groups: every rule that asks how sure a number is needs them.
_STEPS: WeakKeyDictionary[FittedModel, dict[bytes, Array]] = WeakKeyDictionary()


def straight_steps_without_each(fitted: FittedModel, groups: NDArray[np.int64]) -> Array:
    """Return the steps of `steps_without_each`, limited to where losses are predictable to second order.

    - A parameter that shapes a law moves by at most a tenth of its value; the others follow to their best values.
    - No parameter moves by more than the largest value of its effect in the same unit.
    """
    reach, size = np.full((2, len(fitted.parameters)), np.inf)
    columns = {name: column for column, name in enumerate(fitted.parameters)}
    for place, effect in enumerate(fitted.effects):
        table = effect_info(effect.name).parameters
        values = dict(zip((p.name for p in table), effect.values(), strict=True))
        for p in table:
            column = columns.get((place, p.name))
            if column is None:
                continue
            if p.role == "shape":
                reach[column] = _STRAIGHT * abs(values[p.name])
            # If all values of a unit are zero, there is no size to limit the step.
            size[column] = max(abs(values[q.name]) for q in table if q.unit == p.unit) or np.inf
    return _steps_without_each(fitted, groups, reach, size)


# Relative change of a shape parameter over which the law is about linear in it. For a wave over one turn of the angle,
# 0.1 of its order shifts the phase by 0.6 rad.
_STRAIGHT = 0.1


def _steps_without_each(
    fitted: FittedModel, groups: NDArray[np.int64], reach: Array, size: Array
) -> Array:
    """Return the steps (n_groups, n_parameters) without each group, within ``reach`` and no longer than ``size``."""
    names, place = np.unique(groups, return_inverse=True)
    mine = [place == k for k in range(len(names))]
    # Sums of the other groups; a difference of sums would round where one group has nearly everything.
    others = 1.0 - np.eye(len(names))
    matrices = np.tensordot(others, [fitted.matrix[k].sum(axis=0) for k in mine], 1)
    gradients = others @ [fitted.gradient[k].sum(axis=0) for k in mine]
    # Parameters that a part of the data does not determine keep their values.
    ridge = np.diag(1e-9 * np.einsum("bii->i", fitted.matrix) + 1e-30)
    free = ~_pinned(fitted)
    out = np.empty(gradients.shape)
    for k, (matrix, gradient) in enumerate(zip(matrices, gradients, strict=True)):
        step = _minimum(
            matrix + fitted.prior_matrix + ridge, gradient + fitted.prior_gradient, free, reach
        )
        lengths = float((np.abs(step) / size).max(initial=0.0))
        out[k] = step / max(1.0, _prior_lengths(fitted, step), lengths)
    return out


def _minimum(matrix: Array, gradient: Array, free: NDArray[np.bool_], reach: Array) -> Array:
    """Return the step (n_parameters,) of the ``free`` parameters to the minimum, within ``reach`` by parameter."""
    free = free.copy()
    step = np.zeros(len(gradient))
    while free.any():
        a = matrix[np.ix_(free, free)]
        step[free] = -np.linalg.solve(a, (gradient + matrix @ np.where(free, 0.0, step))[free])
        beyond = free & (np.abs(step) > reach)
        if not beyond.any():
            break
        step[beyond] = np.clip(step, -reach, reach)[beyond]
        free &= ~beyond
    return step


def _prior_lengths(fitted: FittedModel, step: Array) -> float:
    """Return the largest move in prior standard deviations. Beyond one, a linear step is not reliable."""
    return float(np.abs(step * np.sqrt(np.diag(fitted.prior_matrix))).max(initial=0.0))


# Distance from a bound, relative to the value, within which a parameter counts as at the bound.
_AT = 1e-3


def _pinned(fitted: FittedModel) -> NDArray[np.bool_]:
    """Return which parameters (n_parameters,) are at a bound, close to one, or without influence.

    A step from a bound has only one direction. Where a law is steep, it would go too far.
    """
    influence = np.einsum("bii->i", fitted.matrix)
    at_bound = set(fitted.at_bound)
    bound = np.array([n in at_bound or _next_to(fitted, n) for n in fitted.parameters])
    return np.asarray(bound | (influence <= 0))


def _next_to(fitted: FittedModel, key: tuple[int | None, str]) -> bool:
    """Whether an effect's parameter is within 0.1 % of its value from a bound."""
    place, name = key
    if place is None or key not in fitted.room:
        return False
    down, up = fitted.room[key]
    return min(-down, up) < _AT * abs((fitted.effects[place].parameters or {})[name])


def predictable(fitted: FittedModel) -> NDArray[np.bool_]:
    """Return which blocks (n_blocks,) have derivatives; a block of chaotic motion has none."""
    return np.asarray(np.einsum("bii->b", fitted.matrix) > 0)


def predicted_loss(fitted: NormalEquations, blocks: NDArray[np.bool_], step: Array) -> Array:
    """Return the loss of some blocks after a parameter step, to second order."""
    loss = fitted.loss[blocks] + 2 * fitted.gradient[blocks] @ step
    return np.asarray(loss + (fitted.matrix[blocks] @ step) @ step)


def linear_gain(fitted: NormalEquations) -> float:
    """Return the fall of the loss, priors included, that one undamped linear step predicts."""
    matrix = fitted.matrix.sum(axis=0) + fitted.prior_matrix
    gradient = fitted.gradient.sum(axis=0) + fitted.prior_gradient
    step = linear_step(fitted)
    return float(-step @ (2 * gradient + matrix @ step))


def linear_falls(fitted: NormalEquations) -> Array:
    """Return the fall of the loss of each block (n_blocks,) that one undamped linear step predicts."""
    every = np.ones(len(fitted.loss), dtype=bool)
    return np.asarray(fitted.loss - predicted_loss(fitted, every, linear_step(fitted)))


def linear_step(fitted: NormalEquations) -> Array:
    """Return the step (n_parameters,) to the minimum of the quadratic model, within the bounds of all parameters.

    Bounds hold as in a fit. A change of an own parameter beyond its bound is an effect, and an effect cannot take
    values outside its range.
    """
    known = _LINEAR.get(fitted)
    if known is None:
        known = _LINEAR[fitted] = _linear_step(fitted)
    return known


# Cache of linear steps: the gain of a step and its fall by block are asked for one after the other.
_LINEAR: WeakKeyDictionary[NormalEquations, Array] = WeakKeyDictionary()


def _linear_step(fitted: NormalEquations) -> Array:
    matrix = fitted.matrix.sum(axis=0) + fitted.prior_matrix
    gradient = fitted.gradient.sum(axis=0) + fitted.prior_gradient
    movable = (np.diag(matrix) > 0) & ~_at_hard_bound(fitted)
    free, (least, most) = movable.copy(), _room(fitted)
    # The bounds of effects are wide and give no scale, so only own parameters are scaled by theirs.
    own = np.array([n not in fitted.room for n in fitted.parameters], dtype=bool)
    room = np.where(own & np.isfinite(most - least), most - least, 1.0)
    size = np.maximum(np.diag(matrix) * np.maximum(room, 1e-300), 1e-300)
    step = np.zeros(len(gradient))
    # Active-set method (Lawson, Hanson, 1974): a parameter that meets its bound is fixed there. It is released, the one
    # with the largest gradient first, if the gradient points back inside.
    for _ in range(3 * len(gradient)):
        step[free] = _newton_step(matrix, gradient + matrix @ np.where(free, 0.0, step), free)
        beyond = free & ((step < least) | (step > most))
        if beyond.any():
            step[beyond] = np.clip(step, least, most)[beyond]
            free &= ~beyond
            continue
        side = (step >= most).astype(float) - (step <= least)
        back = side * (gradient + matrix @ step) / size
        back[~movable | free] = 0.0
        if not np.any(back > _SLIGHT):
            break
        free[np.argmax(back)] = True
    step.flags.writeable = False
    return step


# Smallest slope that counts, relative to the curvature times the distance between the bounds.
_SLIGHT = 1e-6


def _newton_step(matrix: Array, gradient: Array, free: NDArray[np.bool_]) -> Array:
    """Return the step of the free parameters to the minimum of the quadratic model."""
    a, g = matrix[np.ix_(free, free)], gradient[free]
    scale = 1 / np.sqrt(np.diag(a))
    normal = a * np.outer(scale, scale) + 1e-9 * np.eye(len(a))
    return np.asarray(-scale * np.linalg.solve(normal, g * scale))


def _at_hard_bound(fitted: NormalEquations) -> NDArray[np.bool_]:
    """Return which own parameters cannot go further (n_parameters,), whatever their tolerances allow.

    An example is a tolerance above half of the value, which would allow values below zero.
    """
    stuck = [n[0] is None and n in fitted.at_bound for n in fitted.parameters]
    own = np.array(stuck, dtype=bool)
    least, most = _room(fitted)
    # A parameter at the edge of its tolerance has room on both sides; it is not at its bound.
    inside = np.minimum(-least, most) > _SLIGHT * (most - least)
    return np.asarray(own & inside & np.isfinite(most - least))


def _room(fitted: NormalEquations) -> tuple[Array, Array]:
    """Return the smallest and the largest step of every parameter (n_parameters,)."""
    precision = np.diag(fitted.prior_matrix)
    own = np.array([n[0] is None for n in fitted.parameters], dtype=bool) & (precision > 0)
    deviation = 1 / np.sqrt(np.where(own, precision, 1.0))
    # Distance from the nominal value.
    off = fitted.prior_gradient * deviation**2
    reach = np.where(own, PRIOR_REACH * deviation, np.inf)
    known = np.array([fitted.room.get(n, (-np.inf, np.inf)) for n in fitted.parameters])
    down, up = known.reshape(-1, 2).T
    return (
        np.minimum(np.maximum(-reach - off, down), 0.0),
        np.maximum(np.minimum(reach - off, up), 0.0),
    )
