"""Simulated logs of the preset arm `irb6600_like`: excitation of each axis at some poses, and slow motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from axisight import Effect, Log, Robot, excitation, load_robot, simulate
from axisight.fitting import Parameter, robot_parameter
from axisight.logs import Load

ROBOT = load_robot("irb6600_like")
TRUTH = ROBOT.parameters()
STEP = ROBOT.sample_time_s
POSES = ((0.0, 0.0, 0.0), (0.0, 0.6, -0.6))
THIRTEEN = (
    "axis1.stiffness",
    "axis1.damping",
    "axis1.motor_inertia",
    "axis2.stiffness",
    "axis2.damping",
    "axis2.motor_inertia",
    "axis2_roll.stiffness",
    "axis2_yaw.stiffness",
    "axis3.stiffness",
    "axis3.damping",
    "axis3.motor_inertia",
    "axis3_roll.stiffness",
    "axis3_yaw.stiffness",
)


def simulated(
    name: str,
    reference: np.ndarray,
    pose: Sequence[float],
    run: int,
    *,
    effects: Sequence[Effect] = (),
    load: Load | None = None,
    period_s: float | None = None,
    stated: bool = True,
) -> Log:
    """A log of the arm with sensor noise; it states its start unless not ``stated``."""
    acting = [*effects] if load is None else [*effects, Effect("payload", None, load.parameters)]
    sim = simulate(ROBOT, reference, noise_seed=3, run=run, start_rad=list(pose), effects=acting)
    joints = sim.joint_position_rad.values[:, ROBOT.axis_joints]
    return Log(
        name=name,
        sample_time_s=STEP,
        time_s=STEP * np.arange(len(reference)),
        torque_nm=sim.torque_cmd_nm.values,
        position_rad=sim.position_rad.values,
        joint_position_rad=joints,
        velocity_ref_rad_s=reference,
        start_rad=np.array(pose, float) if stated else None,
        source=Path(name),
        period_s=period_s,
        load=load,
    )


def reference_of(period_s: float, run: int, axis: int | None) -> np.ndarray:
    """One period [rad/s]: a square wave on all axes, and a multisine on one axis or, for None, on each."""
    wave = excitation.square(period_s, STEP, amplitude=9.6, smoothing_samples=40).period
    out = np.stack([wave] * 3, axis=1)
    for a in range(3) if axis is None else (axis,):
        own = excitation.multisine(period_s, STEP, band_hz=(1, 40), seed=5, run=3 * run + a)
        out[:, a] += own.scaled(peak=8.0).period
    return out


def broadband(period_s: float = 1.0, effects: Sequence[Effect] = ()) -> list[Log]:
    """Two periods from rest for every pose and axis, without joint encoders and stated starts."""
    out = []
    for p, pose in enumerate(POSES):
        for axis in range(3):
            number = 3 * p + axis
            reference = np.tile(reference_of(period_s, number, axis), (2, 1))
            log = simulated(
                f"pose{p + 1}_axis{axis + 1}",
                reference,
                pose,
                number,
                effects=effects,
                period_s=period_s,
                stated=False,
            )
            out.append(replace(log, joint_position_rad=None))
    return out


def slow(effects: Sequence[Effect] = (), seconds: float = 8.0) -> Log:
    """Slow sines on all axes."""
    time = STEP * np.arange(round(seconds / STEP))
    ramp = np.minimum(1, time)
    reference = np.stack([30 * ramp * np.sin(2 * np.pi * f * time) for f in (0.5, 0.75, 1)], axis=1)
    log = simulated("slow", reference, (0.0, 0.3, -0.3), 99, effects=effects, stated=False)
    return replace(log, joint_position_rad=None)


def off_by(factor: float, seed: int, names: Sequence[str] = THIRTEEN) -> dict[str, float]:
    """Values that are wrong by up to a factor, either way."""
    rng = np.random.default_rng(seed)
    wrong = np.exp(rng.uniform(-1, 1, len(names)) * np.log(factor))
    return {name: TRUTH[name] * float(w) for name, w in zip(names, wrong, strict=True)}


def parameters(start: dict[str, float], **changes: object) -> list[Parameter]:
    return [
        replace(robot_parameter(ROBOT, name), initial=value, **changes)
        for name, value in start.items()
    ]


def errors(names: Sequence[str], values: np.ndarray) -> np.ndarray:
    """Relative errors of robot parameters."""
    return values / np.array([TRUTH[name] for name in names]) - 1


def other_robot(start: dict[str, float]) -> Robot:
    return ROBOT.with_parameters(start)
