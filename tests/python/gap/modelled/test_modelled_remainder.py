"""A diagnosis with its remainder modelled: the verdict stays, the gap falls on a motion of another kind."""

from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from axisight import Diagnosis, Log, Robot, Settings, diagnose, load_robot
from axisight.gap import verdict_schema
from axisight.gap.facts.simulator_variant import AS_GIVEN
from axisight.gap.simulator.rigid_torque import predicted_torque
from axisight.logs import lowpass
from axisight.remainder import Motion
from axisight.report import render_report
from axisight.write_back import write_model

RATE_HZ = 200.0
ROBOT = """
schema = "axisight.robot/2"
name = "two links"
gravity = [0.0, 0.0, -9.81]
sample_time = 0.005
[[joint]]
name = "one"
kind = "driven"
origin = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
link = { mass = 4.0, com = [0.2, 0.0, 0.0], inertia = [0.05, 0.05, 0.05, 0.0, 0.0, 0.0] }
drive = { gear_ratio = 0.02, motor_inertia = 2e-4, viscous_friction = 1e-3 }
[[joint]]
name = "two"
kind = "driven"
origin = [0.4, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
link = { mass = 2.0, com = [0.15, 0.0, 0.0], inertia = [0.02, 0.02, 0.02, 0.0, 0.0, 0.0] }
drive = { gear_ratio = 0.02, motor_inertia = 1e-4, viscous_friction = 3e-3 }
"""


def log_of(robot: Robot, name: str, joint_rad: np.ndarray, seed: int) -> Log:
    """A log along a motion whose first axis has friction that grows with the speed of the second."""
    rng = np.random.default_rng(seed)
    position = joint_rad / robot.gear_ratio
    speed = np.gradient(position, 1 / RATE_HZ, axis=0)
    acceleration = np.gradient(speed, 1 / RATE_HZ, axis=0)
    torque = predicted_torque(
        robot, AS_GIVEN, (position, speed, acceleration, np.zeros_like(speed))
    )
    torque[:, 0] += 3e-3 * np.tanh(speed[:, 0]) * np.abs(speed[:, 1])
    return Log(
        name=name,
        source=Path(name),
        sample_time_s=1 / RATE_HZ,
        time_s=np.arange(len(position)) / RATE_HZ,
        torque_nm=torque + rng.normal(0, 2e-3, torque.shape),
        position_rad=position + rng.normal(0, 1e-4, torque.shape),
    )


@pytest.fixture(scope="module")
def logs() -> tuple[Robot, list[Log], list[Log]]:
    robot = Robot.from_toml(ROBOT)
    t = np.arange(int(12 * RATE_HZ)) / RATE_HZ
    rng = np.random.default_rng(0)

    def sines() -> np.ndarray:
        parts = [
            [
                a * np.sin(2 * np.pi * hz * t + phase)
                for a, hz, phase in rng.uniform([0.1, 0.1, 0], [0.4, 0.7, 6], (4, 3))
            ]
            for _ in range(2)
        ]
        return np.stack([np.sum(p, axis=0) for p in parts], axis=1)

    fitted = [log_of(robot, f"run {k}", sines(), k) for k in range(3)]
    # Of another kind: both axes to and fro at constant speeds, with smooth turns.
    swing = np.arcsin(0.98 * np.sin(2 * np.pi * np.stack([0.25 * t, 0.17 * t], axis=1)))
    return robot, fitted, [log_of(robot, "to and fro", 0.4 * swing, 9)]


# What the remainder of these logs does not depend on.
_OTHERS = ("position_rad", "acceleration_rad_s2", "load_nm")


@pytest.fixture(scope="module")
def both(logs: tuple[Robot, list[Log], list[Log]]) -> tuple[Diagnosis, Diagnosis]:
    robot, fitted, other = logs
    settings = Settings(bootstrap=20, threads=1)
    plain, modelled = (
        diagnose(robot, fitted, validation=other, settings=settings, remainder=wanted)
        for wanted in (False, True)
    )
    return plain, modelled


def test_the_verdict_stays(both: tuple[Diagnosis, Diagnosis]) -> None:
    plain, modelled = (d.to_verdict() for d in both)
    assert "modelled" not in plain["remainder"]
    jsonschema.validate(modelled, verdict_schema())
    assert modelled["headline"].startswith(plain["headline"])
    assert "Remainder modelled: from" in modelled["headline"]
    assert modelled["remainder"].pop("modelled")["terms"]
    for one in (plain, modelled):
        del one["headline"], one["provenance"]["seconds"]
    assert plain == modelled


def test_the_gap_falls_on_another_motion(both: tuple[Diagnosis, Diagnosis]) -> None:
    _, found = both
    assert found.remainder is not None and found.remainder.modelled is not None
    modelled = found.remainder.modelled
    # The gap before is that of the verdict: the same logs, torques and weights.
    assert modelled.gap_before == pytest.approx(found.gap.after, rel=1e-6)
    assert modelled.gap_after < 0.4 * modelled.gap_before
    (first, *_) = modelled.model.of_axis(1)
    assert (first.acts, first.variable, first.of_axis) == ("direction", "speed", 2)


def test_the_page_shows_the_terms(both: tuple[Diagnosis, Diagnosis]) -> None:
    plain, modelled = both
    page = render_report(modelled)
    assert "The remainder as a model" in page and "of the speed of axis 2" in page
    assert "The remainder as a model" not in render_report(plain)


def test_causes_found_beside_it_stay(logs: tuple[Robot, list[Log], list[Log]]) -> None:
    """The gap with the remainder taken off the logs has the causes of the first diagnosis, within their intervals."""
    robot, fitted, other = logs
    lacking = robot.with_parameters({"two.viscous_friction": 0.0})
    settings = Settings(bootstrap=20, threads=1)
    first = diagnose(lacking, fitted, validation=other, settings=settings, remainder=True)
    assert first.remainder is not None and first.remainder.modelled is not None
    assert "viscous_friction@2" in [c.label for c in first.causes]
    off = [replace(log, torque_nm=log.torque_nm - _torque(robot, first, log)) for log in fitted]
    again = diagnose(lacking, off, validation=other, settings=settings)
    values = {c.label: c.parameters for c in again.causes}
    for cause in first.causes:
        for name, interval in cause.parameters.items():
            assert interval.low <= values[cause.label][name].value <= interval.high


def _torque(robot: Robot, found: Diagnosis, log: Log) -> np.ndarray:
    """Torque of the remainder along a log, from its angles alone."""
    assert found.remainder is not None and found.remainder.modelled is not None
    position = lowpass(log.position_rad, log.sample_time_s, 20.0)
    speed = np.gradient(position, log.sample_time_s, axis=0)
    acceleration = np.gradient(speed, log.sample_time_s, axis=0)
    drives = [n for n in robot.parameters() if n.endswith(("viscous_friction", "motor_inertia"))]
    bodies = robot.with_parameters(dict.fromkeys(drives, 0.0))
    at = (position, speed, acceleration, np.zeros_like(speed))
    motion = Motion(
        name=log.name,
        time_s=log.time_s,
        position_rad=position,
        velocity_rad_s=speed,
        acceleration_rad_s2=acceleration,
        load_nm=predicted_torque(bodies, AS_GIVEN, at),
    )
    return found.remainder.modelled.model.torque(motion)


def test_a_written_model_has_the_gap_that_was_told(
    both: tuple[Diagnosis, Diagnosis],
    logs: tuple[Robot, list[Log], list[Log]],
    tmp_path: Path,
) -> None:
    """A diagnosis of the written model begins where that with the remainder ended."""
    found, (robot, fitted, other) = both[1], logs
    assert found.remainder is not None and found.remainder.modelled is not None
    modelled = found.remainder.modelled
    source = tmp_path / "robot.toml"
    source.write_text(ROBOT)
    plain = write_model(source, robot, found.causes, tmp_path / "plain.toml")
    made = write_model(
        source, robot, found.causes, tmp_path / "new.toml", refit=found.refit, remainder=modelled
    )
    assert set(made.placed) - set(plain.placed) == {"remainder"}
    assert bool(made.own) == (modelled.own_parameters == "re-fitted")
    again = load_robot(made.path)
    assert again.remainder is not None
    at = Motion(
        name="any",
        time_s=np.arange(50) / RATE_HZ,
        **{
            field: np.random.default_rng(i).normal(size=(50, 2))
            for i, field in enumerate(
                ("position_rad", "velocity_rad_s", "acceleration_rad_s2", "load_nm")
            )
        },
    )
    np.testing.assert_array_equal(again.remainder.torque(at), modelled.model.torque(at))
    settings = Settings(bootstrap=20, threads=1)
    after = diagnose(again, fitted, validation=other, settings=settings)
    # Errors are relative to the measured torque, here without the remainder: its own speeds tell how much that is.
    speed = np.gradient(other[0].position_rad, 1 / RATE_HZ, axis=0)
    still = replace(
        at, time_s=other[0].time_s, velocity_rad_s=speed, **dict.fromkeys(_OTHERS, 0 * speed)
    )
    left = other[0].torque_nm - modelled.model.torque(still)
    size = left.std(axis=0) / other[0].torque_nm.std(axis=0)
    # Noise of the speed is below 1 % of it.
    np.testing.assert_allclose(after.gap.before_per_axis * size, modelled.after_per_axis, rtol=0.02)
    assert any("remainder of the robot file" in check for check in after.checks)
    # Without a remainder the files are those of ever.
    assert "remainder" not in plain.path.read_text()
    twice = write_model(made.path, again, (), tmp_path / "twice.toml", remainder=modelled)
    assert twice.left_out == ("remainder",)
    assert "has one already" in twice.why["remainder"]
