"""Forward selection of the terms of one axis by the error of held-out logs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.remainder.candidates import Candidate
from axisight.remainder.folds import Folds
from axisight.remainder.penalised import SMOOTHINGS, Block, Joint

Array = NDArray[np.float64]

# Candidates that are fitted together with the terms chosen before, of all that were screened.
_TRIED = 4
# Share of the squared error that a term without significance must remove in every fold.
_IN_EVERY_FOLD = 0.2
# Standard errors within which the simpler of two terms is taken.
_ALIKE = 1.0


@dataclass(frozen=True, eq=False)
class Chosen:
    """A chosen term: its block with its smoothing, and its held-out gain.

    ``gain``: share of the squared residual that it removes beside the terms before it [1]; ``significance``: that
    over its standard error.
    """

    candidate: Candidate
    block: Block
    gain: float
    significance: float


@dataclass(frozen=True, eq=False)
class Limits:
    """When selection stops: after ``terms``, or below a ``gain`` [1] or a ``significance`` of the best candidate."""

    terms: int
    gain: float
    significance: float


@dataclass(frozen=True, eq=False)
class _Fit:
    candidate: Candidate
    block: Block
    squares: Array


def select(
    y: Array,
    folds: Folds,
    blocks: Callable[[Array], Sequence[tuple[Candidate, Block]]],
    limits: Limits,
) -> tuple[list[Chosen], Array]:
    """Return the chosen terms of a weighted residual (n,), in the order of choice, and squared held-out errors (n,).

    ``blocks``: candidates with their blocks, given what the chosen terms leave of the residual (n,).
    """
    chosen: list[Chosen] = []
    squares = y**2
    while len(chosen) < limits.terms:
        kept = [c.block for c in chosen]
        left = _left(y, kept)
        offered = [x for x in blocks(left) if not any(x[0] == c.candidate for c in chosen)]
        screened = sorted(offered, key=lambda x: _promise(left, folds, *x))
        tried = _with_own_constants(screened, chosen)
        fits = [_best(y, folds, candidate, block, kept) for candidate, block in tried]
        if not fits:
            break
        taken = _simplest(fits, folds)
        term = _judged(taken, squares, y, folds)
        if not _enough(term, folds.fold_sums(squares), folds.fold_sums(taken.squares), limits):
            break
        chosen.append(term)
        squares = taken.squares
    return chosen, squares


_Offer = tuple[Candidate, Block]


def _with_own_constants(screened: Sequence[_Offer], chosen: Sequence[Chosen]) -> list[_Offer]:
    """Return the first candidates, with the constants that act alike.

    Two functions with the same factor would share their constant, so one beside a chosen one is orthogonal to it.
    """
    constants = {
        candidate.acts: offer for offer in screened if (candidate := offer[0]).scale is None
    }
    taken = {c.candidate.acts for c in chosen}
    out: list[_Offer] = []
    for candidate, block in screened[:_TRIED]:
        constant = constants.get(candidate.acts)
        if constant is None or candidate.scale is None:
            out.append((candidate, block))
        elif candidate.acts not in taken:
            out += [(candidate, block), constant]
        elif (left := block.without(constant[1].columns)) is not None:
            out.append((candidate, left))
    return list({candidate: (candidate, block) for candidate, block in out}.values())


def _enough(term: Chosen, before: Array, after: Array, limits: Limits) -> bool:
    """Whether a term is worth its place; ``before`` and ``after``: squared held-out error of each fold (n_folds,).

    Errors at few standstills give a gain a large standard error. Such a term counts if every fold shows it clearly.
    """
    shares = 1 - after / np.maximum(before, 1e-300)
    sure = term.significance >= limits.significance and 2 * np.sum(shares > 0) > len(shares)
    return bool(term.gain >= limits.gain and (sure or shares.min() >= _IN_EVERY_FOLD))


def _left(y: Array, blocks: Sequence[Block]) -> Array:
    if not blocks:
        return y
    joint = Joint.of(blocks)
    return np.asarray(y - joint.columns @ joint.solved(y))


def _smoothed(candidate: Candidate, block: Block) -> list[Block]:
    """Return the block with each smoothing; a constant has nothing to smooth."""
    smoothings = SMOOTHINGS if candidate.scale is not None else SMOOTHINGS[:1]
    return [block.smoothed(s) for s in smoothings]


def _promise(left: Array, folds: Folds, candidate: Candidate, block: Block) -> float:
    """Return the smallest squared held-out error of a candidate alone."""
    penalties = [b.penalty for b in _smoothed(candidate, block)]
    return float(Joint.of([block]).held_out_loss(left, folds.fold, penalties).min())


def _best(
    y: Array, folds: Folds, candidate: Candidate, block: Block, kept: Sequence[Block]
) -> _Fit:
    """Return the fit of a candidate beside blocks, with the smoothing of the smallest held-out error."""
    fits = (
        _Fit(candidate, b, (y - Joint.of([*kept, b]).held_out(y, folds.fold)) ** 2)
        for b in _smoothed(candidate, block)
    )
    return min(fits, key=lambda fit: float(fit.squares.sum()))


def _simplest(fits: Sequence[_Fit], folds: Folds) -> _Fit:
    """Return the best fit, or a constant whose held-out error is not clearly larger."""
    best = min(fits, key=lambda fit: float(fit.squares.sum()))
    constants = [f for f in fits if f.candidate.scale is None]
    for plain in constants:
        worse = folds.sums(plain.squares - best.squares)
        if worse.mean() < _ALIKE * _standard_error(worse):
            return plain
    return best


def _judged(fit: _Fit, before: Array, y: Array, folds: Folds) -> Chosen:
    fall = folds.sums(before - fit.squares)
    error = _standard_error(fall)
    gain = float(fall.sum()) / max(float(y @ y), 1e-300)
    return Chosen(fit.candidate, fit.block, gain, float(fall.mean()) / max(error, 1e-300))


def _standard_error(blocks: Array) -> float:
    return float(blocks.std(ddof=1)) / float(np.sqrt(len(blocks)))
