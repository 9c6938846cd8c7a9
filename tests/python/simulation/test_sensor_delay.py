"""A position that is read late: alone a delay of the drive, among other axes not."""

import numpy as np
import pytest
from test_between_axes import motion

from axisight import Effect, Robot, diagnose, load_robot, simulate
from axisight.simulation import white_noise
from gap_data import bare_axis, log_of, reference


def late(name: str, axis: int, delay_s: float) -> Effect:
    return Effect(name, axis, {"delay_s": delay_s})


@pytest.mark.parametrize("samples", [1.0, 2.4, 5.0])
def test_of_an_axis_alone_the_logs_are_those_of_a_drive_that_is_late(samples: float):
    robot = bare_axis()
    ref = reference("multisine", 1, 2000, robot.sample_time_s)
    delay_s = samples * robot.sample_time_s
    acted, read = (
        simulate(robot, ref, effects=[late(name, 1, delay_s)])
        for name in ("input_delay", "sensor_delay")
    )
    for name in ("torque_cmd_nm", "position_rad"):
        a, b = acted[name].values, read[name].values
        # The cubic between samples is off by a 384th of fourth differences: up to 40 Hz at 2 kHz
        # those are (2 pi 40 / 2000)^4 = 2.5e-4 of a wave, and the speed gain multiplies by the rate.
        assert np.abs(a - b).max() < (1e-5 if samples % 1 else 1e-6) * np.abs(a).max()
    bare = simulate(robot, ref)["torque_cmd_nm"].values
    assert np.abs(bare - read["torque_cmd_nm"].values).max() > 0.01 * np.abs(bare).max()


def arm() -> Robot:
    return load_robot("irb6600_like").with_effects([])


def test_among_others_it_is_read_late_and_the_arm_moves_on():
    """The controller written out meets each sample's own angles, those of axis 2 three samples late."""
    robot = arm()
    ref = motion(1, 600, robot.sample_time_s)
    seen = simulate(robot, ref, effects=[late("sensor_delay", 2, 3 * robot.sample_time_s)])
    torque, read = seen["torque_cmd_nm"].values, seen["position_rad"].values
    # The arm under the torques that were commanded, without a controller and what it reads.
    alone = simulate(robot, torque_nm=torque)["position_rad"].values
    np.testing.assert_allclose(read[:, [0, 2]], alone[:, [0, 2]], atol=1e-9)
    np.testing.assert_allclose(read[3:, 1], alone[:-3, 1], atol=1e-9)
    assert np.abs(read[:, 1] - alone[:, 1]).max() > 1e-3
    gains = robot.controller_gains
    speed = np.diff(read, axis=0) / robot.sample_time_s
    turned = np.cumsum(ref, axis=0) * robot.sample_time_s
    angle = turned[:-1] - (read[1:] - read[0])
    wanted = gains["kp"] * (ref[1:] - speed) + gains["ki"] * angle
    np.testing.assert_allclose(
        torque[1:] - torque[0], wanted - wanted_at_rest(robot, ref), atol=1e-6
    )


def wanted_at_rest(robot: Robot, ref: np.ndarray) -> np.ndarray:
    """What the first sample asks for beyond the torque at rest: references begin with it."""
    return np.asarray(robot.controller_gains["kp"] * ref[0])


def test_noise_is_read_with_it():
    robot = bare_axis()
    ref = reference("multisine", 1, 500, robot.sample_time_s)
    noise = 1e-4 * white_noise(1, 0, 500, 1)
    with_it, without = (
        simulate(robot, ref, effects=[late("sensor_delay", 1, 1e-3)], noise=x)
        for x in (noise, np.zeros_like(noise))
    )
    assert np.std((with_it["position_rad"] - without["position_rad"]).values) > 0.5e-4


@pytest.mark.parametrize("name", ["sensor_delay", "input_delay"])
def test_an_arm_tells_which_of_both_it_is(name: str):
    robot = arm()
    n = int(5.0 / robot.sample_time_s)
    effect = late(name, 2, 1.3e-3)
    logs = [
        log_of(robot, [effect], motion(seed, n, robot.sample_time_s), seed) for seed in range(3)
    ]
    said = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:])
    (cause,) = said.causes
    assert cause.label == f"{name}@2"
    # A current loop that is damped like a delay of the drive may be left beside it, and nothing else.
    beside = {label for labels in said.equivalent for label in labels} - {cause.label}
    assert beside <= {"current_loop@2"}
    delay = cause.parameters["delay_s"]
    # A tenth of a sample.
    assert delay.value == pytest.approx(1.3e-3, abs=5e-5)
