"""Brings runs of one motion to a common start, and refuses runs of different motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.arguments import counted
from axisight.errors import InputError
from axisight.logs import Log, check_same_rate, differentiate

Array = NDArray[np.float64]
Whole = NDArray[np.intp]

# Largest rms difference of positions from those of the first run, as a share of the axis' range. Controllers
# repeat a motion to 0.1 %.
SAME_POSITION = 0.01
# Largest rms difference of speeds, as a share of the axis' range of speeds. Multisines on one square wave have
# similar positions; only their speeds tell them apart.
SAME_SPEED = 0.02
# An axis with a smaller range, as a share of the largest range, stands still: its noise is no motion.
_STANDS = 1e-3
# Mean square difference of speeds, relative to their mean square, at which two lags fit equally well; and the
# factor on the least difference at which noise decides between them.
_ALIKE, _TIED = 1e-4, 2.0
# Least common part of the shortest run.
_LEAST_COMMON = 0.8


@dataclass(frozen=True, eq=False)
class AlignedRuns:
    """Runs of one motion with a common start and length.

    logs
        The common part of every run; sample k of all runs is the same point of the motion.
    shift
        First sample of the common part in each run as it was logged (n_runs,).
    difference
        Rms difference of the positions from those of the first run, as a share of the range of the axis
        (n_runs, n_axes); zero for axes that stand still.
    """

    logs: tuple[Log, ...]
    shift: Whole
    difference: Array

    @property
    def sample_time_s(self) -> float:
        """Sample time [s]."""
        return self.logs[0].sample_time_s

    def signal(self, field: str) -> Array:
        """Return a signal of all runs, (n_runs, n_samples, n_axes)."""
        return np.stack([getattr(log, field) for log in self.logs])


def align(logs: Sequence[Log], *, cutoff_hz: float = 10.0) -> AlignedRuns:
    """Return the common part of runs of one motion, aligned to whole samples.

    The speed references decide the shift if all runs have them, else the measured speeds, low-passed at
    ``cutoff_hz`` [Hz]. Runs count as one motion if positions agree within 1 % and speeds within 2 % of the
    range of the axis (rms), at every axis that moves.

    Raises InputError for fewer than two runs, different numbers or kinds of axes, logs without torque, one
    log given twice, different motions, and runs that share less than 80 % of the shortest. Raises LogError
    for different sample rates.
    """
    _check_alike(logs)
    speed = [_speed(log, cutoff_hz) for log in logs]
    referenced = all(log.velocity_ref_rad_s is not None for log in logs)
    guide = [log.velocity_ref_rad_s for log in logs] if referenced else speed
    lag = np.array([_lag(guide[0], one) for one in guide])  # type: ignore[arg-type]
    first = max(0, int((-lag).max()))
    last = min(log.n_samples - int(k) for log, k in zip(logs, lag, strict=True))
    shortest = min(log.n_samples for log in logs)
    if last - first < _LEAST_COMMON * shortest:
        raise InputError(
            f"logs: expected runs of one motion that share {100 * _LEAST_COMMON:g} % of the shortest, got "
            f"{100 * max(last - first, 0) / shortest:.3g} % after alignment; cut them to the motion with "
            "--from, --to or --moving"
        )
    parts = [slice(first + int(k), last + int(k)) for k in lag]
    cut = tuple(_part(log, part) for log, part in zip(logs, parts, strict=True))
    difference = _compared(cut, [v[part] for v, part in zip(speed, parts, strict=True)])
    return AlignedRuns(cut, first + lag, difference)


def _check_alike(logs: Sequence[Log]) -> None:
    if len(logs) < 2:
        raise InputError(f"logs: expected two runs or more, got {counted(len(logs), 'run')}")
    check_same_rate(logs)
    for log in logs:
        if log.n_axes != logs[0].n_axes or log.axis_kinds != logs[0].axis_kinds:
            raise InputError(
                f"{log.name}: expected the {counted(logs[0].n_axes, 'axis', 'axes')} of {logs[0].name}, got "
                f"{counted(log.n_axes, 'axis', 'axes')} ({', '.join(log.axis_kinds)})"
            )
        if not log.has_torque:
            raise InputError(f"{log.name}: torque: expected a logged torque, got none")
    for i, log in enumerate(logs):
        for other in logs[:i]:
            if np.array_equal(log.torque_nm, other.torque_nm):
                raise InputError(
                    f"logs: expected different runs, got {_named(log)} with the torque of {_named(other)}"
                )


def _named(log: Log) -> str:
    return "/".join(Path(log.source).parts[-2:]) or log.name


def _speed(log: Log, cutoff_hz: float) -> Array:
    if not 0.0 < cutoff_hz < 0.5 * log.sample_rate_hz:
        raise InputError(
            f"cutoff_hz: expected between 0 and the Nyquist frequency {0.5 * log.sample_rate_hz:g} Hz, "
            f"got {cutoff_hz:g}"
        )
    return differentiate(log.position_rad, log.sample_time_s, cutoff_hz)[0]


def _lag(guide: Array, other: Array) -> int:
    """Return the lag k of ``other``: its sample n + k is sample n of the ``guide``.

    The mean square difference over the overlap is least there. Of the lags of a periodic motion, at which it
    is about as small, the smallest counts.
    """
    size = np.sqrt(np.mean(guide**2, axis=0))
    moves = np.flatnonzero(size > _STANDS * size.max())
    lags, apart = _differences(guide[:, moves] / size[moves], other[:, moves] / size[moves])
    near = np.flatnonzero(apart <= max(_ALIKE * len(moves), _TIED * float(apart.min())))
    at = int(near[np.argmin(np.abs(lags[near]))])
    for step in (-1, 1):
        while 0 <= at + step < len(lags) and apart[at + step] < apart[at]:
            at += step
    return int(lags[at])


def _differences(one: Array, two: Array) -> tuple[Whole, Array]:
    """Return lags whose overlap is half of the shorter signal or more, and mean square differences there."""
    n, m = len(one), len(two)
    lags = np.arange(1 - n, m)
    first, last = np.maximum(0, -lags), np.minimum(n, m - lags)
    product = sum(
        scipy.signal.correlate(two[:, i], one[:, i], method="fft") for i in range(one.shape[1])
    )
    a, b = (np.append(0.0, np.cumsum(np.sum(x**2, axis=1))) for x in (one, two))
    squares = a[last] - a[first] + b[last + lags] - b[first + lags] - 2.0 * product
    wide = last - first >= 0.5 * min(n, m)
    return lags[wide], squares[wide] / (last - first)[wide]


def _part(log: Log, part: slice) -> Log:
    """Return the samples of a log in a slice, with time from zero."""
    if (part.start, part.stop) == (0, log.n_samples):
        return log
    return log.part(part.start * log.sample_time_s, part.stop * log.sample_time_s)


def _compared(logs: Sequence[Log], speeds: Sequence[Array]) -> Array:
    """Return the differences of positions from the first run; raise InputError for another motion."""
    position = [log.position_rad for log in logs]
    scale = _ranges(position[0])
    fast = _ranges(speeds[0])
    off = np.array([_rms(p - position[0]) / scale for p in position])
    off_speed = np.array([_rms(v - speeds[0]) / fast for v in speeds])
    for i, (log, p, v) in enumerate(zip(logs, off, off_speed, strict=True)):
        if (p <= SAME_POSITION).all() and (v <= SAME_SPEED).all():
            continue
        axis = int(np.argmax(np.maximum(p / SAME_POSITION, v / SAME_SPEED)))
        raise InputError(
            f"{_named(log)}: expected the motion of {_named(logs[0])}, got another one: on axis {axis + 1} "
            f"positions differ by {100 * p[axis]:.3g} % and speeds by {100 * v[axis]:.3g} % of the range (rms), "
            f"more than {100 * SAME_POSITION:g} % or {100 * SAME_SPEED:g} % "
            f"(run {i + 1} of {len(logs)}). Compare runs of one motion only"
        )
    return off


def _rms(x: Array) -> Array:
    return np.asarray(np.sqrt(np.mean(x**2, axis=0)))


def _ranges(x: Array) -> Array:
    """Return the range of each axis (n_axes,), infinite for axes that stand still."""
    span = np.ptp(x, axis=0)
    return np.where(span > _STANDS * span.max(), span, np.inf)
