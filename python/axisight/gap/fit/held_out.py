"""Held-out scores of fitted models, from the normal equations of their data blocks."""

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

    Each log in turn is left out, the parameters are re-estimated on the others
    (one Gauss-Newton step from the common fit, exact for a model linear in its
    parameters), and its blocks are scored. With a single log, its blocks are
    left out in five interleaved groups instead.

    A log that alone tells of an effect is left out in stretches: what others make of it is no more
    than their noise. So it is of a model that is compared with one of ``like``, a fit to the same data with
    that effect: the log may be alone with a parameter of the simulator, too.
    """
    kept = _KEPT.setdefault(fitted, WeakKeyDictionary())
    like = fitted if like is None else like
    known = kept.get(like)
    if known is None:
        known = kept[like] = _held_out_loss(fitted, _groups(like))
    return known


# Held-out losses of models by what their logs are left out like: a search asks for them again and again.
_KEPT: WeakKeyDictionary[FittedModel, WeakKeyDictionary[FittedModel, Array]] = WeakKeyDictionary()


def _held_out_loss(fitted: FittedModel, groups: NDArray[np.int64]) -> Array:
    """Return the loss of every block (n_blocks,) predicted without its group; not to be written to."""
    out = np.zeros(len(fitted.loss))
    for group in np.unique(groups):
        inside = groups == group
        step = straight_step_without(fitted, inside)
        out[inside] = predicted_loss(fitted, inside, step)
    out.flags.writeable = False
    return out


# Share of what all logs tell of an effect's parameter from which a log is alone with it.
_ALONE = 0.9
# Stretches of time of such a log.
_STRETCHES = 4
# Groups of a single log.
_INTERLEAVED = 5


def _groups(fitted: FittedModel) -> NDArray[np.int64]:
    """Return the number of the group (n_blocks,) that each block is left out with."""
    logs, number = np.unique(fitted.log, return_inverse=True)
    if len(logs) == 1:
        return np.arange(len(number)) % _INTERLEAVED
    groups = number * _STRETCHES
    for log in _alone(fitted, number):
        for axis in np.unique(fitted.axis):
            # Blocks of an axis of a log stand in the order of time.
            here = np.flatnonzero((number == log) & (fitted.axis == axis))
            groups[here] += np.arange(len(here)) * _STRETCHES // len(here)
    return groups


def _alone(fitted: FittedModel, number: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the numbers of the logs that tell nearly all there is of every parameter of the effects.

    Of every one: a law that only adds a number to another is judged as that other is.
    """
    effects = [i for i, (place, _) in enumerate(fitted.parameters) if place is not None]
    told = np.einsum("bii->bi", fitted.matrix)[:, effects]
    by_log = np.array([told[number == k].sum(axis=0) for k in range(number.max() + 1)])
    every = (by_log > _ALONE * by_log.sum(axis=0)).all(axis=1)
    return np.flatnonzero(every) if effects else np.zeros(0, dtype=np.int64)


def step_without(fitted: FittedModel, inside: NDArray[np.bool_]) -> Array:
    """Return how a re-fit without the blocks ``inside`` moves the parameters, to first order."""
    step = _least_squares(fitted, inside, np.full(len(fitted.parameters), np.inf))
    return step / max(1.0, _prior_lengths(fitted, step))


def straight_step_without(fitted: FittedModel, inside: NDArray[np.bool_]) -> Array:
    """Return the same, no further than losses can be predicted to second order.

    Each number that shapes a law moves by a tenth of itself at most, the others to what is best with that; and
    no effect by more than it is large. The size of a number is that of the largest of its effect in the same unit.
    """
    reach, size = np.full((2, len(fitted.parameters)), np.inf)
    for place, effect in enumerate(fitted.effects):
        table = effect_info(effect.name).parameters
        values = dict(zip((p.name for p in table), effect.values(), strict=True))
        for p in table:
            if (place, p.name) not in fitted.parameters:
                continue
            column = fitted.parameters.index((place, p.name))
            if p.role == "shape":
                reach[column] = _STRAIGHT * abs(values[p.name])
            # One that is nothing, as all of its unit are, has no size to go by.
            size[column] = max(abs(values[q.name]) for q in table if q.unit == p.unit) or np.inf
    step = _least_squares(fitted, inside, reach)
    lengths = float((np.abs(step) / size).max(initial=0.0))
    return step / max(1.0, _prior_lengths(fitted, step), lengths)


# Of a number that shapes a law, over which its law is about linear in it: waves over an angle are half a radian
# out of phase after that, where they come round once.
_STRAIGHT = 0.1


def _least_squares(fitted: FittedModel, inside: NDArray[np.bool_], reach: Array) -> Array:
    """Return the step (n_parameters,) to the least without some blocks, each within its reach."""
    matrix = fitted.matrix[~inside].sum(axis=0) + fitted.prior_matrix
    gradient = fitted.gradient[~inside].sum(axis=0) + fitted.prior_gradient
    # Parameters this part of the data says nothing about stay where they are.
    matrix += np.diag(1e-9 * np.einsum("bii->i", fitted.matrix) + 1e-30)
    free = ~_pinned(fitted)
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
    """Return the largest move in prior standard deviations: beyond one, a linear step is no guide."""
    return float(np.abs(step * np.sqrt(np.diag(fitted.prior_matrix))).max(initial=0.0))


# Of its value: a number this near to a bound is at it.
_AT = 1e-3


def _pinned(fitted: FittedModel) -> NDArray[np.bool_]:
    """Return which parameters sit on a bound, or next to one, or have no influence (n_parameters,).

    A step from there has one way to go, and where a law is steep it goes far.
    """
    influence = np.einsum("bii->i", fitted.matrix)
    bound = np.array([n in fitted.at_bound or _next_to(fitted, n) for n in fitted.parameters])
    return np.asarray(bound | (influence <= 0))


def _next_to(fitted: FittedModel, key: tuple[int | None, str]) -> bool:
    """Whether an effect's number is within a thousandth of itself from a bound."""
    place, name = key
    if place is None or key not in fitted.room:
        return False
    down, up = fitted.room[key]
    return min(-down, up) < _AT * abs((fitted.effects[place].parameters or {})[name])


def predictable(fitted: FittedModel) -> NDArray[np.bool_]:
    """Return which blocks (n_blocks,) the model can follow at all; a chaotic one has no derivative."""
    return np.asarray(np.einsum("bii->b", fitted.matrix) > 0)


def predicted_loss(fitted: NormalEquations, blocks: NDArray[np.bool_], step: Array) -> Array:
    """Return the loss of some blocks after a parameter step, to second order."""
    loss = fitted.loss[blocks] + 2 * fitted.gradient[blocks] @ step
    return np.asarray(loss + np.einsum("bij,i,j->b", fitted.matrix[blocks], step, step))


def linear_gain(fitted: NormalEquations) -> float:
    """Return how much loss one undamped step from here promises, priors included."""
    matrix = fitted.matrix.sum(axis=0) + fitted.prior_matrix
    gradient = fitted.gradient.sum(axis=0) + fitted.prior_gradient
    step = linear_step(fitted)
    return float(-step @ (2 * gradient + matrix @ step))


def linear_falls(fitted: NormalEquations) -> Array:
    """Return how much loss of each block (n_blocks,) one undamped step from here takes away."""
    every = np.ones(len(fitted.loss), dtype=bool)
    return np.asarray(fitted.loss - predicted_loss(fitted, every, linear_step(fitted)))


def linear_step(fitted: NormalEquations) -> Array:
    """Return the step (n_parameters,) to the least of a parabola.

    Parameters go no further than their bounds, as in a fit: what would take the simulator's own beyond
    is an effect, and no effect is what it cannot be.
    """
    matrix = fitted.matrix.sum(axis=0) + fitted.prior_matrix
    gradient = fitted.gradient.sum(axis=0) + fitted.prior_gradient
    movable = (np.diag(matrix) > 0) & ~_at_end(fitted)
    free, (least, most) = movable.copy(), _room(fitted)
    # Bounds of effects are far: none of them says what is large.
    own = np.array([n not in fitted.room for n in fitted.parameters], dtype=bool)
    room = np.where(own & np.isfinite(most - least), most - least, 1.0)
    size = np.maximum(np.diag(matrix) * np.maximum(room, 1e-300), 1e-300)
    step = np.zeros(len(gradient))
    # Active sets (Lawson, Hanson, 1974): what meets its bound is held there, and let go again, the
    # strongest pull first, where the slope leads back from it.
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
    return step


# Of the curvature times the room of a parameter: a slope that this small leads nowhere.
_SLIGHT = 1e-6


def _newton_step(matrix: Array, gradient: Array, free: NDArray[np.bool_]) -> Array:
    """Return the step of the free parameters to the least of a parabola."""
    a, g = matrix[np.ix_(free, free)], gradient[free]
    scale = 1 / np.sqrt(np.diag(a))
    normal = a * np.outer(scale, scale) + 1e-9 * np.eye(len(a))
    return np.asarray(-scale * np.linalg.solve(normal, g * scale))


def _at_end(fitted: NormalEquations) -> NDArray[np.bool_]:
    """Return which of the simulator's own parameters cannot go further, their tolerances or not.

    A tolerance of half the value and more would take it below zero.
    """
    stuck = [n[0] is None and n in fitted.at_bound for n in fitted.parameters]
    own = np.array(stuck, dtype=bool)
    least, most = _room(fitted)
    # Not by its tolerance: that leaves room on both sides.
    inside = np.minimum(-least, most) > _SLIGHT * (most - least)
    return np.asarray(own & inside & np.isfinite(most - least))


def _room(fitted: NormalEquations) -> tuple[Array, Array]:
    """Return the least and the largest step of every parameter (n_parameters,)."""
    precision = np.diag(fitted.prior_matrix)
    own = np.array([n[0] is None for n in fitted.parameters], dtype=bool) & (precision > 0)
    deviation = 1 / np.sqrt(np.where(own, precision, 1.0))
    # How far it is from its nominal value already.
    off = fitted.prior_gradient * deviation**2
    reach = np.where(own, PRIOR_REACH * deviation, np.inf)
    known = np.array([fitted.room.get(n, (-np.inf, np.inf)) for n in fitted.parameters])
    down, up = known.reshape(-1, 2).T
    return (
        np.minimum(np.maximum(-reach - off, down), 0.0),
        np.maximum(np.minimum(reach - off, up), 0.0),
    )
