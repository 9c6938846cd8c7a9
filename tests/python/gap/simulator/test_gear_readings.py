"""Readings of gears from both encoders: the simulator's law beside them, and how exact they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from axisight import Effect, Log, Robot, load_robot, simulate
from axisight.gap.fit.gear_rows import gear_rows
from axisight.gap.simulator.gear_readings import GearReadings, gear_readings

MODEL_ERROR = 0.01
PLAY = Effect("backlash", 1, {"half_width_rad": 0.004, "damped": 0.5})
SOFT = Effect("joint_stiffness", 1, {"relative_change": -0.5})
LOAD = Effect("payload", None, {"mass_kg": 60.0})


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("irb6600_like")


def read(robot: Robot, *effects: Effect) -> GearReadings:
    """Return the readings of two logs of the first axis."""
    logs = []
    for k, f in enumerate((0.5, 0.7)):
        time = robot.sample_time_s * np.arange(int(6.0 / robot.sample_time_s))
        speed = np.zeros((len(time), robot.n_axes))
        speed[:, 0] = 40 * np.sin(2 * np.pi * f * time)
        run = simulate(robot, speed, effects=effects)
        logs.append(
            Log(
                name=str(k),
                source=Path("simulation"),
                time_s=time,
                sample_time_s=robot.sample_time_s,
                position_rad=run["position_rad"].to_numpy(),
                torque_nm=run["torque_cmd_nm"].to_numpy(),
                velocity_ref_rad_s=speed,
                joint_position_rad=run["joint_position_rad"].to_numpy()[:, robot.axis_joints],
            )
        )
    found = gear_readings(robot, logs, MODEL_ERROR)
    assert found is not None
    return found


def on_first(readings: GearReadings, *effects: Effect) -> np.ndarray:
    return readings.residual({}, effects)[readings.axis == 0]


@pytest.mark.parametrize("gear", [(), (SOFT,), (PLAY,)], ids=["as stated", "soft", "play"])
def test_the_true_law_is_within_the_error_of_its_readings(
    robot: Robot, gear: tuple[Effect, ...]
) -> None:
    """Three standard deviations each, of which impacts in a play make most."""
    readings = read(robot, *gear)
    assert np.abs(on_first(readings, *gear)).max() < 3.0
    if gear:
        assert np.sqrt(np.mean(on_first(readings) ** 2)) > 3.0


def test_a_load_that_the_simulator_lacks_is_no_soft_gear(robot: Robot) -> None:
    """Torques of motor and link differ then, and readings are that much less exact."""
    readings = read(robot, LOAD)
    assert np.abs(on_first(readings)).max() < 3.0


def test_some_logs_are_numbered_anew(robot: Robot) -> None:
    readings = read(robot)
    second = readings.part([1])
    assert set(second.log.tolist()) == {0}
    assert second.deflection_rad.tolist() == readings.deflection_rad[readings.log == 1].tolist()


def test_slopes_of_rows_are_those_of_the_law(robot: Robot) -> None:
    """A half-width shows one to one, and a gear of half the stiffness deflects by twice the angle."""
    readings = read(robot, PLAY)
    one = PLAY.with_values({"half_width_rad": 0.003})
    width = (0, "half_width_rad")
    rows = gear_rows(readings, [width, (0, "damped")], {}, [one], [1e-4, 0.1])
    first = readings.axis == 0
    # Corners of the dead zone are rounded over a twentieth of its width.
    assert rows.slopes[first, 0] * readings.std_rad[first] == pytest.approx(1.0, rel=0.05)
    assert np.all(rows.slopes[~first] == 0.0)
    assert np.all(rows.slopes[:, 1] == 0.0)
    name = robot.axis_parameter(1, "stiffness")
    stated = robot.parameters()[name]
    halved = readings.residual({name: 0.5 * stated}, []) - readings.residual({}, [])
    deflection = readings.torque_nm / stated
    assert (halved * readings.std_rad)[first] == pytest.approx(deflection[first], rel=1e-6)
