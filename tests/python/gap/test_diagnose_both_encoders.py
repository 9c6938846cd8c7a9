"""Logs of targets and positions with an encoder on motor and joint: what the joint encoder shows takes part."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from axisight import Effect, Log, Robot, diagnose, load_robot, simulate
from axisight.gap import Diagnosis
from servo_lever import ELASTIC

NOISE_RAD = 2e-5
SECONDS = 10.0
START_RAD = 0.03
PLAY = Effect("backlash", 1, {"half_width_rad": 0.025, "damped": 0.02})
SOFTER = Effect("joint_stiffness", 1, {"relative_change": -0.4})


@pytest.fixture(scope="module")
def lever(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    path: Path = tmp_path_factory.mktemp("lever") / "lever.toml"
    path.write_text(ELASTIC, "utf-8")
    return load_robot(path)


def recorded(robot: Robot, run: int, *effects: Effect) -> Log:
    """Return a log of targets and positions of the robot with ``effects``, with an encoder on the joint."""
    rng = np.random.default_rng(run)
    time = robot.sample_time_s * np.arange(int(SECONDS / robot.sample_time_s))
    phase = rng.uniform(0, 2 * np.pi, 3)
    waves = [
        a * np.sin(2 * np.pi * f * time + p)
        for f, a, p in zip((0.31, 0.83, 1.7), (0.3, 0.2, 0.1), phase, strict=True)
    ]
    target = np.minimum(time, 1.0) * np.sum(waves, axis=0)
    speed = np.diff(target, append=target[-1:])[:, None] / robot.sample_time_s
    ran = simulate(
        robot,
        speed,
        effects=effects,
        noise_seed=run,
        method="rk4",
        start_rad=[START_RAD * (-1) ** run],
    )
    position = ran["position_rad"].to_numpy()
    target = position[0] + robot.sample_time_s * (np.cumsum(speed, axis=0) - speed)
    joint = ran["joint_position_rad"].to_numpy()[:, robot.axis_joints]
    return Log(
        name=f"run{run}",
        source=Path("simulation"),
        time_s=time,
        sample_time_s=robot.sample_time_s,
        position_rad=position,
        torque_nm=np.full_like(position, np.nan),
        position_ref_rad=target,
        joint_position_rad=joint + NOISE_RAD * rng.standard_normal(joint.shape),
    )


def diagnosed(
    robot: Robot, *effects: Effect, factor: float = 1.0, offset_rad: float = 0.0
) -> Diagnosis:
    """Return the diagnosis of three logs whose joint encoder has a wrong scale or zero."""
    logs = [recorded(robot, run, *effects) for run in (1, 2, 3)]
    logs = [replace(x, joint_position_rad=factor * x.joint_position_rad + offset_rad) for x in logs]
    return diagnose(robot=robot, estimation=logs[:2], validation=logs[2:])


def test_play_is_named_with_its_width(lever: Robot) -> None:
    """The machine's law is the library's own: the width holds in its interval, and to the rounding of a dead zone."""
    found = diagnosed(lever, PLAY)
    assert found.verdict == "explained"
    assert [c.label for c in found.causes] == ["backlash@1"]
    width = found.causes[0].parameters["half_width_rad"].value
    assert width == pytest.approx(PLAY.values()[0], rel=0.05)


def test_a_softer_gear_is_named_where_the_motors_hardly_show_it(lever: Robot) -> None:
    """Without the joint encoder the same logs are unknown: the gap of the motors hardly falls."""
    found = diagnosed(lever, SOFTER)
    assert found.verdict == "explained"
    assert [c.label for c in found.causes] == ["joint_stiffness@1"]
    change = found.causes[0].parameters["relative_change"]
    assert change.low < SOFTER.values()[0] < change.high
    assert any("Both encoders contradict the gear of axis 1" in x for x in found.checks)
    logs = [replace(recorded(lever, run, SOFTER), joint_position_rad=None) for run in (1, 2, 3)]
    bare = diagnose(robot=lever, estimation=logs[:2], validation=logs[2:])
    assert "joint_stiffness@1" not in [c.label for c in bare.causes]


@pytest.mark.parametrize(
    ("factor", "offset_rad", "named"),
    [
        (1.0, 0.0, []),
        (1.0, 0.4, []),
        (-1.0, 0.0, ["sign_flipped"]),
        (1.15, 0.0, ["position_scaled"]),
        (180 / np.pi, 0.0, ["position_in_degrees"]),
    ],
)
def test_a_joint_encoder_is_no_cause(
    lever: Robot, factor: float, offset_rad: float, named: list[str]
) -> None:
    """Nothing is withheld. A zero of its own is no fault; wrong signs and scales are set aside by name."""
    found = diagnosed(lever, factor=factor, offset_rad=offset_rad)
    assert found.verdict == "none"
    assert [f.name for f in found.findings] == named
    assert {f.field for f in found.findings} <= {"joint_position_1"}


@pytest.mark.parametrize(
    "lacks",
    [
        Effect("coulomb_friction", 1, {"coulomb_nm": 0.3}),
        Effect("link_mass", 1, {"relative_change": 0.15}),
    ],
    ids=lambda e: e.name,
)
def test_friction_and_load_are_no_gear(lever: Robot, lacks: Effect) -> None:
    """Both change the torque in the gear, and so its deflection; the gear's own law is right."""
    found = diagnosed(lever, lacks)
    gears = {"backlash", "joint_stiffness", "nonlinear_stiffness", "piecewise_stiffness"}
    assert found.causes
    assert not {c.effect for c in found.causes} & gears
