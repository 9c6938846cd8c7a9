"""Ticks at round numbers, and positions along an axis of a figure."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.report.wording import number

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Scale:
    """An axis from ``low`` to ``high`` (``low < high``), in the unit of its quantity."""

    low: float
    high: float

    @classmethod
    def around(cls, values: Floats, margin: float = 0.0) -> Scale:
        """Return the scale of all finite ``values``, with ``margin`` times their span added on both sides."""
        finite = values[np.isfinite(values)]
        low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
        # Equal values stand in the middle.
        room = margin * (high - low) if high > low else max(0.1 * abs(low), 1e-3)
        return cls(low - room, high + room)

    def share(self, value: Floats) -> Floats:
        """Return the position of ``value``: 0 at ``low``, 1 at ``high``."""
        return (value - self.low) / (self.high - self.low)

    def ticks(self, most: int) -> list[tuple[float, str]]:
        """Return at most ``most + 1`` round numbers, each as position [1] and text."""
        rough = (self.high - self.low) / most
        power = 10.0 ** math.floor(math.log10(rough))
        step = next(f * power for f in (1, 2, 5, 10) if f * power >= rough * (1 - 1e-9))
        first, last = math.ceil(self.low / step - 1e-6), math.floor(self.high / step + 1e-6)
        values = [i * step for i in range(first, last + 1)]
        return [((v - self.low) / (self.high - self.low), _text(v, step)) for v in values]


def _text(value: float, step: float) -> str:
    """Return a tick with as many digits as tell it from its neighbours."""
    if value == 0:
        return "0"
    digits = 1 + math.floor(math.log10(abs(value))) - math.floor(math.log10(step))
    return number(value, max(1, digits))
