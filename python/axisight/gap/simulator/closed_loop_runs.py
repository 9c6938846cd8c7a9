"""Torques and positions of closed-loop simulations along the references of logs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.effects import Effect
from axisight.effects.stated import STEPS
from axisight.errors import InputError
from axisight.gap.facts.simulator_variant import Variant
from axisight.gap.simulator.own_parameters import with_values
from axisight.gap.simulator.start_poses import starts_of
from axisight.logs import Log
from axisight.robot import Robot
from axisight.simulation import simulate_batch, white_noise

Array = NDArray[np.float64]


def simulated_torques(
    robot: Robot, variant: Variant, logs: Sequence[Log], *, threads: int = 0
) -> list[Array]:
    """Return the commanded torque (n, n_axes) [Nm] of a simulator along the references of each log.

    If the simulation diverges, the rest is NaN.
    """
    changed = with_values(robot, variant.robot_values)
    return _along(changed, logs, threads, effects=variant.effects)


def simulated_positions(
    robot: Robot, variant: Variant, logs: Sequence[Log], *, threads: int = 0
) -> list[Array]:
    """Return the motor positions (n, n_axes) [rad] of a simulator along the references of each log.

    If the simulation diverges, the rest is NaN. The variant may change gains.
    """
    changed = with_values(robot, variant.robot_values)
    return _along(changed, logs, threads, effects=variant.effects, signal="position_rad")


def simulated_run(robot: Robot, variant: Variant, log: Log) -> tuple[Array, Array]:
    """Return torque [Nm] and motor position [rad] of one run along a log's references, (n, n_axes) each."""
    changed = with_values(robot, variant.robot_values)
    out, lead = _runs(changed, [log], 1, variant.effects), log.lead
    return out["torque_cmd_nm"].values[0, lead:], out["position_rad"].values[0, lead:]


def simulated_runs(
    robot: Robot, variant: Variant, logs: Sequence[Log], *, threads: int = 0
) -> tuple[list[Array], list[Array]]:
    """Return torques [Nm] and positions [rad] of runs along the references of each log, (n, n_axes) each."""
    out = _runs(with_values(robot, variant.robot_values), logs, threads, variant.effects)
    torque, position = (
        [out[signal].values[i, log.lead : log.lead + log.n_samples] for i, log in enumerate(logs)]
        for signal in ("torque_cmd_nm", "position_rad")
    )
    return torque, position


def _along(
    robot: Robot,
    logs: Sequence[Log],
    threads: int,
    *,
    effects: Sequence[Effect] = (),
    noise: Sequence[Array] | None = None,
    signal: str = "torque_cmd_nm",
) -> list[Array]:
    """Return one signal of the runs along logs of any lengths, (n, n_axes) each, without their run-ups."""
    values = _runs(robot, logs, threads, effects, noise)[signal].values
    return [values[i, log.lead : log.lead + log.n_samples] for i, log in enumerate(logs)]


def _runs(
    robot: Robot,
    logs: Sequence[Log],
    threads: int,
    effects: Sequence[Effect],
    noise: Sequence[Array] | None = None,
) -> xr.Dataset:
    """Return all signals of one run along the references of each log, with its run-up first."""
    return simulate_batch(
        robot,
        _padded([_reference(log) for log in logs]),
        effects=effects,
        method="rk4",
        # Fits take the same steps.
        substeps=robot.stable_substeps(effects),
        noise=None if noise is None else _padded(noise),
        start_rad=starts_of(robot, logs),
        threads=threads,
    )


def _padded(rows: Sequence[Array]) -> Array:
    """Stack arrays (n, n_axes), the shorter ones with zeros at the end."""
    longest = max(len(row) for row in rows)
    return np.stack([np.pad(row, ((0, longest - len(row)), (0, 0))) for row in rows])


def _reference(log: Log) -> Array:
    if log.velocity_ref_rad_s is None:
        raise InputError(f"log {log.name!r}: expected velocity references")
    return log.led("velocity_ref_rad_s")


def noise_torques(
    robot: Robot,
    logs: Sequence[Log],
    std_rad: Array,
    seed: int,
    first_run: int = 0,
    *,
    step_rad: Array | None = None,
    threads: int = 0,
) -> list[Array]:
    """Return the torque (n, n_axes) [Nm] that position noise alone causes along each log.

    ``std_rad`` (n_axes,): of the noise; ``step_rad`` (n_axes,): encoder steps to which noisy positions are
    rounded, zero for none.
    """
    noise = [
        white_noise(seed, first_run + i, log.lead + log.n_samples, robot.n_axes) * std_rad
        for i, log in enumerate(logs)
    ]
    if step_rad is not None and step_rad.any():
        steps = [Effect(STEPS[0], i + 1, {STEPS[1]: x}) for i, x in enumerate(step_rad) if x > 0]
        clean = _along(robot, logs, threads)
        noisy = _along(robot, logs, threads, effects=steps, noise=noise)
        return [np.asarray(b - a) for a, b in zip(clean, noisy, strict=True)]
    # One batch for runs with and without noise, so that both take the same steps.
    both = [np.zeros_like(x) for x in noise] + noise
    torques = _along(robot, [*logs, *logs], threads, noise=both)
    clean, noisy = torques[: len(logs)], torques[len(logs) :]
    return [np.asarray(b - a) for a, b in zip(clean, noisy, strict=True)]
