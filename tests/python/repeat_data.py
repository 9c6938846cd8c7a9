"""Runs of one motion on several days: torques in closed form, or simulated machines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

import axisight
from axisight.logs import Log

SAMPLE_TIME_S = 0.005
SECONDS = 8.0
INERTIA, VISCOUS, COULOMB, OFFSET = 0.02, 0.013, 0.5, 0.1


def motion(seconds=SECONDS, start_s=0.0):
    """Position, speed and acceleration (n, 2) of two axes, in closed form."""
    t = start_s + SAMPLE_TIME_S * np.arange(round(seconds / SAMPLE_TIME_S))[:, None]
    size, omega, phase = np.array([[40.0, 25.0], [15.0, 20.0]]), np.array([1.6, 5.0]), (0.3, 1.1)
    q, v, a = (np.zeros((len(t), 2)) for _ in range(3))
    for k in range(2):
        angle = omega[k] * t + phase[k]
        q += size[k] * np.sin(angle)
        v += size[k] * omega[k] * np.cos(angle)
        a -= size[k] * omega[k] ** 2 * np.sin(angle)
    return q, v, a


def log(name="run", *, seed=0, viscous=VISCOUS, coulomb=COULOMB, noise_nm=0.01, **options):
    """A run whose axes have inertia, friction and offset; ``viscous``, ``coulomb``: one number or one per axis."""
    temperature_c = options.pop("temperature_c", None)
    q, v, a = motion(**options)
    torque = INERTIA * a + np.asarray(viscous) * v + np.asarray(coulomb) * np.sign(v) + OFFSET
    torque = torque + noise_nm * np.random.default_rng(seed).normal(size=torque.shape)
    return Log(
        name=name,
        sample_time_s=SAMPLE_TIME_S,
        time_s=SAMPLE_TIME_S * np.arange(len(q)),
        torque_nm=torque,
        position_rad=q,
        source=Path(f"day/{name}.csv"),
        temperature_c=None if temperature_c is None else np.full(q.shape, temperature_c),
    )


def runs(days, per_day, *, scatter=0.01, seed=0, change=0.0):
    """Runs of ``days`` days whose friction scatters; viscous friction of axis 2 changes on the last day."""
    rng = np.random.default_rng(seed)
    logs, labels = [], []
    for day in range(days):
        for run in range(per_day):
            viscous = VISCOUS * (1 + scatter * rng.normal(size=2))
            viscous[1] *= 1 + change * (day == days - 1)
            coulomb = COULOMB * (1 + scatter * rng.normal(size=2))
            one = log(f"d{day}r{run}", seed=[seed, day, run], viscous=viscous, coulomb=coulomb)
            logs.append(one)
            labels.append(f"day{day}")
    return logs, labels


def write(log_, path):
    """Write a log with the native columns."""
    columns = {"time_s": log_.time_s}
    for i in range(log_.n_axes):
        columns[f"position_{i + 1}"] = log_.position_rad[:, i]
        columns[f"torque_cmd_{i + 1}"] = log_.torque_nm[:, i]
    path.parent.mkdir(parents=True, exist_ok=True)
    pd.DataFrame(columns).to_parquet(path)


def simulated_days(seed, *, change, preset="two_mass_axis", per_day=5, scatter=0.01, seconds=6.0):
    """Two days of a simulated machine: sensor noise, and friction that scatters by a share from run to run.

    Friction differs between machines by a factor of about 1.3. The viscous friction of one axis, which is
    returned as the third value, differs between the days by the share ``change``.
    """
    robot = axisight.load_robot(preset)
    rng = np.random.default_rng([seed, 77])
    n_axes = robot.n_axes
    base = np.array([robot.parameters()[f"axis{i + 1}.viscous_friction"] for i in range(n_axes)])
    viscous = base * np.exp(0.3 * rng.normal(size=n_axes))
    coulomb = 0.5 * np.exp(0.3 * rng.normal(size=n_axes))
    changed = int(rng.integers(n_axes))
    t = robot.sample_time_s * np.arange(round(seconds / robot.sample_time_s))
    size = np.array([1.0, 0.8, 1.1])[:n_axes]
    wave = 60 * np.sin(1.6 * t)[:, None] * size + 50 * np.sin(3.8 * t)[:, None] * size[::-1]
    reference = wave * np.minimum(1.0, t / 0.5)[:, None]
    logs, days = [], []
    for day in range(2):
        for run in range(per_day):
            now = viscous * (1 + scatter * rng.normal(size=n_axes))
            now[changed] *= 1 + change * day
            dry = coulomb * (1 + scatter * rng.normal(size=n_axes))
            names = [f"axis{i + 1}.viscous_friction" for i in range(n_axes)]
            made = axisight.simulate(
                robot.with_parameters(dict(zip(names, now, strict=True))),
                reference,
                effects=[
                    axisight.Effect("coulomb_friction", i + 1, {"coulomb_nm": float(dry[i])})
                    for i in range(n_axes)
                ],
                noise_seed=seed,
                run=day * per_day + run,
            )
            logs.append(
                Log(
                    name=f"d{day}r{run}",
                    sample_time_s=robot.sample_time_s,
                    time_s=t,
                    torque_nm=made["torque_cmd_nm"].values,
                    position_rad=made["position_rad"].values,
                    velocity_ref_rad_s=reference,
                    source=Path(f"d{day}/r{run}.csv"),
                )
            )
            days.append(f"day{day}")
    return logs, days, changed + 1
