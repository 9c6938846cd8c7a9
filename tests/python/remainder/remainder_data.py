"""Motions of two axes with a known missing torque."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from axisight.remainder import Motion, Record

Array = NDArray[np.float64]

RATE_HZ = 100.0


def motion(seed: int, *, run_s: float = 20.0, temperature: bool = False) -> Motion:
    """Sums of sines on both axes; the speeds reach a few rad/s."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(run_s * RATE_HZ)) / RATE_HZ
    position, velocity, acceleration = (np.zeros((len(t), 2)) for _ in range(3))
    for axis in range(2):
        for hz in rng.uniform(0.1, 0.6, 4):
            w, phase = 2 * np.pi * hz, rng.uniform(0, 2 * np.pi)
            position[:, axis] += np.sin(w * t + phase)
            velocity[:, axis] += w * np.cos(w * t + phase)
            acceleration[:, axis] -= w**2 * np.sin(w * t + phase)
    load = 3 * np.cos(position) + 0.2 * acceleration
    celsius = np.tile(20 + 10 * rng.uniform() + 0.3 * t[:, None], (1, 2)) if temperature else None
    return Motion(
        name=f"run {seed}",
        time_s=t,
        position_rad=position,
        velocity_rad_s=velocity,
        acceleration_rad_s2=acceleration,
        load_nm=load,
        temperature_c=celsius,
    )


def records(
    missing: Callable[[Motion], Array], *, noise_nm: float = 0.1, runs: int = 3, seed: int = 0
) -> list[Record]:
    """Records whose first axis lacks a torque (n,) [Nm]; white noise on both axes."""
    out = []
    for run in range(runs):
        rng = np.random.default_rng([seed, run])
        at = motion(10 * seed + run)
        residual = rng.normal(0, noise_nm, at.position_rad.shape)
        residual[:, 0] += missing(at)
        out.append(Record(motion=at, residual_nm=residual))
    return out
