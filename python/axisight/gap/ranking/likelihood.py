"""From a held-out loss to nats: how much likelier one model is than another."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.effects import effect_table

Array = NDArray[np.float64]


# Residuals of neighbouring blocks and logs are correlated. So many blocks count as independent in a likelihood.
INDEPENDENT_BLOCKS = 60.0

FORMULA_ERROR = max(info.formula.error for info in effect_table().values())
"""Share of the explained loss by which two formulas of one effect may differ, such as tanh and algebraic Coulomb
friction. Smaller differences say nothing about the cause."""

# Cost of a fitted number [nats] (Schwarz 1978, with the blocks above).
PARAMETER_COST = 0.5 * float(np.log(INDEPENDENT_BLOCKS))


def nats_by_loss(loss: Array) -> Array:
    """Return the slope of the log-likelihood by half the loss [1], at most one.

    In a fit it is one. In the belief, ``INDEPENDENT_BLOCKS`` stand for all residuals of ``loss``.
    """
    return np.asarray(INDEPENDENT_BLOCKS / np.maximum(loss, INDEPENDENT_BLOCKS))


def likelier(loss: float, cost: float, *, than: tuple[float, float]) -> bool:
    """Whether a held-out loss with a number of fitted values is likelier than another pair of loss and number."""
    gain = 0.5 * INDEPENDENT_BLOCKS * float(np.log(than[0] / loss))
    return gain > PARAMETER_COST * (cost - than[1])


def smallest_likely_fall(loss: Array, cost: float) -> Array:
    """Return the fall of a held-out loss that pays for ``cost`` fitted numbers."""
    return np.asarray(loss * -np.expm1(-2 * PARAMETER_COST * cost / INDEPENDENT_BLOCKS))


def log_ratio(left: Array, explained: Array, samples: Array) -> Array:
    """Return the log-likelihood ratio of a true cause against a wrong one, counted as in `stand`.

    For parts of the data along the last dimension: ``samples``, the number of residuals; ``left``, the mean square
    that the wrong cause leaves above the noise; ``explained``, the mean square above the noise without either.
    """
    least = (samples * (1.0 + FORMULA_ERROR * explained)).sum(axis=-1)
    more = (samples * left).sum(axis=-1)
    return np.asarray(0.5 * INDEPENDENT_BLOCKS * np.log1p(more / least))


def clearly_worse(loss: float, than: float) -> bool:
    """Whether a held-out loss is less likely than another by a factor of more than e^2."""
    return bool(0.5 * INDEPENDENT_BLOCKS * np.log(loss / than) > 2.0)
