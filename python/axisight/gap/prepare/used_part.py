"""Selects the used part of each log: between two times, from the first to the last motion, or motion by motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.gap.signals.noise import position_noise_std
from axisight.logs import Log

Array = NDArray[np.float64]
Span = tuple[float, float | None]

# Window of a mean speed [s].
REST_S = 0.2
# Mean speed below which a motor stands, as a share of the largest.
STANDS = 0.005
# Standard deviations of the mean speed's noise that are added to it.
NOISES = 6.0
# Rest that is kept before and after a motion [s].
_KEPT_S = 0.2
# Rest that separates two motions [s].
_BETWEEN_S = 0.5
# Shortest part of a log [s].
_SHORTEST_S = 1.0


@dataclass(frozen=True)
class Used:
    """The used part of each log: from ``start_s`` to ``stop_s`` [s]; None is the end.

    ``moving``: only from the first to the last motion of that part; ``runs``: each motion between rests of all
    axes is a log.
    """

    start_s: float = 0.0
    stop_s: float | None = None
    moving: bool = False
    runs: bool = False

    @property
    def whole(self) -> bool:
        """Whether logs stay unchanged."""
        return self == WHOLE

    def of(self, log: Log) -> list[Log]:
        """Return the used parts of a log, one without ``runs``; raises InputError naming the option."""
        return self.beside(log, log)

    def beside(self, log: Log, other: Log) -> list[Log]:
        """Return the parts of an ``other`` log at the times of those that `of` returns for ``log``."""
        if self.whole:
            return [other]
        part, out = _part(other, self.start_s, self.stop_s), []
        moves = self._moves(_part(log, self.start_s, self.stop_s))
        for k, (start, stop) in enumerate(moves):
            name = f"{part.name}#{k + 1}" if len(moves) > 1 else part.name
            out.append(replace(_part(part, start, stop), name=name))
        return out

    def one_of(self, log: Log) -> Log:
        """Return the used part of a log without cutting it into runs."""
        (one,) = replace(self, runs=False).of(log)
        return one

    def _moves(self, log: Log) -> Sequence[Span]:
        if not (self.moving or self.runs):
            return [(0.0, None)]
        found = motions(log, _BETWEEN_S if self.runs else log.duration_s)
        if not found:
            option = "--cut-at-rests" if self.runs else "--moving"
            raise InputError(f"{log.source}: {option}: expected an axis that moves, got none")
        return found


WHOLE = Used()
"""The whole log."""


def motions(log: Log, between_s: float) -> list[Span]:
    """Return start and end [s] of each motion in a log, with a short rest before and after it.

    Rests of all motors and references up to ``between_s`` [s] do not split a motion. Each span has the shortest
    length of a log, if the log is that long.
    """
    at = np.flatnonzero(~stands(log))
    if not len(at):
        return []
    step, end = log.sample_time_s, log.duration_s
    parts = np.split(at, np.flatnonzero(np.diff(at) * step > between_s) + 1)
    spans: list[tuple[float, float]] = []
    for part in parts:
        first, last = float(part[0] * step), float(part[-1] * step)
        if spans and spans[-1][1] - spans[-1][0] < _SHORTEST_S:
            # A motion too short for a log is joined with the next one.
            first = spans.pop()[0] + _KEPT_S
        spans.append((max(first - _KEPT_S, 0.0), min(last + _KEPT_S, end)))
    first, last = spans[-1]
    if last - first < _SHORTEST_S and len(spans) > 1:
        spans[-2:] = [(spans[-2][0], last)]
    elif last - first < _SHORTEST_S:
        # A single short motion gets the rest around it that a log needs.
        last = min(first + _SHORTEST_S, end)
        spans[-1] = (max(min(first, last - _SHORTEST_S), 0.0), last)
    return [*spans]


def stands(log: Log) -> NDArray[np.bool_]:
    """Return where all motors of a log and their references stand (n_samples,)."""
    n = max(4, round(REST_S / log.sample_time_s))
    speed = _speeds(log, n)
    noise = position_noise_std([log]) / (log.sample_time_s * n)
    still = np.all(speed <= STANDS * speed.max(axis=0) + NOISES * noise, axis=1)
    if log.velocity_ref_rad_s is not None:
        told = np.abs(log.velocity_ref_rad_s)
        told = scipy.ndimage.maximum_filter1d(told, n, axis=0, mode="nearest")
        still &= np.all(told <= STANDS * told.max(axis=0), axis=1)
    return np.asarray(still)


def _speeds(log: Log, n: int) -> Array:
    """Return the mean speed (n_samples, n_axes) over ``n`` samples around each sample."""
    mean = scipy.ndimage.uniform_filter1d(
        np.gradient(log.position_rad, log.sample_time_s, axis=0), n, axis=0, mode="nearest"
    )
    # At the ends, the mean speed of the nearest full window.
    half = n // 2
    mean[:half], mean[-half:] = mean[half], mean[-half - 1]
    return np.abs(mean)


def _part(log: Log, start_s: float, stop_s: float | None) -> Log:
    """Return the part of a log between ``--from`` and ``--to`` [s]; raises InputError naming these options."""
    if (start_s, stop_s) == (0.0, None):
        return log
    try:
        return log.part(start_s, stop_s)
    except InputError as error:
        text = str(error).replace("start_s", "--from").replace("stop_s", "--to")
        raise InputError(f"{log.source}: {text}") from None
