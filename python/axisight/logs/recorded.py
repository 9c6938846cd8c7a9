"""The rows of a log as they were recorded, before irregular stamps were put on a uniform grid.

Interpolation makes steps and rests of its own, and hides frozen, repeated, shuffled and wrong samples. Therefore
the rows are checked as they were recorded.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Channel = tuple[str, int]

_MEASURED = ("position", "torque", "velocity")


@dataclass(frozen=True, eq=False)
class RecordedRows:
    """Measured signals (n,) by field and axis (from 0), names of their columns, and the stamps (n,) [s] from 0."""

    stamps_s: Floats
    signals: Mapping[Channel, Floats]
    labels: Mapping[Channel, str]

    def part(self, start_s: float, stop_s: float) -> RecordedRows:
        """Return the rows from `start_s` to before `stop_s` [s], stamps counted from `start_s`."""
        kept = (self.stamps_s >= start_s) & (self.stamps_s < stop_s)
        signals = {channel: values[kept] for channel, values in self.signals.items()}
        return replace(self, stamps_s=self.stamps_s[kept] - start_s, signals=signals)


def recorded_rows(
    stamps_s: Floats, signals: Mapping[Channel, Floats], labels: Mapping[Channel, str]
) -> RecordedRows:
    """Return the measured ones of the `signals` (n,) that are finite throughout, with their `stamps_s` (n,) [s]."""
    measured = {
        channel: values
        for channel, values in signals.items()
        if channel[0] in _MEASURED and np.isfinite(values).all()
    }
    return RecordedRows(stamps_s, measured, labels)
