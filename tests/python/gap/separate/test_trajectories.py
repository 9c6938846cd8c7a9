"""Experiments as joint trajectories, decided on another engine: inverse dynamics, position targets, records."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pandas as pd
import pytest
import yaml
from typer.testing import CliRunner

from axisight import Diagnosis, Effect, Log, Robot, diagnose, load_robot
from axisight.cli import app
from axisight.excitation import read_references
from axisight.gap.facts.experiment import RecordExperiment, SeparatingExperiment, ShowingExperiment

pytest.importorskip("mujoco")


@pytest.fixture(scope="module")
def bench(request: pytest.FixtureRequest) -> Iterator[ModuleType]:
    """benches/next_experiment_targets.py: an arm in MuJoCo that plays targets."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(request.config.rootpath / "benches"))
        import next_experiment_targets  # noqa: PLC0415 - a bench, on the path just now

        yield next_experiment_targets


@pytest.fixture(scope="module")
def robot(bench: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Robot:
    path = tmp_path_factory.mktemp("arm") / "arm.xml"
    path.write_text(bench.Machine().mjcf(), "utf-8")
    return load_robot(path, sample_time_s=1 / bench.RATE_HZ)


@pytest.mark.parametrize(
    "name",
    [
        "viscous, Coulomb friction",
        "offset, drag",
        "spring of gravity, offset",
        "cable, spring of gravity, targets, axis 2",
    ],
)
def test_what_is_open_is_decided_by_targets(bench: ModuleType, robot: Robot, name: str) -> None:
    """Recovery on another engine: undecidable before, the truth and nothing else after."""
    cells, right = bench.run(bench.ROWS[name], robot)
    assert cells[0].startswith("undecidable")
    assert right, cells


def logs_of(bench: ModuleType, name: str) -> list[Log]:
    row = bench.ROWS[name]
    return [
        row.machine.log(row.course(k), k, with_targets=False, cut_s=row.cut_s) for k in (1, 2, 3)
    ]


def found(robot: Robot, logs: list[Log], **asked: object) -> Diagnosis:
    return diagnose(robot=robot, estimation=logs[:2], validation=logs[2:], **asked)


def test_a_designed_trajectory_stays_within_the_limits(bench: ModuleType, robot: Robot) -> None:
    """The played run too: the actuators lag by a few mrad, and what is withheld adds a fifth of a newton metre."""
    logs = logs_of(bench, "offset, drag")
    made = found(robot, logs, separate=True, within=bench.FREE).experiment
    assert isinstance(made, SeparatingExperiment)
    assert made.rivals[0] == "torque_offset@2"
    course = made.plan.trajectory
    assert course.joint_names == ("shoulder", "elbow")
    assert np.abs(course.velocity).max() <= 2.5 * (1 + 1e-9)
    assert np.abs(course.acceleration).max() <= 15.0 * (1 + 1e-9)
    start = logs[0].position_rad[0] * robot.gear_ratio
    assert np.abs(course.position - start).max() <= 1.0 + 1e-9
    new = bench.Machine().log(bench.played_targets(made), 9, with_targets=False)
    assert np.all(np.abs(new.torque_nm).max(axis=0) < [1.1 * 120.0, 1.1 * 45.0])


def test_room_keeps_the_last_link_inside(bench: ModuleType, robot: Robot) -> None:
    logs = logs_of(bench, "offset, drag")
    low, high = np.array([-0.1, -1.0, 0.8]), np.array([0.3, 1.0, 1.0])
    within = bench.ExperimentLimits(
        velocity_rad_s=2.5, travel_rad=1.0, torque_nm=[120.0, 45.0], room_m=[*low, *high]
    )
    made = found(robot, logs, separate=True, within=within).experiment
    assert made is not None
    for angles in made.plan.trajectory.position[::20]:
        _, origin = robot.pose(angles)
        assert np.all(origin >= low)
        assert np.all(origin <= high)


def test_what_inverse_dynamics_does_not_show_is_shown(bench: ModuleType, robot: Robot) -> None:
    """Recovery: at 0.1 rad/s this drag is 5 mNm and hides, a designed motion names it."""
    drag = Effect("quadratic_drag", 2, {"drag_nm_s2_rad2": 0.5})
    machine = bench.Machine(lambda _q, v: -bench.on(2, 0.5 * v[1] * abs(v[1])))
    course = bench.steady(0.1, bench.BOTH_WAYS)
    logs = [machine.log(course(k), k, with_targets=False, cut_s=0.7) for k in (1, 2, 3)]
    before = found(robot, logs, to_show=drag, within=bench.FREE)
    assert before.verdict == "none"
    made = before.experiment
    assert isinstance(made, ShowingExperiment)
    assert made.decides
    targets = bench.played_targets(made)
    new = [machine.log(targets, 9 + k, with_targets=False) for k in range(made.repeats)]
    after = diagnose(robot=robot, estimation=[*logs[:2], *new], validation=logs[2:])
    assert [c.label for c in after.causes] == ["quadratic_drag@2"]


def strange(bench: ModuleType) -> list[Log]:
    """Logs of a machine that does what no effect does: torque that flips over a lattice of both joints."""
    machine = bench.Machine(lambda q, v: bench.on(1, 6.0 * np.sign(np.sin(40 * q[0] * q[1]))))
    return [machine.log(bench.slow_sines(0.3)(k), k, with_targets=False) for k in (1, 2, 3)]


def test_unknown_asks_for_a_record(bench: ModuleType, robot: Robot) -> None:
    seen = found(robot, strange(bench), separate=True, within=bench.FREE)
    assert seen.verdict in ("unknown", "explained_in_part")
    made = seen.experiment
    assert isinstance(made, RecordExperiment)
    assert made.plan.repeats == 3
    assert made.plan.axes == made.slow.axes == (1, 2)
    # Triangles go both ways, for as long.
    slow = made.slow.trajectory.velocity
    assert np.all(np.abs(np.sign(np.round(slow, 6)).mean(axis=0)) < 0.05)
    assert made.load is not None
    assert seen.next_experiment is not None
    assert seen.next_experiment.endswith(str(made))


def test_the_command_writes_a_record_for_detection_limits(
    bench: ModuleType, robot: Robot, tmp_path: Path
) -> None:
    """Verdict *none*: what is asked for is a record that lowers all limits; its load is one that the motors bear."""
    model = tmp_path / "arm.xml"
    model.write_text(bench.Machine().mjcf(), "utf-8")
    files = []
    for k in (1, 2, 3):
        log = bench.Machine().log(bench.slow_sines(0.3)(k), k, with_targets=False)
        table = {"time_s": log.time_s}
        table |= {f"position_{i + 1}": log.position_rad[:, i] for i in range(2)}
        table |= {f"torque_cmd_{i + 1}": log.torque_nm[:, i] for i in range(2)}
        files.append(tmp_path / f"run{k}.parquet")
        pd.DataFrame(table).to_parquet(files[-1])
    command = [
        "diagnose",
        *map(str, files[:2]),
        "--model",
        str(model),
        "--validation",
        str(files[2]),
    ]
    out = tmp_path / "next"
    done = CliRunner().invoke(
        app,
        [
            *command,
            "--next-experiment",
            str(out),
            "--to-show",
            "limits",
            "--torque-limit",
            "120,45",
        ],
    )
    assert done.exit_code == 0, done.output
    for part in ("repeat", "slow", "loaded"):
        message = yaml.safe_load((out / f"{part}_trajectory.yaml").read_text("utf-8"))
        assert message["joint_names"] == ["shoulder", "elbow"]
        rows = pd.read_csv(out / f"{part}_trajectory.csv")
        assert read_references(out / f"{part}_references.parquet").n_samples == len(rows) - 1
    says = (out / "experiment.txt").read_text("utf-8")
    assert "Repeat" in says
    assert "kg" in says
