"""Smooth motions for an experiment: positions over time within limits of travel, velocity and acceleration.

Controllers of positions follow them, and inverse dynamics needs their accelerations.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from axisight.gap.separate.limits import Range
from axisight.gap.separate.waves import Motion

Array = NDArray[np.float64]

# Length of an experiment [s]: that of the longest log within these limits.
_SECONDS = (8.0, 20.0)
# Sizes and speeds at which a motion is tried, as shares of the largest.
_LEVELS = (1.0, 0.4, 0.1)
# Slow speeds of triangles, as shares of the largest.
_SLOW = (0.2, 0.05)
# Longest time that triangles take for the whole travel [s], and the time for rounded corners relative to sharp ones.
_LONGEST_S, _ROUNDING = 60.0, 1.1
# Highest frequency of a sum of sines, as shares of the highest that is compared.
_BANDS = (1.0, 0.4, 0.15)
# Smallest number of sines in a sum, and the largest.
_SINES = (5, 40)
# Share of the motion in which sines fade in and out, each.
_FADE = 0.1
# Time over which a change of speed is spread [s], and its largest share of the motion.
_TURN_S, _TURN_SHARE = 0.4, 0.04
# Speeds of the staircase, as shares of the largest; each is held both ways.
_STAIRS = (1.0, 0.5, 0.25, 0.1)
# Poses between which a joint moves and rests, as shares of its travel.
_PLACES = (1.0, 1.0, -1.0, -1.0, 0.5, 0.5, -0.5, -0.5)
# Change of the sines of a motion when it is improved, relative to their size.
_CHANGE = 0.5


@dataclass(frozen=True)
class Room:
    """What all motions of an experiment share: limits, time between samples, length [s], highest frequency [Hz]."""

    limits: Range
    step_s: float
    seconds: float
    widest_hz: float

    @property
    def n_samples(self) -> int:
        """Number of samples of a motion."""
        return round(self.seconds / self.step_s)

    @property
    def n_axes(self) -> int:
        """Number of motors."""
        return len(self.limits.speed)

    @property
    def every(self) -> tuple[int, ...]:
        """All axes (from 1)."""
        return tuple(range(1, self.n_axes + 1))


@dataclass(frozen=True, eq=False)
class SumOfSines(Motion):
    """A motion of sines (Swevers et al. 1997): ``sines`` (n_axes, n_sines, 2), sizes of cosine and sine.

    ``level``: size as a share of the largest within the limits.
    """

    sines: Array = field(default_factory=lambda: np.empty((0, 0, 2)))
    level: float = 1.0


def centred(seen: Range) -> tuple[Range, Array]:
    """Return a range seen from the middle of its travel, and how far the middle is from the start [rad] (n_axes,)."""
    half = 0.5 * (seen.forth - seen.back)
    return replace(seen, back=-half, forth=half), 0.5 * (seen.forth + seen.back)


def length_s(longest_log_s: float) -> float:
    """Return the length of an experiment [s]."""
    return float(np.clip(longest_log_s, *_SECONDS))


def courses(room: Room, axes: Sequence[int], seed: int) -> Iterator[Motion]:
    """Yield the motions to try: every shape at every level, on each of ``axes`` (from 1) alone and on all axes."""
    moved = [(a,) for a in axes] + ([room.every] if room.n_axes > 1 else [])
    for which in moved:
        for band in _BANDS:
            yield from _sums(room, which, band, seed)
        for level in _LEVELS:
            for words, speed in _turning(room).items():
                yield _made(
                    f"{words}{_at(level)}", which, np.tile(speed, (room.n_axes, 1)), room, level
                )
        for level in _SLOW:
            yield triangles(room, which, level)


def triangles(room: Room, axes: Sequence[int], level: float = _SLOW[0]) -> Motion:
    """Return triangles of position at a share ``level`` of the largest speed, on ``axes`` (from 1)."""
    speed = np.tile(_triangle(room), (room.n_axes, 1))
    return _made(f"Slow triangles{_at(level)}", axes, speed, room, level)


def whole_travel(room: Room) -> Motion:
    """Return slow triangles of all axes, as long as the whole travel takes, at most 60 s."""
    limits, level = room.limits, _SLOW[0]
    speed = np.maximum(level * limits.speed, 1e-12)
    quarter_s = float(np.max(np.minimum(limits.forth, -limits.back) / speed))
    seconds = float(np.clip(_ROUNDING * 4 * quarter_s, _SECONDS[0], _LONGEST_S))
    longer = replace(room, seconds=seconds)
    course = np.tile(_triangle(longer), (room.n_axes, 1))
    # The full size fits the travel in this time; where time is short, the speed stays at its level.
    slow = replace(longer, limits=replace(limits, speed=speed))
    return _made("Slow triangles", room.every, course, slow, 1.0)


def _sums(room: Room, axes: Sequence[int], band: float, seed: int) -> Iterator[SumOfSines]:
    """Yield a sum of sines of random phases at every level; ``band``: share of the highest frequency."""
    count = int(np.clip(band * room.widest_hz * room.seconds, *_SINES))
    rng = np.random.default_rng([seed, count])
    phase = rng.uniform(0.0, 2 * np.pi, (room.n_axes, count))
    # Sizes that fall with frequency keep speed and acceleration alike over the band.
    size = 1.0 / (1.0 + np.arange(count))
    sines = size[:, None] * np.stack([np.cos(phase), np.sin(phase)], axis=-1)
    for level in _LEVELS:
        yield _summed(room, axes, sines, level)


def _summed(room: Room, axes: Sequence[int], sines: Array, level: float) -> SumOfSines:
    count = sines.shape[1]
    time = np.arange(room.n_samples + 1) / room.n_samples
    turns = 2 * np.pi * np.outer(np.arange(1, count + 1), time)
    course = sines[..., 0] @ np.cos(turns) + sines[..., 1] @ np.sin(turns)
    fade = np.clip(np.minimum(time, 1.0 - time) / _FADE, 0.0, 1.0)
    # A quintic fade has no steps of acceleration.
    course = course * fade**3 * (10 - 15 * fade + 6 * fade**2)
    words = f"A sum of {count} sines up to {count / room.seconds:.2g} Hz{_at(level)}"
    made = _made(words, axes, np.diff(course, axis=1) / room.step_s, room, level)
    return SumOfSines(made.words, made.axes, made.reference, None, sines, level)


def improved(best: Motion, room: Room, count: int, rng: np.random.Generator) -> list[Motion]:
    """Return ``count`` motions like a sum of sines, with changed sizes and phases; none for another motion."""
    if not isinstance(best, SumOfSines):
        return []
    size = np.linalg.norm(best.sines, axis=-1, keepdims=True)
    changed = (
        best.sines + _CHANGE * size * rng.standard_normal(best.sines.shape) for _ in range(count)
    )
    return [_summed(room, best.axes, sines, best.level) for sines in changed]


def _turning(room: Room) -> dict[str, Array]:
    """Return speeds (n,) of unit size whose integral ends at zero, by the description of the motion."""
    n = room.n_samples
    places = np.concatenate([[0.0], _PLACES, [0.0]])
    moves = np.diff(places)
    steps = np.repeat(moves, n // len(moves))
    stairs = np.repeat([s for x in _STAIRS for s in (x, -x)], n // (2 * len(_STAIRS)))
    shapes = {
        "Constant speeds both ways": np.pad(stairs, (0, n - len(stairs))),
        "Moves between poses with rests": np.pad(steps, (0, n - len(steps))),
        "Triangles": _triangle(room),
    }
    return {words: _rounded(x, room) for words, x in shapes.items()}


def _triangle(room: Room) -> Array:
    """Return the speed (n,) of one triangle of position to either side, of unit size."""
    n = room.n_samples
    quarter = n // 4
    speed = np.repeat([1.0, -1.0, -1.0, 1.0], quarter)
    return _rounded(np.pad(speed, (0, n - len(speed))), room)


def _rounded(speed: Array, room: Room) -> Array:
    """Return a course of speed with smooth changes, which begins and ends at rest and where it began."""
    width = round(min(_TURN_S, _TURN_SHARE * room.seconds) / room.step_s)
    if width < 2:
        return speed
    window = np.hanning(width + 2)[1:-1]
    window /= window.sum()
    still = max(1, len(speed) - 2 * width)
    # Squeezed, so that the smooth changes at both ends fit in.
    squeezed = np.interp(np.linspace(0, len(speed) - 1, still), np.arange(len(speed)), speed)
    smooth = np.convolve(np.pad(squeezed, width), window, mode="same")[: len(speed)]
    smooth = np.pad(smooth, (0, len(speed) - len(smooth)))
    shape = np.abs(smooth)
    return np.asarray(smooth - shape * smooth.sum() / shape.sum())


def _made(words: str, axes: Sequence[int], speed: Array, room: Room, level: float) -> Motion:
    """Return a motion of speeds (n_axes, n), scaled to the limits; ``level``: share of the largest size."""
    reference = np.zeros((room.n_samples, room.n_axes))
    for axis in axes:
        reference[:, axis - 1] = level * _scaled(speed[axis - 1], room, axis - 1)
    return Motion(words, tuple(axes), reference)


def _scaled(speed: Array, room: Room, axis: int) -> Array:
    """Return the speed (n,) of one axis (from 0) at the largest size of either sign within its limits."""
    limits = room.limits
    turned = np.cumsum(speed) * room.step_s
    acceleration = np.abs(np.diff(speed, prepend=0.0, append=0.0)).max() / room.step_s
    least = min(
        limits.speed[axis] / max(np.abs(speed).max(), 1e-12),
        limits.acceleration[axis] / max(acceleration, 1e-12),
    )
    sizes = []
    for sign in (1.0, -1.0):
        low, high = (sign * turned).min(), (sign * turned).max()
        by_travel = min(
            limits.forth[axis] / max(high, 1e-12), -limits.back[axis] / max(-low, 1e-12)
        )
        sizes.append(sign * min(least, max(by_travel, 0.0)))
    return np.asarray(speed * max(sizes, key=abs))


def _at(level: float) -> str:
    return "" if level == 1 else f" at {100 * level:.0f} % of the largest size"
