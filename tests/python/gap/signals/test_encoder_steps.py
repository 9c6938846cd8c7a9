"""Steps of an encoder are run for the floor, not taken for white noise."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_reversals import logs_of

from axisight import Robot, load_robot
from axisight.gap.signals.encoder_steps import encoder_steps
from axisight.gap.simulator.closed_loop_runs import noise_torques
from axisight.logs import Log
from axisight.simulation import simulate, white_noise
from rigid_arm import arm_toml

STEP_RAD = 0.02
AXIS = 1


def coarse(log: Log) -> Log:
    position = log.position_rad.copy()
    position[:, AXIS] = STEP_RAD * np.round(position[:, AXIS] / STEP_RAD)
    return replace(log, position_rad=position)


def robot(noise_rad: float) -> Robot:
    """The arm with a sensor of its own."""
    return Robot.from_toml(f"{arm_toml()}[sensor]\nposition_noise_std = {noise_rad}\n")


def test_steps_count_where_the_stated_sensor_is_finer():
    logs = [coarse(log) for log in logs_of("sines", 0.0)]
    expected = [0.0] * 6
    assert encoder_steps(robot(STEP_RAD), logs).tolist() == expected
    expected[AXIS] = STEP_RAD
    assert encoder_steps(robot(STEP_RAD / 50), logs) == pytest.approx(expected, rel=1e-6)
    # One log that has none, and it is no encoder.
    assert not encoder_steps(robot(STEP_RAD / 50), [*logs, logs_of("sines", 0.0)[0]]).any()


def test_the_floor_is_what_rounding_does_in_the_loop():
    """Truth: the same references with and without an encoder that rounds, as the simulator's own option."""
    machine = load_robot("irb6600_like")
    step_s, n, step_rad = machine.sample_time_s, 4000, 1.5e-3
    time = np.arange(n) * step_s
    # So slow that a step lasts for many samples.
    reference = np.outer(0.2 * np.sin(2 * np.pi * 0.7 * time), np.ones(machine.n_axes))
    noise = machine.position_noise_std * white_noise(7, 0, n, machine.n_axes)
    still, moved = (
        simulate(machine, reference, noise=noise, position_resolution_rad=x, method="rk4")
        for x in (0.0, step_rad)
    )
    log = Log(
        name="slow",
        source=Path("slow"),
        sample_time_s=step_s,
        time_s=time,
        velocity_ref_rad_s=reference,
        torque_nm=moved["torque_cmd_nm"].values,
        position_rad=moved["position_rad"].values,
        velocity_rad_s=None,
    )
    wanted = np.std(moved["torque_cmd_nm"].values - still["torque_cmd_nm"].values, axis=0)
    steps = np.full(machine.n_axes, step_rad)
    std = np.full(machine.n_axes, machine.position_noise_std)
    (found,) = noise_torques(machine, [log], std, 0, step_rad=steps)
    (white,) = noise_torques(machine, [log], steps / np.sqrt(12), 0)
    assert np.std(found, axis=0) == pytest.approx(wanted, rel=0.1)
    # White noise of the same size is something else.
    assert np.abs(np.std(white, axis=0) / wanted - 1).max() > 0.2
