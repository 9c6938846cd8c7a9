"""Motions of a case's logs, by the name of a plan; motors turn at up to 55 rad/s."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from axisight.blind.case_files import moves
from axisight.robot import Robot

Array = NDArray[np.float64]
References = dict[str, tuple[str, Array]]

_SECONDS = 10.0
# Duration of a short log.
_SHORT_S = 6.0


def multisines(rng: np.random.Generator, robot: Robot) -> References:
    """Return role and velocity reference (n, n_axes) [rad/s] of every log by name: mostly multisines."""
    time = _times(robot, _SECONDS)
    axes = robot.n_axes
    top, fresh = _speeds(rng, axes, 40.0, 55.0), _speeds(rng, axes, 30.0, 55.0)
    out: References = {}
    for axis in range(axes):
        loud: Array = 8.0 * np.eye(axes)[axis]
        out[f"multisine_axis{axis + 1}"] = ("estimation", _multisine(rng, time, loud))
    out["multisine_half"] = ("estimation", _multisine(rng, time, np.full(axes, 4.0), 0.5))
    out["triangle"] = ("estimation", _triangle(time, 0.55 * np.abs(top)))
    out["moves"] = ("estimation", moves(time, _SECONDS, top))
    out["multisine_fresh"] = ("validation", _multisine(rng, time, np.full(axes, 4.0), 0.7))
    out["moves_fresh"] = ("validation", moves(time, _SECONDS, fresh))
    return out


def point_to_point(rng: np.random.Generator, robot: Robot) -> References:
    """Return logs of moves and triangles only, as in production."""
    time, axes = _times(robot, _SECONDS), robot.n_axes
    out: References = {}
    for k, (low, high) in enumerate(((40.0, 55.0), (15.0, 30.0), (25.0, 55.0), (5.0, 15.0)), 1):
        top = _speeds(rng, axes, low, high)
        out[f"moves_{k}"] = ("estimation", moves(time, _SECONDS, top))
    out["triangle"] = ("estimation", _triangle(time, _speeds(rng, axes, 20.0, 30.0)))
    fresh = _speeds(rng, axes, 20.0, 50.0)
    out["moves_fresh"] = ("validation", moves(time, _SECONDS, fresh))
    out["triangle_fresh"] = ("validation", _triangle(time, _speeds(rng, axes, 15.0, 30.0)))
    return out


def slow_and_short(rng: np.random.Generator, robot: Robot) -> References:
    """Return short logs of slow sines, some with weak chirps."""
    time, axes = _times(robot, _SHORT_S), robot.n_axes
    out: References = {}
    for k in range(1, 5):
        slow = _slow_sine(rng, time, axes)
        weak = _chirp(rng, time, axes) if k % 2 else np.zeros_like(slow)
        out[f"slow_{k}"] = ("estimation", slow + weak)
    out["slow_fresh"] = ("validation", _slow_sine(rng, time, axes) + _chirp(rng, time, axes))
    return out


MOTIONS: Mapping[str, Callable[[np.random.Generator, Robot], References]] = {
    "multisines": multisines,
    "moves": point_to_point,
    "slow_and_short": slow_and_short,
}
"""Plans by name."""


def _times(robot: Robot, seconds: float) -> Array:
    n = round(seconds / robot.sample_time_s)
    return np.asarray(np.arange(n, dtype=np.float64) * robot.sample_time_s)


def _speeds(rng: np.random.Generator, axes: int, low: float, high: float) -> Array:
    """Draw speeds either way [rad/s]."""
    return np.asarray(rng.uniform(low, high, axes) * rng.choice(np.array([-1.0, 1.0]), axes))


def _slow_sine(rng: np.random.Generator, time: Array, axes: int) -> Array:
    """Return one or two slow turns there and back on every axis, from rest."""
    turns = rng.choice([1.0, 2.0], axes)
    angle = 2 * np.pi * np.outer(time / _SHORT_S, turns)
    return np.asarray(np.sin(angle) * _speeds(rng, axes, 20.0, 45.0))


def _chirp(rng: np.random.Generator, time: Array, axes: int) -> Array:
    """Return weak chirps from 1 to 20 Hz, shifted in time and phase between axes."""
    rate = (20.0 - 1.0) / _SHORT_S
    phases = 2 * np.pi * (1.0 * time + 0.5 * rate * time**2)
    wave = np.sin(phases[:, None] + rng.uniform(0, 2 * np.pi, axes))
    return np.asarray(2.5 * wave * np.minimum(time / 0.1, 1.0)[:, None])


def _multisine(rng: np.random.Generator, time: Array, loud: Array, share: float = 1.0) -> Array:
    """Return random-phase multisines from 1 to 40 Hz on square waves, which keep the motors turning."""
    lines = np.arange(1.0, 40.0, 1.0 / _SECONDS)
    out = np.empty((len(time), len(loud)))
    square = np.tanh(20 * np.sin(2 * np.pi * time / 5.0))
    for axis, size in enumerate(loud):
        phases = rng.uniform(0, 2 * np.pi, len(lines))
        wave = _cosines(time, lines, phases)
        out[:, axis] = share * 9.6 * square + size * wave / np.abs(wave).max()
    return np.asarray(out * np.minimum(time / 0.1, 1.0)[:, None])


def _cosines(time: Array, frequency_hz: Array, phases: Array) -> Array:
    """Return the sum of cosines (n,) at equally spaced times from zero.

    A product of two exponentials, one per block and one within a block, needs 2 sqrt(n) terms per frequency,
    not n.
    """
    n, step = len(time), time[1] - time[0]
    length = int(np.sqrt(n)) + 1
    turn = 2j * np.pi * frequency_hz
    first = np.exp(np.outer(step * length * np.arange(-(-n // length)), turn) + 1j * phases)
    within = np.exp(np.outer(turn, step * np.arange(length)))
    return np.asarray((first @ within).real.ravel()[:n])


def _triangle(time: Array, top: Array) -> Array:
    phase = (time / 5.0 + 0.25) % 1.0
    wave = 4 * np.abs(phase - 0.5) - 1
    return np.asarray(-wave[:, None] * top)
