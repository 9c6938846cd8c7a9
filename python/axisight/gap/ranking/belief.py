"""The belief on one axis while rules make it: log-weights, and a ledger of what each rule added."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.trace import Adjustment

Array = NDArray[np.float64]


class Belief:
    """Log-weights of the hypotheses of one axis, by label, all of them equal at first.

    ``log_weight`` (n_hypotheses,) in nats; ``ledger``: every change of more than rounding, in order.
    """

    def __init__(self, labels: Sequence[str]) -> None:
        self.labels = tuple(labels)
        self.log_weight: Array = np.zeros(len(self.labels))
        self.ledger: list[Adjustment] = []

    def becomes(self, rule: str, log_weight: Array, *, against: Array | float = 0.0) -> None:
        """Take the log-weights (n_hypotheses,) that a rule of `axisight.gap.facts.trace.RULES` makes of them.

        The ledger holds what the rule added, less ``against``: a likelihood says something only
        against another one.
        """
        added = log_weight - self.log_weight - against
        changed = np.abs(added) > _ROUNDING
        self.log_weight = log_weight
        self.ledger += [
            Adjustment(rule, label, float(nats))
            for label, nats, yes in zip(self.labels, added, changed, strict=True)
            if yes
        ]

    def probabilities(self) -> Array:
        """Return the weights (n_hypotheses,) with a sum of one."""
        weight = np.exp(self.log_weight - self.log_weight.max())
        return np.asarray(weight / weight.sum())


# Nats that sums in another order may differ by.
_ROUNDING = 1e-12
