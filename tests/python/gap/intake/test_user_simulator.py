"""The user's own simulator beside the logs: what the model lacks of it is not taken for the machine's."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from numpy.typing import NDArray
from typer.testing import CliRunner

import rigid_arm
from axisight import Diagnosis, Effect, Log, Robot, Settings, diagnose, load_robot, simulate
from axisight.cli import app
from axisight.errors import InputError
from axisight.explore.session import Session, Version
from axisight.gap import verdict_schema
from axisight.gap.facts.simulator_variant import Variant
from axisight.gap.intake.user_simulator import difference, differs, noted, paired
from axisight.gap.views.closed_loop import ClosedLoopView
from axisight.gap.views.inverse_dynamics import InverseView
from gap_data import log_of
from servo_arm import MACHINES as SERVOS
from servo_arm import NOMINAL, simulator

Array = NDArray[np.float64]

QUICK = Settings(bootstrap=50)
THEIRS = Effect("coulomb_friction", 2, {"coulomb_nm": 0.5})
MACHINES = Effect("viscous_friction", 3, {"viscous_nm_s_rad": 0.05})


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("irb6600_like")


def reference(robot: Robot, seed: int) -> Array:
    """Sums of sines of all axes (n, 3) [rad/s] that fade in, 5 s."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(5.0 / robot.sample_time_s)) * robot.sample_time_s
    waves = [
        sum(np.sin(2 * np.pi * (f * t + rng.uniform())) for f in rng.uniform(0.5, 12.0, 8))
        for _ in range(robot.n_axes)
    ]
    return np.column_stack(waves) * (6.0 * np.minimum(t, 1.0))[:, None]


def logs_of(robot: Robot, effects: list[Effect], first_run: int = 0) -> list[Log]:
    return [log_of(robot, effects, reference(robot, i), first_run + i) for i in range(3)]


@pytest.fixture(scope="module")
def real(robot: Robot) -> list[Log]:
    return logs_of(robot, [THEIRS, MACHINES])


@pytest.fixture(scope="module")
def theirs(robot: Robot) -> list[Log]:
    return logs_of(robot, [THEIRS], 10)


@pytest.fixture(scope="module")
def plain(robot: Robot, real: list[Log]) -> Diagnosis:
    return diagnose(robot=robot, estimation=real[:2], validation=real[2:])


def test_what_the_model_lacks_of_the_simulator_is_no_cause(
    robot: Robot, real: list[Log], theirs: list[Log], plain: Diagnosis
) -> None:
    assert {c.label for c in plain.causes} == {THEIRS.label, MACHINES.label}
    found = diagnose(robot=robot, estimation=real[:2], validation=real[2:], simulated=theirs)
    assert [c.label for c in found.causes] == [MACHINES.label]
    assert found.simulator is not None
    assert found.simulator.taken_off
    # Friction of their axis 2, and what it does to axis 3.
    assert differs(found.simulator).tolist() == [1, 2]
    assert [f.axis for f in found.findings if f.name == "simulator_differs"] == [2, 3]
    # The gap is that of their simulator: the logs less its own torques.
    error = real[2].torque_nm - theirs[2].torque_nm
    gap = np.sqrt((error**2).mean(axis=0) / real[2].torque_nm.var(axis=0))
    # Noise is drawn twice, in theirs and in the logs.
    assert found.gap.before_per_axis == pytest.approx(gap, rel=0.05)
    # The explorer shows the same gap, which what the machine has takes away.
    seen = Session("beside", robot, real[:2], real[2:], simulated=theirs)
    assert seen.held_gap() == pytest.approx(found.gap.before_per_axis)
    left = seen.held_gap(Version.of([MACHINES]))
    assert left[2] < 0.5 * seen.held_gap()[2]


def test_a_model_that_is_the_simulator_changes_nothing(
    robot: Robot, real: list[Log], plain: Diagnosis
) -> None:
    """Their logs without noise are the model's own, but for rounding."""
    own = [
        replace(x, torque_nm=run["torque_cmd_nm"].values, position_rad=run["position_rad"].values)
        for x, run in zip(real, exact(robot), strict=True)
    ]
    found = diagnose(robot=robot, estimation=real[:2], validation=real[2:], simulated=own)
    assert found.simulator is not None
    assert found.simulator.per_axis.max() < 1e-9
    assert not noted(found.simulator)
    assert [c.label for c in found.causes] == [c.label for c in plain.causes]
    assert found.gap.before == pytest.approx(plain.gap.before, rel=1e-9)


def exact(robot: Robot) -> list[xr.Dataset]:
    return [simulate(robot, reference(robot, i), method="rk4") for i in range(3)]


def test_by_inverse_dynamics_the_gap_stays_that_of_the_model(
    robot: Robot, real: list[Log], theirs: list[Log]
) -> None:
    def bare(logs: list[Log]) -> list[Log]:
        return [replace(x, velocity_ref_rad_s=None) for x in logs]

    rigid = Robot.from_toml(robot.toml.split("[controller]")[0] + '[controller]\nkind = "none"\n')
    found = diagnose(
        robot=rigid, estimation=bare(real[:2]), validation=bare(real[2:]), simulated=bare(theirs)
    )
    assert found.mode == "inverse_dynamics"
    assert found.simulator is not None
    assert not found.simulator.taken_off
    assert "The gap is that of the model" in " ".join(found.checks)


# Of a rigid arm: friction that their simulator has on axis 1, and the machine on axes 1 and 3 [Nm].
THEIR_COULOMB_NM = (8.0, 0.0, 0.0, 0.0, 0.0, 0.0)
COULOMB_NM = (8.0, 0.0, 7.0, 0.0, 0.0, 0.0)


def rigid_logs(rigid: Robot, late_s: float = 0.0) -> tuple[list[Log], list[Log]]:
    """Logs of a machine, and of a simulator without noise along the same motion, or somewhat later."""
    real = [rigid_arm.log_of(rigid, i, COULOMB_NM, np.zeros(6), 10.0) for i in range(3)]
    return real, [along(rigid, log, i, late_s) for i, log in enumerate(real)]


def along(rigid: Robot, log: Log, seed: int, late_s: float) -> Log:
    """What their simulator has along the motion of a log."""
    position, speed, acceleration = rigid_arm.motion(seed, 10.0)
    rotors = np.array([rigid_arm.motor_inertia(mass) for mass in rigid_arm.MASSES])
    torque = rigid.inverse_dynamics(position, speed, acceleration) + rotors * acceleration
    torque += rigid_arm.friction_torque(speed, np.array(THEIR_COULOMB_NM), np.zeros(6))
    samples = round(late_s * rigid_arm.RATE_HZ)
    return replace(
        log,
        torque_nm=np.roll(torque, samples, axis=0),
        # The motions are periods of ten seconds.
        position_rad=np.roll(position, samples, axis=0) if samples else log.position_rad,
    )


def test_along_the_same_motion_inverse_dynamics_takes_it_off() -> None:
    rigid = rigid_arm.arm()
    real, own = rigid_logs(rigid)
    found = diagnose(
        robot=rigid, estimation=real[:2], validation=real[2:], simulated=own, settings=QUICK
    )
    assert found.mode == "inverse_dynamics"
    assert [c.label for c in found.causes] == ["coulomb_friction@3"]
    assert found.causes[0].parameters["coulomb_nm"].value == pytest.approx(7.0, rel=0.05)
    assert found.simulator is not None
    assert found.simulator.taken_off
    assert differs(found.simulator).tolist() == [0]
    # On the axis of their friction noise is left.
    gap = found.gap
    assert gap.before_per_axis[0] == pytest.approx(gap.floor_per_axis[0], rel=0.1)
    assert "The gap is that of your simulator" in " ".join(found.checks)
    seen = Session("along", rigid, real[:2], real[2:], simulated=own)
    assert seen.held_gap() == pytest.approx(found.gap.before_per_axis)


def test_along_another_motion_the_gap_stays_that_of_the_model() -> None:
    """Thirty milliseconds later: what friction makes of reversals lies beside those of the log."""
    rigid = rigid_arm.arm()
    real, own = rigid_logs(rigid, late_s=0.03)
    found = diagnose(
        robot=rigid, estimation=real[:2], validation=real[2:], simulated=own, settings=QUICK
    )
    assert {c.label for c in found.causes} == {"coulomb_friction@1", "coulomb_friction@3"}
    assert found.simulator is not None
    assert not found.simulator.taken_off
    assert differs(found.simulator).tolist() == [0]
    assert "your simulator moves differently" in " ".join(found.checks)


def test_motions_lie_apart_by_a_share_of_them() -> None:
    """Identity, and by hand: a motion that is one per cent larger is one per cent off in speed."""
    rigid = rigid_arm.arm()
    real, own = rigid_logs(rigid)
    view = InverseView(rigid, real[:2], QUICK, real[2:])
    np.testing.assert_allclose(view.apart(real, own), 0.0, atol=1e-12)
    larger = [replace(x, position_rad=1.01 * x.position_rad) for x in real]
    speeds = [view.filtering(x)[1] for x in real]
    by_hand = np.sqrt((np.concatenate(speeds) ** 2).mean(axis=0)) / np.concatenate(speeds).std(
        axis=0
    )
    apart = view.apart(real, larger)
    assert np.all(apart >= 0.01 * by_hand * (1 - 1e-9))
    # Inertia, linear in the motion, and gravity, at most so.
    assert np.all(apart < 0.03)


def test_the_model_is_simulated_once_along_the_logs_of_their_simulator(
    robot: Robot, real: list[Log], theirs: list[Log], monkeypatch: pytest.MonkeyPatch
) -> None:
    """In closed loop what is taken off the logs is what is compared."""
    view = ClosedLoopView(robot, real[:2], QUICK)
    simulated: list[int] = []
    plain = ClosedLoopView.torques

    def counted(self: ClosedLoopView, variant: Variant, logs: Sequence[Log]) -> list[Array]:
        simulated.append(len(logs))
        return plain(self, variant, logs)

    monkeypatch.setattr(ClosedLoopView, "torques", counted)
    off = difference(view, theirs, QUICK)
    assert simulated == [len(theirs)]
    for taken, compared in zip(off.taken_nm, off.torques_nm, strict=True):
        np.testing.assert_array_equal(taken, compared)


def test_by_inverse_dynamics_it_is_taken_off_before_the_low_pass() -> None:
    """Low-passed, what is taken off is what is compared: the low-pass is linear."""
    rigid = rigid_arm.arm()
    real, own = rigid_logs(rigid)
    view = InverseView(rigid, real[:2], QUICK, real[2:])
    off = difference(view, own, QUICK)
    for log, taken, compared in zip(own, off.taken_nm, off.torques_nm, strict=True):
        low = view.filtering.compared(taken, log.sample_time_s)
        np.testing.assert_allclose(low, compared, atol=1e-9 * np.abs(log.torque_nm).max())


def test_logs_of_other_motions_are_refused(real: list[Log], theirs: list[Log]) -> None:
    with pytest.raises(InputError, match="one for each of 3 logs"):
        paired(real, theirs[:2])
    with pytest.raises(InputError, match=r"'run11'.*expected the references of log 'run0'"):
        paired(real[:1], theirs[1:2])
    with pytest.raises(InputError, match=r"expected \d+ samples of 3 axes"):
        paired(real[:1], [theirs[0].part(0.0, 3.0)])
    with pytest.raises(InputError, match="expected a sample time"):
        paired(real[:1], [replace(theirs[0], sample_time_s=0.002)])
    bare = replace(theirs[0], velocity_ref_rad_s=None)
    assert paired(real[:1], [bare])[0].velocity_ref_rad_s is real[0].velocity_ref_rad_s


def test_on_the_command_line(
    tmp_path: Path, robot: Robot, real: list[Log], theirs: list[Log]
) -> None:
    files = [[table(tmp_path / f"{kind}{i}.parquet", x) for i, x in enumerate(logs)]
             for kind, logs in (("real", real), ("own", theirs))]  # fmt: skip
    (tmp_path / "robot.toml").write_text(robot.toml)
    own = [part for file in files[1] for part in ("--simulated", str(file))]
    verdict = tmp_path / "verdict.json"
    out = CliRunner().invoke(
        app,
        ["diagnose", str(tmp_path / "robot.toml"), *map(str, files[0][:2]),
         "--validation", str(files[0][2]), *own, "--json", str(verdict)],
    )  # fmt: skip
    assert out.exit_code == 0, out.output
    said = " ".join(out.output.split())
    assert "simulator_differs" in said or "reproduces your simulator" in said
    content = json.loads(verdict.read_text())
    jsonschema.validate(content, verdict_schema())
    assert content["simulator"]["taken_off"] is True
    assert content["simulator"]["of_gap"][1] > 0.9


def table(path: Path, log: Log) -> Path:
    columns = {"time_s": log.time_s}
    for i in range(log.n_axes):
        assert log.velocity_ref_rad_s is not None
        columns[f"velocity_ref_{i + 1}"] = log.velocity_ref_rad_s[:, i]
        columns[f"torque_cmd_{i + 1}"] = log.torque_nm[:, i]
        columns[f"position_{i + 1}"] = log.position_rad[:, i]
    pd.DataFrame(columns).to_parquet(path)
    return path


def test_targets_have_an_own_simulator_too(tmp_path: Path) -> None:
    """Damping that the model file lacks, and their simulator has, is none of the machine's causes."""
    pytest.importorskip("mujoco", reason="MuJoCo comes with the extra `mujoco`")
    damped = SERVOS["viscous_friction@3"]
    machine = damped.with_changed("dry_friction", 2, 2.5)
    logs = [machine.log(run) for run in (1, 2, 3)]
    own = [damped.log(run, noise_rad=0.0) for run in (1, 2, 3)]
    found = diagnose(
        robot=simulator(tmp_path), estimation=logs[:2], validation=logs[2:], simulated=own
    )
    assert found.simulator is not None
    assert found.simulator.taken_off
    assert 2 in differs(found.simulator)
    assert found.verdict == "explained"
    assert [c.label for c in found.causes] == ["coulomb_friction@2"]


def test_the_model_of_an_mjcf_is_its_simulator(tmp_path: Path) -> None:
    """To half a per cent of the torque that its errors are: below the noise of any encoder."""
    pytest.importorskip("mujoco", reason="MuJoCo comes with the extra `mujoco`")
    logs = [SERVOS["coulomb_friction@2"].log(run) for run in (1, 2, 3)]
    own = [NOMINAL.log(run, noise_rad=0.0) for run in (1, 2, 3)]
    found = diagnose(
        robot=simulator(tmp_path), estimation=logs[:2], validation=logs[2:], simulated=own
    )
    assert found.simulator is not None
    assert found.simulator.per_axis.max() < 0.005
    assert not noted(found.simulator)
    assert [c.label for c in found.causes] == ["coulomb_friction@2"]
