"""Logs that begin at several poses: each is simulated from its own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from axisight import (
    Effect,
    Log,
    Robot,
    Weighting,
    _core,
    diagnose,
    load_robot,
    simulate,
    simulate_batch,
)
from axisight.effects import core_effects
from axisight.errors import InputError
from axisight.fitting import FitOptions, robot_parameter
from axisight.fitting.parameters import core_spec
from axisight.gap.prepare.reconstructed_references import reference_of
from axisight.gap.simulator.start_poses import SAYS, at_their_poses, start_of, starts_of
from gap_data import log_of
from servo_arm import HOME_RAD, MACHINES, NOMINAL, simulator
from servo_lever import ELASTIC, RIGID

Array = NDArray[np.float64]

POSES = np.array([[0.0, -0.4, 0.3], [0.5, 0.2, -0.6], [-1.0, -0.1, 0.1]])
LESS = Effect("coulomb_friction", 2, {"coulomb_nm": 0.5})
SECONDS = 4.0


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("irb6600_like")


def reference(robot: Robot, seed: int, seconds: float = SECONDS) -> Array:
    """Sums of sines of all axes (n, 3) [rad/s] that fade in."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds / robot.sample_time_s)) * robot.sample_time_s
    waves = [
        sum(np.sin(2 * np.pi * (f * t + rng.uniform())) for f in rng.uniform(0.5, 12.0, 8))
        for _ in range(robot.n_axes)
    ]
    return np.column_stack(waves) * (6.0 * np.minimum(t, 1.0))[:, None]


def logs_at(robot: Robot, poses: Array, effects: list[Effect]) -> list[Log]:
    """Logs of the robot from several poses."""
    out = []
    for i, pose in enumerate(poses):
        at = robot.with_operating_point(pose)
        log = log_of(at, effects, reference(robot, i), i)
        out.append(log)
    return out


def test_runs_of_a_batch_start_where_each_is_told(robot: Robot) -> None:
    """With fixed steps to the bit of a run alone; five runs are more than go in lock-step."""
    starts = np.vstack([POSES, POSES[:2] + 0.1])
    references = np.stack([reference(robot, i, 0.2) for i in range(5)])
    batch = simulate_batch(robot, references, start_rad=starts, method="rk4")
    for i, start in enumerate(starts):
        alone = simulate(robot, references[i], start_rad=start, method="rk4")
        for name in ("torque_cmd_nm", "position_rad"):
            assert np.array_equal(batch[name].values[i], alone[name].values)
    assert np.ptp(batch.position_rad.values[:, 0], axis=0).min() > 1.0


def test_starts_that_are_no_runs_are_refused(robot: Robot) -> None:
    references = np.zeros((4, 10, 3))
    with pytest.raises(
        InputError, match="start_rad: expected 3 finite angles, or those of each of 4"
    ):
        simulate_batch(robot, references, start_rad=POSES)
    with pytest.raises(InputError, match=r"one set of angles|start: expected"):
        simulate_batch(robot, references[:3], start_rad=POSES, model="linear")


def test_motors_at_rest_are_where_they_were_measured(robot: Robot) -> None:
    """Three steps leave a millionth of a deflection, which is 1e-2 rad here at most."""
    for pose in POSES:
        motor = robot.equilibrium(pose.tolist())["motor_angle_rad"].values
        assert np.abs(start_of(robot, motor) - pose).max() < 1e-8


def test_logs_of_one_pose_are_left_alone(robot: Robot) -> None:
    logs = logs_at(robot, np.repeat(POSES[1:2], 2, axis=0), [])
    assert starts_of(robot, at_their_poses(robot, logs)) is None
    several = at_their_poses(robot, logs_at(robot, POSES, []))
    found = starts_of(robot, several)
    assert found is not None
    # Noise of the first position: 1e-4 rad of a motor behind gears of two hundred.
    assert np.abs(np.array(found) - POSES).max() < 1e-5
    assert several[0].part(1.0, 3.0).start_rad is None
    with pytest.raises(InputError, match="start_rad: expected shape"):
        replace(several[0], start_rad=np.zeros(2))


def test_a_robot_without_a_stated_pose_starts_where_its_logs_do(robot: Robot) -> None:
    """The same logs are left alone where the pose is stated: then it is the encoder that may be off."""
    logs = logs_at(robot, np.repeat(POSES[1:2], 2, axis=0), [])
    free = robot.as_imported(None, states_pose=False)
    assert not free.with_parameters({}).states_operating_point
    found = starts_of(free, at_their_poses(free, logs))
    assert found is not None
    assert np.abs(np.array(found) - POSES[1]).max() < 1e-5
    # Logs that begin at the operating point need no start of their own.
    rest = logs_at(robot, np.repeat(np.array([robot.operating_point]), 2, axis=0), [])
    assert starts_of(free, at_their_poses(free, rest)) is None
    stated = free.with_operating_point(robot.operating_point)
    assert starts_of(stated, at_their_poses(stated, logs)) is None


@pytest.mark.parametrize(("text", "start"), [(ELASTIC, [-0.05]), (RIGID, None)])
def test_a_rigid_gear_starts_where_its_motor_does(tmp_path, text, start) -> None:
    """Whatever its joint encoder shows; behind an elastic gear the joint starts where it stood."""
    path = tmp_path / "lever.toml"
    path.write_text(text, "utf-8")
    lever = load_robot(path)
    wave = np.sin(np.pi * lever.sample_time_s * np.arange(4000))[:, None]
    log = Log(
        name="swings",
        source=Path("swings.parquet"),
        sample_time_s=lever.sample_time_s,
        time_s=lever.sample_time_s * np.arange(4000),
        position_rad=0.4 * wave,
        torque_nm=wave,
        velocity_ref_rad_s=wave,
        joint_position_rad=0.4 * wave - np.where(wave > 0, -0.05, 0.05),
    )
    (found,) = at_their_poses(lever, [log])
    assert found.start_rad == (None if start is None else pytest.approx(start, abs=1e-3))


def test_residuals_are_those_of_a_robot_that_starts_there(robot: Robot) -> None:
    """Two logs in four lanes against each alone, of a robot whose operating point is its pose."""
    name = next(n for n in robot.parameters() if n.endswith("stiffness"))
    specs = [core_spec(robot_parameter(robot, name, relative_tolerance=0.1), [])]
    flat = Weighting.flat(robot.n_axes).core()
    records = []
    for i, pose in enumerate(POSES[:2]):
        at = robot.with_operating_point(pose)
        ref = reference(robot, i, 0.5)
        records.append((ref, simulate(at, ref, method="rk4")["torque_cmd_nm"].values * 1.01, None))

    def residual(
        machine: Robot, which: list[tuple[Array, Array, None, Array | None, int]]
    ) -> Array:
        logs = _core.SimulatedLogs(machine.core, which, flat, block_s=0.1)
        at = logs.evaluate(core_effects([]), specs, FitOptions())
        return np.concatenate([at.residual, at.jacobian.ravel()])

    both = residual(robot, [(*r, pose, 0) for r, pose in zip(records, POSES, strict=False)])
    first, second = (
        residual(robot.with_operating_point(pose), [(*r, None, 0)])
        for r, pose in zip(records, POSES, strict=False)
    )
    n = len(first) // 2
    alone = np.concatenate([first[:n], second[:n], first[n:], second[n:]])
    # The same sums in another order of lanes.
    assert np.abs(both - alone).max() < 1e-9 * np.abs(alone).max()


def test_what_lacks_is_named_from_logs_of_several_poses(robot: Robot) -> None:
    logs = logs_at(robot, POSES, [LESS])
    found = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:])
    assert found.verdict == "explained"
    assert [c.label for c in found.causes] == [LESS.label]
    assert SAYS in found.checks
    assert "position_offset" not in {f.name for f in found.findings}
    whole = diagnose(
        robot=robot,
        estimation=logs_at(robot, POSES, [])[:2],
        validation=logs_at(robot, POSES, [])[2:],
    )
    assert whole.verdict == "none"


def test_references_are_recovered_at_every_pose(robot: Robot) -> None:
    logs = at_their_poses(robot, logs_at(robot, POSES[:2], []))
    for log in logs:
        found = reference_of(robot, replace(log, velocity_ref_rad_s=None))
        assert log.velocity_ref_rad_s is not None
        error = found - log.velocity_ref_rad_s
        assert np.sqrt(np.mean(error**2)) < 0.02 * np.sqrt(np.mean(log.velocity_ref_rad_s**2))


@pytest.mark.parametrize("lacks", ["coulomb_friction@2", "payload", None])
def test_targets_from_several_poses(tmp_path, lacks: str | None) -> None:
    pytest.importorskip("mujoco", reason="MuJoCo comes with the extra `mujoco`")
    machine = NOMINAL if lacks is None else MACHINES[lacks]
    homes = HOME_RAD + np.array([[0.0, 0.0, 0.0], [0.4, -0.5, 0.3], [-0.3, 0.3, -0.4]])
    logs = [machine.log(run, home_rad=home) for run, home in enumerate(homes, 1)]
    found = diagnose(robot=simulator(tmp_path), estimation=logs[:2], validation=logs[2:])
    assert found.verdict == ("none" if lacks is None else "explained")
    assert [c.label.split("@")[0] for c in found.causes[:1]] == (
        [lacks.split("@")[0]] if lacks else []
    )
