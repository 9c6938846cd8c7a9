"""Velocity references of short logs: multisines, moves between poses, triangle waves."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

LENGTH_S = 4.5
REST_S = 0.15


def multisine(rng: np.random.Generator, arm, share: float, first: int | None) -> np.ndarray:
    """Return a multisine of every axis, samples first [rad/s]; axis ``first`` moves twice as much.

    The axes share no frequency. Positions return to where they began.
    """
    time = np.arange(round(LENGTH_S / arm.sample_time_s)) * arm.sample_time_s
    base = 1 / (LENGTH_S - 2 * REST_S)
    orders = np.unique(np.round(np.geomspace(1, 14 / base, 10 * len(arm.driven))))
    out = np.zeros((len(time), len(arm.driven)))
    inside = (time > REST_S) & (time < LENGTH_S - REST_S)
    ramp = np.clip(np.minimum(time - REST_S, LENGTH_S - REST_S - time) / 0.3, 0, 1)
    for axis, top in enumerate(arm.top_speed_rad_s):
        mine = orders[axis :: len(arm.driven)]
        phases = rng.uniform(0, 2 * np.pi, len(mine))
        waves = np.sin(2 * np.pi * base * np.outer(time - REST_S, mine) + phases) @ (
            1 / (1 + mine * base / 2.0)
        )
        waves *= inside * np.sin(np.pi / 2 * ramp) ** 2
        size = share * (1.0 if first in (None, axis) else 0.5)
        out[:, axis] = size * top * waves / np.abs(waves).max()
    return out


def moves(rng: np.random.Generator, arm, share: float) -> np.ndarray:
    """Return three smooth moves of all axes together, the last one back [rad/s]."""
    period = arm.sample_time_s
    n = round(LENGTH_S / period)
    out = np.zeros((n, len(arm.driven)))
    starts = np.linspace(REST_S, LENGTH_S - REST_S, 4)
    place = np.zeros(len(arm.driven))
    for number, (begin, end) in enumerate(pairwise(starts)):
        length = end - begin - 0.1
        reach = share * arm.top_speed_rad_s * length / 1.875
        goal = np.zeros_like(place) if number == 2 else rng.uniform(-0.7, 0.7, len(place)) * reach
        way = np.clip(goal - place, -reach, reach)
        place = place + way
        s = np.clip((np.arange(n) * period - begin) / length, 0, 1)
        out += np.outer(30 * s**2 * (1 - s) ** 2 / length, way)
    return out


def triangles(rng: np.random.Generator, arm, share: float) -> np.ndarray:
    """Return slow constant speeds back and forth with rounded corners [rad/s]."""
    period = arm.sample_time_s
    time = np.arange(round(LENGTH_S / period)) * period
    out = np.zeros((len(time), len(arm.driven)))
    ramp = np.clip(np.minimum(time - REST_S, LENGTH_S - REST_S - time) / 0.2, 0, 1)
    for axis, top in enumerate(arm.top_speed_rad_s):
        frequency = rng.uniform(0.45, 1.2)
        wave = np.tanh(12 * np.sin(2 * np.pi * frequency * (time - REST_S) + rng.uniform(-1, 1)))
        out[:, axis] = share * rng.uniform(0.12, 0.3) * top * wave * ramp
    return out


def plan(rng: np.random.Generator, arm) -> list[tuple[str, str, np.ndarray]]:
    """Return the logs of a case: file name, role and references."""
    axes = len(arm.driven)
    strong = int(rng.integers(axes))
    return [
        ("multisine", "estimation", multisine(rng, arm, 1.0, None)),
        ("multisine_half", "estimation", multisine(rng, arm, 0.5, strong)),
        ("moves", "estimation", moves(rng, arm, 0.8)),
        ("triangles", "estimation", triangles(rng, arm, 1.0)),
        ("multisine_fresh", "validation", multisine(rng, arm, 0.9, None)),
        ("moves_fresh", "validation", moves(rng, arm, 0.8)),
    ]
