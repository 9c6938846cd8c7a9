"""From held-out losses to ranks, probabilities and what cannot be told apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.gap.model import Evidence, FreeEffect
from axisight.gap.score import held_out_loss

Array = NDArray[np.float64]

# Residuals of neighbouring blocks, axes and logs share their causes; this many
# blocks count as independent in a likelihood ratio.
_INDEPENDENT_BLOCKS = 60.0
# Share of the explained error by which two formulas for one physical effect may
# differ (tanh or algebraic Coulomb, play or dead zone): differences in fit below
# it say nothing about the cause.
_FORMULA_ERROR = 0.02
# Log-probability each fitted number costs (Schwarz 1978, with the blocks above).
_PARAMETER_COST = 0.5 * float(np.log(_INDEPENDENT_BLOCKS))


@dataclass(frozen=True)
class Trial:
    """A candidate fitted on top of a model: its held-out loss by block, (n_blocks,)."""

    candidate: FreeEffect
    evidence: Evidence
    held_out: Array

    @property
    def label(self) -> str:
        """``effect@axis``."""
        return self.candidate.effect.label

    @property
    def cost(self) -> float:
        """Number of fitted values; the order of a harmonic counts too."""
        harmonics = sum(
            name.startswith("cosine_") and name[7].isdigit() for name in self.candidate.free
        )
        return float(len(self.candidate.free) + harmonics)


@dataclass(frozen=True)
class Ranked:
    """A trial with its share of the explainable error, its standard errors and probability."""

    trial: Trial
    score: float
    significance: float
    probability: float


def trial(candidate: FreeEffect, evidence: Evidence) -> Trial:
    """Score a fitted candidate on held-out data."""
    return Trial(candidate, evidence, held_out_loss(evidence))


def block_significance(current: Array, new: Array, logs: NDArray[np.int64]) -> float:
    """Return how many standard errors a fall of held-out loss is from zero.

    Neighbouring blocks are correlated, quarters of a log nearly not: the fall is
    averaged over quarters, each relative to its own loss (so that one loud log
    does not drown the others), and compared with its scatter. An effect may
    show in a few loud stretches only; the plain mean is tried as well, and the
    larger of the two counts.
    """
    groups = _quarters(logs)
    before = np.bincount(groups, current) / np.bincount(groups)
    after = np.bincount(groups, new) / np.bincount(groups)
    fall = before - after
    return max(_standard_errors(fall), _standard_errors(fall / np.maximum(before + after, 1e-300)))


def _standard_errors(x: Array) -> float:
    if len(x) < 2:
        return 0.0
    spread = float(np.std(x, ddof=1) / np.sqrt(len(x)))
    return float(x.mean() / max(spread, 1e-12 * abs(x.mean()), 1e-300))


def _quarters(logs: NDArray[np.int64]) -> NDArray[np.int64]:
    out = np.zeros(len(logs), dtype=np.int64)
    for k, log in enumerate(np.unique(logs)):
        rows = np.flatnonzero(logs == log)
        out[rows] = 4 * k + (4 * np.arange(len(rows))) // len(rows)
    return out


def rank(
    trials: Sequence[Trial], current: Array, floor: Array, logs: NDArray[np.int64]
) -> list[Ranked]:
    """Rank candidates, best first.

    ``current`` and ``floor`` (n_blocks,): held-out loss without the candidates
    and of a perfect model. Probabilities compare the candidates with each other
    (that one of them is the cause is decided elsewhere): likelihood ratio of
    the held-out error with unknown variance, formula error added, one cost per
    fitted number.
    """
    explainable = max(float((current - floor).sum()), 1e-12)
    losses = np.array([t.held_out.sum() for t in trials])
    if len(losses) == 0:
        return []
    tempered = np.maximum(losses, floor.sum()) + _FORMULA_ERROR * explainable
    cost = np.array([t.cost for t in trials])
    logp = -0.5 * _INDEPENDENT_BLOCKS * np.log(tempered) - _PARAMETER_COST * cost
    probability = np.exp(logp - logp.max())
    probability /= probability.sum()
    out = [
        Ranked(
            t,
            float((current - t.held_out).sum() / explainable),
            block_significance(current, t.held_out, logs),
            float(p),
        )
        for t, p in zip(trials, probability, strict=True)
    ]
    return sorted(out, key=lambda r: (-r.probability, -r.score, r.trial.label))


def clearly_worse(loss: float, than: float) -> bool:
    """Whether a held-out loss is worse by more than a likelihood ratio of e^2."""
    return bool(0.5 * _INDEPENDENT_BLOCKS * np.log(loss / than) > 2.0)


# A rival this likely beside the winner leaves the cause open.
_RIVAL = 0.2


def inseparable(ranked: Sequence[Ranked]) -> list[Ranked]:
    """Return the candidates the data cannot tell apart, the winner first; one if it is clear."""
    if not ranked:
        return []
    winner = ranked[0]
    rivals = [r for r in ranked[1:] if r.probability > _RIVAL * winner.probability / (1 - _RIVAL)]
    return [winner, *rivals]
