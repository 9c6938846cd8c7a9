"""The floor: what sensor noise leaves in the torque, and the weight of residuals it implies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.fitting import Weighting
from axisight.gap.settings import Settings
from axisight.logs import Log
from axisight.robot import Robot
from axisight.simulation import simulate, white_noise

Array = NDArray[np.float64]

_SEGMENT = 2048


@dataclass(frozen=True)
class Floor:
    """Noise in the commanded torque of a closed loop.

    ``position_std_rad`` (n_axes,): standard deviation of the position noise;
    ``frequency_hz`` (n_freq,) and ``noise`` (n_axes, n_freq): torque noise
    density, scaled so that white noise has its variance; ``weighting``: whitens
    noise plus model error; ``expected`` (n_axes,): mean square of a weighted
    residual that is noise only.
    """

    position_std_rad: Array
    frequency_hz: Array
    noise: Array
    weighting: Weighting
    expected: Array


def position_noise_std(logs: list[Log]) -> Array:
    """Estimate white position noise (n_axes,) [rad] from the top fifth of the spectrum.

    Motion has no power there; what is left is the sensor. Median over the logs.
    """
    estimates = []
    for log in logs:
        rate = 1.0 / log.sample_time_s
        # Twice differenced, motion is out of the way of leakage; white noise keeps its level.
        f, density = scipy.signal.welch(
            np.diff(log.position_rad, n=2, axis=0), rate, nperseg=_segment(log), axis=0
        )
        top = (f > 0.4 * rate) & (f < 0.49 * rate)
        gain = (2 * np.sin(np.pi * f[top] / rate)) ** 4
        estimates.append(np.sqrt(np.mean(density[top] / gain[:, None], axis=0) * rate / 2))
    return np.asarray(np.median(np.array(estimates), axis=0))


def _segment(log: Log) -> int:
    return min(_SEGMENT, log.n_samples // 2)


def _density(x: Array, rate: float, segment: int) -> tuple[Array, Array]:
    f, density = scipy.signal.welch(x, rate, nperseg=segment, axis=0, detrend="constant")
    return f, np.asarray(density.T * rate / 2)


def closed_loop_floor(robot: Robot, logs: list[Log], settings: Settings) -> Floor:
    """Return the floor of closed-loop logs, by simulating the loop with and without noise."""
    nominal = robot.position_noise_std
    std = np.maximum(position_noise_std(logs), nominal)
    log = logs[0]
    reference = log.velocity_ref_rad_s
    if reference is None:
        raise InputError(f"log {log.name!r}: expected velocity references")
    noise = noise_torque(robot, log, std, settings.seed)
    rate, segment = 1.0 / log.sample_time_s, _segment(log)
    f, noise_density = _density(noise, rate, segment)
    torque = np.mean([_density(x.torque_nm, rate, segment)[1] for x in logs], axis=0)
    total = noise_density + settings.model_error**2 * torque
    # A noise-free simulated log still needs a finite weight.
    total = np.maximum(total, 1e-12 * torque.max())
    decimation = max(1, int(rate / (2 * settings.bandwidth_hz)))
    weighting = Weighting(f, 1.0 / np.sqrt(total), decimation)
    band = f <= rate / (2 * decimation)
    expected = np.mean((noise_density / total)[:, band], axis=1)
    return Floor(std, f, noise_density, weighting, expected)


def noise_torque(robot: Robot, log: Log, std_rad: Array, seed: int, run: int = 0) -> Array:
    """Return the torque (n, n_axes) [Nm] that position noise alone causes along a log."""
    scaled = white_noise(seed, run, log.n_samples, robot.n_axes) * std_rad
    clean = simulate(robot, log.velocity_ref_rad_s, method="rk4")
    noisy = simulate(robot, log.velocity_ref_rad_s, method="rk4", noise=scaled)
    n = min(clean.sizes["time"], noisy.sizes["time"])
    return np.asarray(noisy["torque_cmd_nm"].values[:n] - clean["torque_cmd_nm"].values[:n])
