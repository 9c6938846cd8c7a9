"""Candidate terms of one axis: every way to act times every variable."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.remainder.records import Motion, Record
from axisight.remainder.splines import Scale, basis, penalty, scale_of
from axisight.remainder.variables import ACTS, VARIABLES, Acts, factor

Array = NDArray[np.float64]

# Ways to act that say the same as the plain torque of a variable, or as another term.
_SAME: dict[str, tuple[Acts, ...]] = {
    "speed": ("speed",),
    "load": ("load",),
    # A drift changes friction; a torque of the clock alone would repeat one schedule of motion.
    "time": ("torque", "load"),
}
_RIDGE = 1e-6
# Travel in periods that shows one, and most periods in the travel that are looked for.
_LEAST_PERIODS = 3
_MOST_LINES = 4000
_LINES_A_PERIOD = 4
_BINS_A_PERIOD = 8
# Frequencies that are tried between two lines of the transform, and harmonics that count there.
_FINE = np.linspace(-1.0, 1.0, 41)
_HARMONICS = (1, 2, 3)
# Ways in which periodic terms act.
_WAVES: tuple[Acts, ...] = ("torque", "direction")


@dataclass(frozen=True)
class Candidate:
    """A term that may be fitted: how it acts, on which variable, of which axis (from 0); ``scale`` None: a constant."""

    acts: Acts
    variable: str
    of_axis: int
    scale: Scale | None

    def columns(self, motion: Motion, axis: int, corner_rad_s: float) -> Array:
        """Return the torque (n, m) [Nm] on ``axis`` by unit of each coefficient."""
        acting = factor(self.acts, motion, axis, corner_rad_s)[:, None]
        if self.scale is None:
            return acting
        return acting * basis(self.scale, VARIABLES[self.variable].read(motion, self.of_axis))

    def penalty(self) -> Array:
        """Return the penalty of the coefficients (m, m)."""
        return np.full((1, 1), _RIDGE) if self.scale is None else penalty(self.scale)


def candidates(records: Sequence[Record], axis: int) -> Iterator[Candidate]:
    """Yield the candidates of an axis (from 0) whose variable is known and varies in the records."""
    for name, variable in VARIABLES.items():
        for of in range(records[0].motion.n_axes) if variable.others else [axis]:
            values = np.concatenate([variable.read(r.motion, of) for r in records])
            scale = None if name == "constant" else scale_of(values, variable.warp)
            if scale is None and name != "constant":
                continue
            left_out = _SAME.get(name, ()) if of == axis else ()
            for acts in ACTS:
                if acts not in left_out:
                    yield Candidate(acts, name, of, scale)


def periodic(
    records: Sequence[Record], axis: int, residual: Array, cutoff_hz: float
) -> Iterator[Candidate]:
    """Yield candidates that repeat along the angle of an axis, with the period that ``residual`` (n,) shows best.

    ``cutoff_hz``: highest frequency in time at which the period may show.
    """
    angle = np.concatenate([r.motion.position_rad[:, axis] for r in records])
    speed = np.concatenate([r.motion.velocity_rad_s[:, axis] for r in records])
    span, fast = float(np.ptp(angle)), float(np.sqrt(np.mean(speed**2)))
    if span <= 0 or fast <= 0:
        return
    most = min(_MOST_LINES, int(cutoff_hz * span / fast))
    if most < _LEAST_PERIODS:
        return
    # Sums over bins of the angle are fine enough, and a fast Fourier transform takes them to all periods at once.
    n_bins = _BINS_A_PERIOD * most
    place = np.minimum((n_bins * (angle - angle.min()) / span).astype(np.int64), n_bins - 1)
    first = int(_LEAST_PERIODS * _LINES_A_PERIOD)
    for acts in _WAVES:
        acting = np.sign(speed) if acts == "direction" else np.ones(len(speed))
        binned = np.bincount(place, weights=acting * residual, minlength=n_bins)
        power = np.abs(np.fft.rfft(binned, _LINES_A_PERIOD * n_bins))[: _LINES_A_PERIOD * most]
        line = (first + int(np.argmax(power[first:]))) / _LINES_A_PERIOD
        period = 1 / _refined(angle, acting * residual, line / span, 1 / (_LINES_A_PERIOD * span))
        yield Candidate(acts, "angle", axis, Scale(0.0, period, None, period))


def _refined(angle: Array, signal: Array, frequency: float, step: float) -> float:
    """Return the frequency [1/rad] near ``frequency`` at which a signal (n,) over an angle (n,) [rad] repeats best.

    Over many periods, a period that is off by the distance of two lines loses its phase.
    """

    def power(tried: float) -> float:
        waves = (np.exp(-2j * np.pi * k * tried * angle) for k in _HARMONICS)
        return float(sum(abs(wave @ signal) ** 2 for wave in waves))

    return float(max(frequency + step * _FINE, key=power))
