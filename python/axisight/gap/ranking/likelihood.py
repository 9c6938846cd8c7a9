"""From a held-out loss to nats: how much likelier one model is than another."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.effects import effect_table

Array = NDArray[np.float64]


# Residuals of neighbouring blocks and logs share their causes; this many blocks count as
# independent in a likelihood ratio.
INDEPENDENT_BLOCKS = 60.0

FORMULA_ERROR = max(info.formula.error for info in effect_table().values())
"""Share of the explained error by which two formulas for one physical effect may differ (tanh or algebraic
Coulomb, play or dead zone): differences in fit below it say nothing about the cause."""

# Log-probability each fitted number costs (Schwarz 1978, with the blocks above).
PARAMETER_COST = 0.5 * float(np.log(INDEPENDENT_BLOCKS))


def nats_by_loss(loss: Array) -> Array:
    """Return how many log-likelihoods a little more loss costs, of half of a loss each [1]: one at most.

    A fit has one for every half. Here ``INDEPENDENT_BLOCKS`` stand for all residuals that make up ``loss``.
    """
    return np.asarray(INDEPENDENT_BLOCKS / np.maximum(loss, INDEPENDENT_BLOCKS))


def likelier(loss: float, cost: float, *, than: tuple[float, float]) -> bool:
    """Whether a held-out loss with so many fitted numbers is likelier than another."""
    gain = 0.5 * INDEPENDENT_BLOCKS * float(np.log(than[0] / loss))
    return gain > PARAMETER_COST * (cost - than[1])


def smallest_likely_fall(loss: Array, cost: float) -> Array:
    """Return by how much a held-out loss has to fall for so many fitted numbers to be likelier than none."""
    return np.asarray(loss * -np.expm1(-2 * PARAMETER_COST * cost / INDEPENDENT_BLOCKS))


def log_ratio(left: Array, explained: Array, samples: Array) -> Array:
    """Return how much likelier a true cause is than one that leaves more, as `stand` counts.

    In each of several parts of the data, with ``samples`` residuals each: ``left``, mean square that
    the wrong one leaves above the noise, and ``explained``, that there is without either. The last
    dimension is that of the parts.
    """
    least = (samples * (1.0 + FORMULA_ERROR * explained)).sum(axis=-1)
    more = (samples * left).sum(axis=-1)
    return np.asarray(0.5 * INDEPENDENT_BLOCKS * np.log1p(more / least))


def clearly_worse(loss: float, than: float) -> bool:
    """Whether a held-out loss is worse by more than a likelihood ratio of e^2."""
    return bool(0.5 * INDEPENDENT_BLOCKS * np.log(loss / than) > 2.0)
