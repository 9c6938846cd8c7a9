"""Motions for an experiment: velocity references from rest to rest, of one axis or all.

No motion exceeds the speed, travel or torque that the logs show, unless the user gives other limits.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.excitation import multisine, square
from axisight.gap.separate.limits import Range
from axisight.logs import Log

Array = NDArray[np.float64]

# Length of an experiment [s]: some periods of the slowest motion, and short enough to repeat.
SECONDS = 8.0
# Band of the standard multisine [Hz], and the share of the Nyquist frequency that limits it.
_BAND_HZ = (1.0, 40.0)
_SHARE_OF_NYQUIST = 0.8
# Speeds at which a motion is tried, as shares of the largest.
_LEVELS = (1.0, 0.6, 0.3, 0.1)
# Time over which a motion fades in and out [s].
_FADE_S = 0.1


@dataclass(frozen=True, eq=False)
class Motion:
    """A motion to try: ``reference`` (n, n_axes) [rad/s], motor side; ``axes`` (from 1) that move.

    ``start`` (n_axes,): the motors at its start [rad]; None for the start that most motions share.
    """

    words: str
    axes: tuple[int, ...]
    reference: Array
    start: Array | None = None


def seen_range(logs: Sequence[Log]) -> Range:
    """Return the range of the motors in logs with velocity references, from where each log begins.

    Accelerations have no limit: those of the references are steps.
    """
    speeds, turned = [], []
    for log in logs:
        assert log.velocity_ref_rad_s is not None  # closed loop only
        speeds.append(np.abs(log.velocity_ref_rad_s).max(axis=0))
        turned.append(log.position_rad - log.position_rad[0])
    speed = np.max(speeds, axis=0)
    return Range(
        speed,
        np.min([x.min(axis=0) for x in turned], axis=0),
        np.max([x.max(axis=0) for x in turned], axis=0),
        np.max([np.abs(log.torque_nm).max(axis=0) for log in logs], axis=0),
        np.full(len(speed), np.inf),
    )


def standard(seen: Range, sample_time_s: float, seed: int) -> list[Motion]:
    """Return the standard identification motion at several levels: a multisine on a square wave, on all axes.

    Lower levels are tried because the largest needs too much torque on some machines.
    """
    n_axes = len(seen.speed)
    waves = [_shapes(sample_time_s, seed + 1 + i, 0.0)["a multisine"] for i in range(n_axes)]
    shape = np.stack(waves, axis=1)
    full, every = _within(shape, seen, sample_time_s), tuple(range(1, n_axes + 1))
    return [Motion("A multisine", every, level * full) for level in _LEVELS]


def motions(
    seen: Range, axes: Sequence[int], sample_time_s: float, widest_hz: float, seed: int
) -> Iterator[Motion]:
    """Yield the motions to try: every shape at every level, on each of ``axes`` (from 1) alone and on all axes."""
    n_axes = len(seen.speed)
    every = tuple(range(1, n_axes + 1))
    moved = [(a,) for a in axes] + ([every] if n_axes > 1 else [])
    for which in moved:
        each = [_shapes(sample_time_s, seed + a, widest_hz) for a in every]
        for words in each[0]:
            shape = np.stack(
                [
                    s[words] if a in which else 0 * s[words]
                    for a, s in zip(every, each, strict=True)
                ],
                axis=1,
            )
            full = _within(shape, seen, sample_time_s)
            for level in _LEVELS:
                share = "" if level == 1 else f" at {100 * level:.0f} % of the largest speed"
                yield Motion(f"{words[0].upper()}{words[1:]}{share}", which, level * full)


def _shapes(sample_time_s: float, seed: int, widest_hz: float) -> Mapping[str, Array]:
    """Return shapes (n,) of unit peak and zero mean, by their description."""
    n = round(SECONDS / sample_time_s)
    n -= n % 8
    time = np.arange(n) * sample_time_s
    period = n * sample_time_s
    flat = square(period, sample_time_s).period
    low, top = _BAND_HZ
    band = (low, min(top, _SHARE_OF_NYQUIST * 0.5 / sample_time_s))
    sine = multisine(period, sample_time_s, band_hz=band, seed=seed).period
    out = {"a multisine": _unit(_unit(sine) + flat)}
    if not widest_hz:
        return out
    wide = multisine(period, sample_time_s, band_hz=(1.0, widest_hz), seed=seed).period
    high = multisine(period, sample_time_s, band_hz=(0.6 * widest_hz, widest_hz), seed=seed).period
    slow = np.interp(time / period, [0, 0.02, 0.48, 0.52, 0.98, 1], [0, 1, 1, -1, -1, 0])
    speeds = np.repeat([1.0, -1.0, 0.5, -0.5, 0.25, -0.25, 0.1, -0.1], n // 8)
    swing = np.sin(2 * np.pi * time / period * 2) * np.abs(np.sin(np.pi * time / period))
    steps = np.repeat([1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0, 0.0], n // 8)
    louder = np.repeat([0.1, 0.1, 0.3, 0.3, 0.3, 1.0, 1.0, 1.0], n // 8) * out["a multisine"]
    out |= {
        # Multisines ride on a square wave. The friction of a motor that trembles around rest is uncertain, so
        # such data have little weight.
        "a wide multisine": _unit(_unit(wide) + flat),
        "a multisine of high frequencies": _unit(_unit(high) + flat),
        "a multisine that grows": _unit(louder),
        "one turn each way at constant speed": slow,
        "constant speeds both ways": _smooth(speeds, sample_time_s),
        "slow swings": _unit(swing),
        "moves between poses with rests": _smooth(steps, sample_time_s),
    }
    fade = np.minimum(1.0, np.minimum(time, period - time) / _FADE_S)
    faded = {words: fade * wave for words, wave in out.items()}
    # Subtract the mean, so that each motion ends where it began.
    return {words: _unit(wave - fade * wave.sum() / fade.sum()) for words, wave in faded.items()}


def _smooth(steps: Array, sample_time_s: float) -> Array:
    """Return steps rounded over 0.05 s."""
    width = round(0.05 / sample_time_s)
    return np.convolve(steps, np.ones(width) / width, mode="same")


def _unit(wave: Array) -> Array:
    return np.asarray(wave / np.abs(wave).max())


def _within(shape: Array, seen: Range, sample_time_s: float) -> Array:
    """Return a shape (n, n_axes), scaled to the largest size of either sign within speed and travel."""
    turned = np.cumsum(shape, axis=0) * sample_time_s
    sizes = []
    for sign in (1.0, -1.0):
        low, high = (sign * turned).min(axis=0), (sign * turned).max(axis=0)
        by_travel = np.minimum(
            seen.forth / np.maximum(high, 1e-12), -seen.back / np.maximum(-low, 1e-12)
        )
        sizes.append(sign * np.minimum(seen.speed, np.maximum(by_travel, 0.0)))
    best = np.where(np.abs(sizes[0]) >= np.abs(sizes[1]), sizes[0], sizes[1])
    return np.asarray(shape * best)
