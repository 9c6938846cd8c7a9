"""Records of a two-mass axis, for tests of its fits."""

from __future__ import annotations

import numpy as np

from axisight.graybox import AxisData, AxisModel

RATIO = 1 / 224.3
SAMPLE_S = 5e-4
# Wernholt (2004), Table 9.1: model m3 and the initial model m0.
TRUTH = {
    "J_m": 0.0121,
    "J_a": 1130.0,
    "k1": 1.46e6,
    "k3": 3.72e10,
    "d": 2630.0,
    "F_v": 0.013,
    "F_c": 0.644,
}
START = {
    "J_m": 0.0123,
    "J_a": 790.0,
    "k1": 0.814e6,
    "k3": 5.4e10,
    "d": 0.0,
    "F_v": 0.0136,
    "F_c": 0.642,
}
TWO = AxisModel(gear_ratio=RATIO)


def torque(n: int, seed: int, size: float = 6.0, hold: int = 40) -> np.ndarray:
    """Return steps of random height; the motor turns both ways and stands at times."""
    heights = np.random.default_rng(seed).normal(size=-(-n // hold))
    return size * np.repeat(heights, hold)[:n]


def record(
    model: AxisModel = TWO,
    truth: dict[str, float] = TRUTH,
    n: int = 3000,
    seed: int = 0,
    noise: np.ndarray | float = 0.0,
    **options: object,
) -> AxisData:
    """Return a simulated record with noise added to the output."""
    u = torque(n, seed, **options)
    y = model.simulate(truth, u, SAMPLE_S).output.values + noise
    key = "position_rad" if model.output == "position" else "velocity_rad_s"
    return AxisData(u, sample_time_s=SAMPLE_S, **{key: y})
