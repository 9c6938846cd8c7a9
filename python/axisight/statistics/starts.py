"""Random starts of a search, a function of seed and number alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class StartRange:
    """Where the starts of one parameter are drawn.

    Evenly from ``low`` to ``high``, or evenly in the logarithm, which takes two limits of one sign;
    then clipped to ``bounds``.
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
    """Return the start ``number`` of a ``seed``: of each parameter one from its range.

    ``values`` (n,) are those of parameters without a range, which stay; they take a random number
    too, so that what the others get does not depend on them.
    """
    shares = np.random.default_rng([seed, number]).random(len(values))
    return [
        value if limits is None else limits.at(share)
        for value, limits, share in zip(values, ranges, shares, strict=True)
    ]
