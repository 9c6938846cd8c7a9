"""Logs for the tests of responses: exact periodic records of a known system, with noise on request."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

import axisight
from axisight import excitation
from axisight.logs import Log
from axisight.robot import Robot

STEP_S = 1e-3


def log(name: str, torque, position, reference=None, step_s: float = STEP_S, joint=None) -> Log:
    """Return a log of arrays (n, axes)."""
    return Log(
        name=name,
        sample_time_s=step_s,
        time_s=step_s * np.arange(len(torque)),
        torque_nm=np.asarray(torque, float),
        position_rad=np.asarray(position, float),
        velocity_ref_rad_s=None if reference is None else np.asarray(reference, float),
        joint_position_rad=joint,
        source=Path(f"{name}.parquet"),
    )


def gain(n: int, step_s: float = STEP_S):
    """Return a response (lines 0 to n // 2, 2, 2) without poles near the circle, from torque to position."""
    z = np.exp(2j * np.pi * np.arange(n // 2 + 1) / n)
    lag = 1 / (1 - 0.6 / z)
    g = np.empty((n // 2 + 1, 2, 2), complex)
    g[:, 0, 0], g[:, 1, 1] = lag, 0.5 * lag**2
    g[:, 0, 1], g[:, 1, 0] = 0.2 * lag, 0.1 / z
    return g


def periodic_logs(
    *,
    realizations: int = 1,
    periods: int = 4,
    n: int = 256,
    lines=None,
    noise: float = 0.0,
    seed: int = 0,
    matrix=((1.0, 1.0), (1.0, -1.0)),
    offset: float = 0.0,
) -> list[Log]:
    """Return logs of two axes, one for each experiment, with `gain` between torque and position.

    Torque follows from the reference by a constant matrix, as in a loop. ``noise`` is the standard deviation
    on torque and position. The noise depends on ``seed``, the phases do not.
    """
    lines = np.arange(2, 60) if lines is None else np.asarray(lines)
    g, out = gain(n), []
    generator = np.random.default_rng(seed)
    for m in range(realizations):
        phases = np.random.default_rng(1000 + m).uniform(0, 2 * np.pi, len(lines))
        spectrum = np.zeros(n // 2 + 1, complex)
        spectrum[lines] = np.exp(1j * phases) * n / 2
        for e, column in enumerate(np.array(matrix).T):
            r = spectrum[:, None] * column
            u = r @ np.array([[1.0, 0.1], [-0.2, 0.8]])
            y = np.einsum("koi,ki->ko", g, u)
            r, u, y = (np.tile(np.fft.irfft(x, n, axis=0), (periods, 1)) for x in (r, u, y))
            u = u + noise * generator.standard_normal(u.shape)
            y = y + offset + noise * generator.standard_normal(y.shape)
            out.append(log(f"m{m + 1}e{e + 1}", u, y, r))
    return out


def joined(logs: list[Log], rest: int = 0) -> Log:
    """Return one log of several in a row, with rests of ``rest`` samples before each and at the end."""

    def row(field):
        parts = []
        for one in logs:
            values = getattr(one, field)
            parts += [np.zeros((rest, values.shape[1])), values]
        return np.concatenate([*parts, np.zeros((rest, parts[-1].shape[1]))])

    return log("all", row("torque_nm"), row("position_rad"), row("velocity_ref_rad_s"))


def truth(response: xr.Dataset, n: int = 256, step_s: float = STEP_S):
    """Return the exact response at the lines of an estimate, in its quantity."""
    frequency = response["frequency_hz"].values
    order = {"position": 0, "velocity": 1, "acceleration": 2}[response.attrs["quantity"]]
    factor = (2j * np.pi * frequency) ** order
    return gain(n)[np.rint(frequency * n * step_s).astype(int)] * factor[:, None, None]


def robot_logs(robot: Robot, periods: int, *, pose, model="linear", noise_seed=None) -> list[Log]:
    """Return the logs of one realization of directions T2, simulated from rest at a pose."""
    tones = excitation.multisine(1.0, robot.sample_time_s, band_hz=(2, 60), seed=3).scaled(peak=8)
    reference = excitation.references(tones, robot.n_axes, directions="t2").repeated(periods)
    run = axisight.simulate_batch(
        robot, reference, noise_seed=noise_seed, start_rad=pose, model=model
    )
    return [
        log(f"e{e + 1}", run["torque_cmd_nm"].values[e], run["position_rad"].values[e], reference[e],
            robot.sample_time_s)
        for e in range(robot.n_axes)
    ]  # fmt: skip
