"""Print the table of docs/multiaxis.md on sensors on the arm, to be pasted there.

Usage: python docs/measure_sensors.py

Takes one to two minutes. Axis 2 of the preset `irb6600_like` turns for 8 s, with gear hysteresis, a transmission
error and Coulomb friction. The log is fitted with the motors alone, and with each sensor beside them, for four
realizations of the noise. The table holds the ratios of the standard errors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from axisight import (
    Effect,
    FitOptions,
    Fitted,
    Log,
    effect_parameter,
    fit,
    load_robot,
    robot_parameter,
    simulate,
    simulation_residuals,
    spectral_weighting,
)
from axisight.robot import Accelerometer

Array = NDArray[np.float64]

SECONDS = 8.0
REALIZATIONS = 4
TORQUE_NOISE_NM = 0.3
JOINT_NOISE_RAD = (5e-6, 20e-6, 100e-6)
ACCELERATION_NOISE_M_S2 = (0.01, 0.05, 0.2)
ELBOW = Accelerometer("elbow", "axis2_yaw", (0.0, 0.0, 1.075))
TIP = Accelerometer("tip", "axis3_yaw", (1.2, 0.0, 0.2))
ROBOT = load_robot("irb6600_like").with_accelerometers([ELBOW, TIP])
EFFECTS = (
    Effect("gear_hysteresis", 2, {"share": 0.3, "deflection_rad": 3e-4}),
    Effect("transmission_error", 2, {"order": 2.0, "cosine_rad": 1e-4, "sine_rad": 1e-4}),
    Effect("coulomb_friction", 2, {"coulomb_nm": 2.0, "smoothing_rad_s": 0.5}),
)
FROM_ROBOT = ("stiffness", "damping", "motor_inertia", "viscous_friction")
FROM_EFFECTS = ((0, "share"), (1, "cosine_rad"), (1, "sine_rad"), (2, "coulomb_nm"))


def experiment(run: int) -> Log:
    """Axis 2 turns to and fro and shakes; only the motor positions have noise."""
    count = round(SECONDS / ROBOT.sample_time_s)
    time = ROBOT.sample_time_s * np.arange(count, dtype=np.float64)
    reference = np.zeros((len(time), ROBOT.n_axes))
    wave = 40 * np.sin(np.pi * time) + 8 * np.sin(6 * np.pi * time)
    reference[:, 1] = np.minimum(1, time) * wave
    pose = [0.0, 0.3, -0.3]
    sim = simulate(
        ROBOT, reference, start_rad=pose, noise_seed=3, run=run, effects=EFFECTS, tolerance=1e-9
    )
    readings = sim["acceleration_m_s2"]
    return Log(
        name="turns",
        sample_time_s=ROBOT.sample_time_s,
        time_s=time,
        torque_nm=sim["torque_cmd_nm"].values,
        position_rad=sim["position_rad"].values,
        velocity_ref_rad_s=reference,
        joint_position_rad=sim["joint_position_rad"].values[:, ROBOT.axis_joints],
        acceleration_m_s2={
            one.name: readings.sel(accelerometer=one.name).values for one in ROBOT.accelerometers
        },
        start_rad=np.array(pose),
        source=Path("simulated"),
    )


def fitted(log: Log) -> Fitted:
    """The parameters of axis 2 from a log, with the sensors that it has."""
    joints, readings = log.joint_position_rad is not None, bool(log.acceleration_m_s2)
    residual = simulation_residuals(
        ROBOT, [log], effects=EFFECTS, joints=joints, accelerometers=readings
    )[0]
    n, step = ROBOT.n_axes, log.sample_time_s
    wanted = [robot_parameter(ROBOT, f"axis2.{quantity}") for quantity in FROM_ROBOT]
    for place, name in FROM_EFFECTS:
        one = effect_parameter(EFFECTS, place, name)
        wanted.append(replace(one, scale=0.05 * one.scale))
    return fit(
        ROBOT,
        [log],
        wanted,
        effects=EFFECTS,
        # White noise allows short blocks, and eight parameters need many.
        options=FitOptions(block_s=0.25),
        weighting=spectral_weighting([residual[:, :n]], step),
        joint_weighting=spectral_weighting([residual[:, n:]], step) if joints else None,
        acceleration_weighting=spectral_weighting([residual[:, n:]], step) if readings else None,
    )


def standard_errors(label: str, logs: Sequence[Log]) -> Array:
    """Root mean square of the standard errors over realizations of the noise; prints errors and status."""
    found = [fitted(log) for log in logs]
    truth = [ROBOT.parameters()[f"axis2.{quantity}"] for quantity in FROM_ROBOT]
    truth += [(EFFECTS[place].parameters or {})[name] for place, name in FROM_EFFECTS]
    errors = np.abs([(one.values - truth) / one.std for one in found])
    status = {one.status for one in found}
    print(
        f"{label}: {np.mean(errors < 2):.0%} of errors below two standard errors, {status}",
        flush=True,
    )
    return np.asarray(np.sqrt(np.mean([one.std**2 for one in found], axis=0)))


def main() -> None:
    """Print the table."""
    logs = [experiment(run) for run in range(REALIZATIONS)]
    rng = np.random.default_rng(11)

    def noisy(x: Array | None, std: float) -> Array:
        assert x is not None
        return x + rng.normal(0, std, x.shape)

    logs = [replace(log, torque_nm=noisy(log.torque_nm, TORQUE_NOISE_NM)) for log in logs]
    bare = [replace(log, joint_position_rad=None, acceleration_m_s2={}) for log in logs]
    sensed = {}
    for std in JOINT_NOISE_RAD:
        angles = [noisy(log.joint_position_rad, std) for log in logs]
        sensed[f"joint encoder, {1e6 * std:g} µrad"] = [
            replace(one, joint_position_rad=x) for one, x in zip(bare, angles, strict=True)
        ]
    for names in (("elbow",), ("tip",), ("elbow", "tip")):
        for std in ACCELERATION_NOISE_M_S2:
            readings = [{n: noisy(log.acceleration_m_s2[n], std) for n in names} for log in logs]
            sensed[f"{' and '.join(names)}, {std:g} m/s²"] = [
                replace(one, acceleration_m_s2=x) for one, x in zip(bare, readings, strict=True)
            ]
    without = standard_errors("motors alone", bare)
    rows = [f"| | {' | '.join((*FROM_ROBOT, *(name for _, name in FROM_EFFECTS)))} |"]
    for label, given in sensed.items():
        factors = without / standard_errors(label, given)
        rows.append(f"| {label} | {' | '.join(f'{x:.1f}' for x in factors)} |")
    print("\n".join(rows))


if __name__ == "__main__":
    main()
