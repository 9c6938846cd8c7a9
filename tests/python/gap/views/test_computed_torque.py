"""A controller that moves the arm by its inverse dynamics."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from axisight import Effect, Robot, diagnose, load_robot, simulate, to_pinocchio
from axisight.errors import RobotError
from axisight.gap.views.targets import _stiffness
from axisight.logs import Log

Array = NDArray[np.float64]

KP, KD = (400.0, 900.0), (40.0, 60.0)
RATIO = (0.01, -0.02)
# Two links that swing against gravity, gears rigid.
ARM = """
schema = "axisight.robot/2"
name = "two links"
sample_time = {sample}
gravity = [0.0, 0.0, -9.81]

[[joint]]
name = "shoulder"
kind = "driven"
axis = [0.0, 1.0, 0.0]
origin = [0.0, 0.0, 0.4]
[joint.link]
mass = 20.0
com = [0.3, 0.0, 0.1]
inertia = [0.4, 1.2, 1.1, 0.0, 0.0, 0.0]
[joint.drive]
gear_ratio = 0.01
motor_inertia = 1e-3
viscous_friction = 0.0

[[joint]]
name = "elbow"
kind = "driven"
axis = [0.0, -1.0, 0.0]
origin = [0.6, 0.0, 0.0]
[joint.link]
mass = 8.0
com = [0.25, 0.0, 0.0]
inertia = [0.1, 0.3, 0.3, 0.0, 0.0, 0.0]
[joint.drive]
gear_ratio = -0.02
motor_inertia = 5e-4
viscous_friction = 0.0

[sensor]
position_noise_std = 1e-5

[controller]
kind = "pd_position"
kp = [{kp[0]}, {kp[1]}]
kd = [{kd[0]}, {kd[1]}]
{more}
"""


def arm(folder: Path, more: str = "computed_torque = true", sample: float = 5e-4) -> Robot:
    path = folder / "robot.toml"
    path.write_text(ARM.format(kp=KP, kd=KD, more=more, sample=sample), "utf-8")
    return load_robot(path)


def moves(n: int, sample: float = 5e-4, seed: int = 0) -> Array:
    """Speeds of the motors that begin and end at rest (n, 2) [rad/s]."""
    t = np.arange(n) * sample
    rng = np.random.default_rng(seed)
    waves = [np.sin(2 * np.pi * f * t[:, None] + rng.uniform(0, 6, 2)) for f in (0.4, 1.1, 2.3)]
    return np.asarray(np.sin(np.pi * t / t[-1])[:, None] ** 2 * sum(waves) * [30.0, 15.0])


def law(robot: Robot, reference: Array, position: Array) -> Array:
    """Return commands (n, 2) [Nm] by the rigid-body algorithms of Pinocchio."""
    pinocchio = pytest.importorskip("pinocchio", reason="Pinocchio comes with the extra `blind`")
    model, time = to_pinocchio(robot), robot.sample_time_s
    data, ratio = model.createData(), np.array(RATIO)
    target = position[0] + np.vstack([np.zeros(2), np.cumsum(reference, axis=0)[:-1]]) * time
    speed = np.diff(position, axis=0, prepend=position[:1]) / time
    wanted = np.diff(reference, axis=0, prepend=reference[:1]) / time
    wanted += np.array(KP) * (target - position) + np.array(KD) * (reference - speed)
    forces = [
        pinocchio.rnea(model, data, *(ratio * x for x in one))
        for one in zip(position, speed, wanted, strict=True)
    ]
    return np.asarray(np.array(forces) * ratio + np.array([1e-3, 5e-4]) * wanted)


def test_commands_are_those_of_inverse_dynamics(tmp_path: Path):
    """What the machine has more is left to the gains: the law knows the robot of its file."""
    robot = arm(tmp_path)
    assert robot.computed_torque
    assert not arm(tmp_path, "").computed_torque
    robot = arm(tmp_path)
    heavier = Effect("link_mass", 2, {"relative_change": 0.3})
    for effects in ([], [heavier]):
        out = simulate(robot, moves(2000), effects=effects, method="rk4")
        torque, position = out["torque_cmd_nm"].values, out["position_rad"].values
        expected = law(robot, moves(2000), position)
        # It holds the arm at first, whatever that weighs: by a constant.
        held = torque[0] - expected[0]
        assert (np.abs(held).max() > 0.01) == bool(effects)
        # Rounding of sums of a few terms of a hundred newton metres, through differences of angles.
        assert np.abs(torque - held - expected).max() < 1e-6


def test_errors_of_a_known_arm_swing_as_the_gains_say(tmp_path: Path):
    """e'' + kd e' + kp e = 0 from an error of 0.02 rad; samples of half a millisecond delay it by less than 2 %."""
    robot, n = arm(tmp_path), 1200
    step = np.zeros((n, 2))
    # A target that jumps within one sample, whose speed is none.
    robot = robot.with_velocity_feedforward(on=False)
    step[0] = 0.02 / robot.sample_time_s
    out = simulate(robot, step, method="rk4")
    error = 0.02 - (out["position_rad"].values - out["position_rad"].values[0])
    t = np.arange(n) * robot.sample_time_s
    for axis, (kp, kd) in enumerate(zip(KP, KD, strict=True)):
        # Critically damped both: 0.02 (1 + w t) exp(-w t).
        w = np.sqrt(kp)
        assert kd == 2 * w
        expected = 0.02 * (1 + w * t) * np.exp(-w * t)
        assert np.abs(error[:, axis] - expected)[1:].max() < 0.02 * 0.02


def test_a_machine_under_it_is_diagnosed_by_its_targets(tmp_path: Path):
    """Friction that its law does not know, from positions and targets alone."""
    robot, logs = arm(tmp_path, sample=2e-3), []
    missing = Effect("coulomb_friction", 1, {"coulomb_nm": 0.08, "smoothing_rad_s": 1.0})
    for seed in range(4):
        reference = moves(3000, 2e-3, seed)
        out = simulate(robot, reference, effects=[missing], noise_seed=seed)
        target = np.vstack([np.zeros(2), np.cumsum(reference, axis=0)[:-1]]) * robot.sample_time_s
        position = out["position_rad"].values
        logs.append(
            Log(
                name=f"move{seed}",
                sample_time_s=robot.sample_time_s,
                time_s=np.arange(3000) * robot.sample_time_s,
                torque_nm=np.full_like(position, np.nan),
                position_rad=position,
                source=Path(f"move{seed}"),
                position_ref_rad=target + out["motor_position_rad"].values[0],
            )
        )
    found = diagnose(robot=robot, estimation=logs[:3], validation=logs[3:])
    (cause,) = found.causes
    assert cause.label == "coulomb_friction@1"
    assert cause.parameters["coulomb_nm"].value == pytest.approx(0.08, rel=0.1)


def test_its_gains_are_torques_by_what_the_motors_move(tmp_path: Path):
    robot = arm(tmp_path)
    inertia = np.diag(robot.inertia_matrix(np.zeros(2))) * np.square(RATIO) + [1e-3, 5e-4]
    np.testing.assert_allclose(_stiffness(robot), np.array(KP) * inertia)
    np.testing.assert_array_equal(_stiffness(arm(tmp_path, "")), KP)


def test_gravity_is_in_it(tmp_path: Path):
    with pytest.raises(RobotError, match="one of gravity_compensation and computed_torque"):
        arm(tmp_path, "computed_torque = true\ngravity_compensation = true")
