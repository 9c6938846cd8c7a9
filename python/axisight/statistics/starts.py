"""Random starts of a search, which depend only on seed and number."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class StartRange:
    """The range of random starts of one parameter.

    Starts are uniform from ``low`` to ``high``, or uniform in the logarithm for two limits of one sign,
    and then clipped to ``bounds``.
    """

    low: float
    high: float
    logarithmic: bool
    bounds: tuple[float, float]

    def at(self, share: float) -> float:
        """Return the start at a ``share`` from 0 (low) to 1 (high) of the range."""
        if self.logarithmic:
            drawn = self.low * (self.high / self.low) ** share
        else:
            drawn = self.low + (self.high - self.low) * share
        return float(np.clip(drawn, *self.bounds))


def drawn_start(
    values: Sequence[float], ranges: Sequence[StartRange | None], seed: int, number: int
) -> list[float]:
    """Return the random start ``number`` of a ``seed``, one value per parameter from its range.

    A parameter without a range keeps its entry of ``values`` (n,). It uses a random number too, so that
    the draws of other parameters do not depend on it.
    """
    shares = np.random.default_rng([seed, number]).random(len(values))
    return [
        value if limits is None else limits.at(share)
        for value, limits, share in zip(values, ranges, shares, strict=True)
    ]
