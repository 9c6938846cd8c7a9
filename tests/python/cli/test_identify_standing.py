"""Seven axes, torques joint-side, some of which stand still in some of the logs."""

from pathlib import Path

import numpy as np
import pytest

from axisight import InputError, Log, Robot
from axisight.rigid_body import identify_logs

RATE_HZ = 1000.0
AXES = ((0, 0, 1), (0, 1, 0), (0, 0, 1), (0, -1, 0), (0, 0, 1), (0, -1, 0), (0, 0, 1))
ORIGINS = (
    (0, 0, 0.33),
    (0, 0, 0),
    (0, 0, 0.316),
    (0.08, 0, 0),
    (-0.08, 0, 0.384),
    (0, 0, 0),
    (0.09, 0, 0),
)
MASSES = (4.0, 4.0, 3.0, 3.0, 3.0, 1.5, 0.7)
ROTOR, COULOMB_NM, VISCOUS = 0.1, 3.0, 2.0


def robot_text() -> str:
    lines = [
        'schema = "axisight.robot/2"',
        'name = "seven axes"',
        "gravity = [0.0, 0.0, -9.81]",
        "sample_time = 0.001",
    ]
    for i, (axis, origin, mass) in enumerate(zip(AXES, ORIGINS, MASSES, strict=True)):
        lines += [
            "[[joint]]",
            f'name = "j{i + 1}"',
            'kind = "driven"',
            f"origin = {[float(x) for x in origin]}",
            f"axis = {[float(x) for x in axis]}",
            "[joint.drive]",
            "gear_ratio = 1.0",
            f"motor_inertia = {ROTOR}",
            "viscous_friction = 0.0",
            "[joint.link]",
            f"mass = {mass}",
            "com = [0.02, 0.01, 0.05]",
            f"inertia = [{0.02 * mass}, {0.02 * mass}, {0.01 * mass}, 0.0, 0.0, 0.0]",
        ]
    return "\n".join([*lines, "[controller]", 'kind = "none"', ""])


ROBOT = Robot.from_toml(robot_text())


def log_of(seed: int, moving: range | tuple[int, ...], seconds: float = 10.0) -> Log:
    """A log in which the axes ``moving`` (from 0) move and the others stand, with sensor noise."""
    time = np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    rng = np.random.default_rng(seed)
    q = np.zeros((3, len(time), 7))
    q[0] += np.random.default_rng(99).uniform(-0.5, 0.5, 7)
    for axis in range(7):
        q[0, :, axis] += 0.2 * rng.normal()
        if axis not in moving:
            continue
        for line in range(1, 6):
            wave = 0.3 * rng.normal() / line * np.exp(1j * rng.uniform(0, 2 * np.pi))
            rate = 2j * np.pi * line / 10.0
            for order in range(3):
                q[order, :, axis] += (wave * rate**order * np.exp(rate * time)).real
    torque = ROBOT.inverse_dynamics(*q) + ROTOR * q[2] + COULOMB_NM * np.sign(q[1]) + VISCOUS * q[1]
    return Log(
        name=f"run {seed}",
        source=Path(f"run_{seed}"),
        sample_time_s=1 / RATE_HZ,
        time_s=time,
        torque_nm=torque + 0.05 * rng.normal(size=torque.shape),
        position_rad=q[0] + 1e-6 * rng.normal(size=q[0].shape),
    )


def test_friction_is_that_of_the_arm_where_axes_stand_in_some_logs() -> None:
    logs = [log_of(0, range(7)), log_of(1, range(4)), log_of(2, (0, 4, 5, 6))]
    found = identify_logs(ROBOT, logs, cutoff_hz=10.0, torque_held=False)
    values = dict(zip(found.estimate.names, found.estimate.values, strict=True))
    for axis in range(1, 8):
        assert values[f"j{axis}.coulomb_friction"] == pytest.approx(COULOMB_NM, rel=0.05)
        assert values[f"j{axis}.viscous_friction"] == pytest.approx(VISCOUS, rel=0.1)
    # Where an axis stands nothing is predicted of its friction, and nothing is wrong with its units.
    assert not [f for f in found.estimate.findings if f.kind.value == "misfit"]


@pytest.mark.parametrize("reversal_s", [None, 0.0, 0.05, 0.1, 0.2])
def test_the_rank_does_not_depend_on_what_is_left_out(reversal_s: float | None) -> None:
    logs = [log_of(seed, range(7)) for seed in range(2)]
    found = identify_logs(ROBOT, logs, cutoff_hz=10.0, torque_held=False, reversal_s=reversal_s)
    assert len(found.estimate.names) == 69


def test_an_axis_that_never_moves_is_named() -> None:
    logs = [log_of(seed, range(6)) for seed in range(2)]
    with pytest.raises(InputError, match="axis 7 stands still in all"):
        identify_logs(ROBOT, logs, held_out=[log_of(9, range(7))], torque_held=False)
