"""Weight of residuals over frequency."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.display.summary import summarized

Array = NDArray[np.float64]


@summarized
@dataclass(frozen=True)
class Weighting:
    """Weight of residuals over frequency, one table per axis, and decimation.

    ``frequency_hz`` (n_freq,) [Hz] and ``weight`` (n_axes, n_freq) are linear in between and constant
    outside. Frequencies above the Nyquist frequency after decimation have weight zero. A residual of
    standard deviation s weighted by 1/s counts one.
    """

    frequency_hz: Array
    weight: Array
    decimation: int = 1

    @classmethod
    def flat(cls, n_axes: int) -> Weighting:
        """Return a weighting of one at all frequencies."""
        return cls(np.zeros(1), np.ones((n_axes, 1)))

    def of(self, series: Array, sample_time_s: float) -> Array:
        """Return signals (n, n_axes) weighted and decimated, (n // decimation, n_axes).

        Like the core, it continues the signals by reflection and filters with zero phase.
        """
        kept = len(series) // self.decimation
        whole = series[: kept * self.decimation]
        spectrum = np.fft.rfft(np.concatenate([whole, whole[::-1]]), axis=0)[: kept + 1]
        frequency = np.arange(kept + 1) / (2 * len(whole) * sample_time_s)
        weight = [np.interp(frequency, self.frequency_hz, w) for w in self.weight]
        spectrum *= np.stack(weight, axis=1) / np.sqrt(self.decimation)
        if self.decimation > 1:
            # Decimation folds two frequencies onto the new Nyquist frequency.
            spectrum[-1] = 0.0
        return np.asarray(np.fft.irfft(spectrum, 2 * kept, axis=0)[:kept])

    def core(self) -> list[tuple[list[float], list[float], int]]:
        """Return the tables in the form of the compiled core."""
        f = self.frequency_hz.tolist()
        return [(f, w.tolist(), self.decimation) for w in self.weight]
