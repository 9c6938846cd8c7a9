"""A six-axis arm with rigid gears, and logs of its motion, for diagnoses by inverse dynamics."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from axisight import Log, Robot

RATE_HZ = 100.0
# A 10 kg class cobot: joint axes and offsets, link masses, motor inertias joint side.
AXES = ((0, 0, 1), (0, 1, 0), (0, 1, 0), (1, 0, 0), (0, 1, 0), (1, 0, 0))
ORIGINS = ((0, 0, 0.1), (0, 0, 0.1), (0, 0, 0.6), (0.3, 0, 0.05), (0.3, 0, 0), (0.1, 0, 0))
MASSES = (8.0, 12.0, 8.0, 3.0, 2.0, 1.0)
TORQUE_NOISE_NM = (0.4, 0.5, 0.3, 0.1, 0.1, 0.06)
COULOMB_NM = (8.0, 11.0, 7.0, 3.0, 2.5, 1.8)
VISCOUS = (9.0, 12.0, 8.0, 2.5, 2.0, 1.5)


def arm_toml() -> str:
    """Return the robot file: torques and angles joint-side (gear ratio 1), no friction."""
    lines = [
        'schema = "axisight.robot/2"',
        'name = "six axes"',
        "gravity = [0.0, 0.0, -9.81]",
        f"sample_time = {1 / RATE_HZ}",
    ]
    for i, (axis, origin, mass) in enumerate(zip(AXES, ORIGINS, MASSES, strict=True)):
        size = 0.02 * mass
        lines += [
            "[[joint]]",
            f'name = "j{i + 1}"',
            'kind = "driven"',
            'motion = "revolute"',
            f"origin = {[float(x) for x in origin]}",
            f"axis = {[float(x) for x in axis]}",
            "[joint.drive]",
            "gear_ratio = 1.0",
            f"motor_inertia = {motor_inertia(mass)}",
            "viscous_friction = 0.0",
            "[joint.link]",
            f"mass = {mass}",
            "com = [0.05, 0.01, 0.1]" if i < 3 else "com = [0.03, 0.01, 0.0]",
            f"inertia = [{size}, {size}, {0.6 * size}, 0.0, 0.0, 0.0]",
        ]
    lines += ["[controller]", 'kind = "none"']
    return "\n".join(lines) + "\n"


def motor_inertia(mass_kg: float) -> float:
    """Return a motor's inertia behind its gear, similar to that of its link [kg m^2]."""
    return 0.08 * mass_kg


def arm() -> Robot:
    """Return the arm as its rigid simulator."""
    return Robot.from_toml(arm_toml())


def motion(seed: int, seconds: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return angles, speeds and accelerations (n, 6): a few harmonics, as in identification."""
    time = np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    rng = np.random.default_rng(seed)
    out = np.zeros((3, len(time), 6))
    for axis in range(6):
        for line in range(1, 6):
            wave = 0.25 * rng.normal() / line * np.exp(1j * rng.uniform(0, 2 * np.pi))
            rate = 2j * np.pi * line / 10.0
            for order in range(3):
                out[order, :, axis] += (wave * rate**order * np.exp(rate * time)).real
    return out[0], out[1], out[2]


def friction_torque(
    speed: np.ndarray, coulomb: np.ndarray, viscous: np.ndarray, corner_rad_s: float = 0.002
) -> np.ndarray:
    """Return Coulomb and viscous friction (n, 6) [Nm]; its corner differs from the library's formula."""
    return coulomb * speed / np.sqrt(speed**2 + corner_rad_s**2) + viscous * speed


def log_of(
    robot: Robot,
    seed: int,
    coulomb: Sequence[float] = COULOMB_NM,
    viscous: Sequence[float] = VISCOUS,
    seconds: float = 40.0,
    held: Sequence[int] = (),
) -> Log:
    """Return a log of a machine like ``robot`` with friction and noise; axes ``held`` (from 0) never move."""
    position, speed, acceleration = motion(seed, seconds)
    for moved in (position, speed, acceleration):
        moved[:, list(held)] = 0.0
    rotors = np.array([motor_inertia(mass) for mass in MASSES])
    torque = robot.inverse_dynamics(position, speed, acceleration) + rotors * acceleration
    torque += friction_torque(speed, np.array(coulomb), np.array(viscous))
    rng = np.random.default_rng([seed, 7])
    return Log(
        name=f"motion {seed}",
        source=Path(f"motion_{seed}.parquet"),
        sample_time_s=1 / RATE_HZ,
        time_s=np.arange(len(position)) / RATE_HZ,
        velocity_ref_rad_s=None,
        torque_nm=torque + rng.normal(size=torque.shape) * np.array(TORQUE_NOISE_NM),
        position_rad=position + 2e-6 * rng.normal(size=position.shape),
    )
