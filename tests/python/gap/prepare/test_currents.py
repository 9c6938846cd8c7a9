"""Diagnoses of currents whose torque constant nobody knows: causes in Nm, and the constant."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

import rigid_arm
from axisight import Effect, Log, Robot, diagnose, load_robot
from axisight.cli import app
from axisight.errors import InputError, LogError
from axisight.explore.session import Session
from axisight.gap import Diagnosis, Settings
from axisight.gap.facts.simulator_variant import AS_GIVEN, Variant
from axisight.gap.intake.preview import look_beside
from axisight.gap.prepare.currents import in_torques, unknown_axes
from axisight.gap.simulator.own_parameters import constant_name, with_values
from axisight.gap.simulator.rigid_torque import predicted_torque
from axisight.logs import check_log, parse_column_map, read_case, read_log
from gap_data import HELD, PLAN, bare_axis, logs_of, scattered
from import_data import URDF, written
from model_logs import STEP_S, sines

CONSTANTS = np.array([0.37, 0.05])
FRICTION_NM = 1.5


def arm(folder: Path, drives: str = "") -> Path:
    """Write an arm of two joints without friction and gears."""
    bare = URDF.replace('<dynamics damping="0.7" friction="1.5"/>', "")
    written(folder, drives, "arm.drives.toml")
    return written(folder, bare[: bare.index("  <transmission")] + "</robot>")


def arm_log(
    robot: Robot, run: int, friction_nm: float, nominal: float = np.nan, load_kg: float = 0.0
) -> Log:
    """The log of the arm with dry friction on its first joint and a load at its end, as currents.

    Read by ``nominal`` constants.
    """
    random = np.random.default_rng(run)
    q, v, a = (np.ascontiguousarray(x) for x in sines(run, 2))
    load = Effect("payload", None, {"mass_kg": load_kg, "x_m": 0.2, "y_m": 0.1, "z_m": 0.05})
    torque = predicted_torque(robot, Variant({}, (load,)), (q, v, a, 0 * q))
    torque += np.array([friction_nm, 0.0]) * np.tanh(v / 0.01)
    torque += 0.02 * random.normal(size=q.shape)
    read_by = nominal if np.isfinite(nominal) else 1.0
    return Log(
        name=f"run{run}",
        source=Path(f"run{run}.parquet"),
        sample_time_s=STEP_S,
        time_s=STEP_S * np.arange(len(q)),
        torque_nm=read_by * torque / CONSTANTS,
        position_rad=q + 1e-6 * random.normal(size=q.shape),
        nominal_nm_a=(nominal, nominal),
    )


def of_arm(
    robot: Robot, friction_nm: float, nominal: float = np.nan, load_kg: float = 0.0
) -> Diagnosis:
    logs = [arm_log(robot, run, friction_nm, nominal, load_kg) for run in range(3)]
    return diagnose(robot=robot, estimation=logs[:2], validation=logs[2:])


def within(found: Diagnosis, robot: Robot, axis: int, truth: float) -> None:
    """The constant of an axis is in its interval, of less than ten per cent, and the finding says so."""
    change = found.refit[constant_name(robot, axis)]
    (said,) = (f for f in found.findings if f.name == "torque_constant_unknown" and f.axis == axis)
    nominal = float(said.message.split("read with ")[1].split(" ")[0])
    assert nominal * (1 + change.low) < truth < nominal * (1 + change.high)
    assert change.high - change.low < 0.1 * (1 + change.value)
    value = nominal * (1 + change.value)
    assert float(said.message.split("the logs say ")[1].split(" ")[0]) == pytest.approx(
        value, rel=1e-3
    )


@pytest.mark.parametrize("nominal", [np.nan, 0.25])
def test_friction_has_its_torque_and_the_motor_its_constant(tmp_path: Path, nominal: float):
    """By inverse dynamics; rated constants are a third too small on one axis, and five times too large on the other."""
    robot = load_robot(arm(tmp_path))
    found = of_arm(robot, FRICTION_NM, nominal)
    assert (found.mode, found.verdict) == ("inverse_dynamics", "explained")
    (cause,) = found.causes
    assert cause.label == "coulomb_friction@1"
    size = cause.parameters["coulomb_nm"]
    assert size.low < FRICTION_NM < size.high
    assert size.value == pytest.approx(FRICTION_NM, rel=0.05)
    for axis in (1, 2):
        within(found, robot, axis, CONSTANTS[axis - 1])
    labels = {candidate.label for candidate in found.ranking}
    assert not labels & {
        f"{e}@{k}" for e in ("torque_constant", "torque_sensor_gain") for k in (1, 2)
    }


def test_nothing_missing_is_nothing_found(tmp_path: Path):
    robot = load_robot(arm(tmp_path))
    found = of_arm(robot, 0.0)
    assert found.verdict == "none"
    for axis in (1, 2):
        within(found, robot, axis, CONSTANTS[axis - 1])


def test_a_load_is_named_beside_constants_that_nobody_knows(tmp_path: Path):
    """It takes the ratio of torque and current off by a fifth, and the re-fit without it by more."""
    robot = load_robot(arm(tmp_path))
    found = of_arm(robot, 0.0, load_kg=0.8)
    assert [cause.label for cause in found.causes] == ["payload"]
    mass = found.causes[0].parameters["mass_kg"]
    assert mass.low < 0.8 < mass.high
    for axis in (1, 2):
        within(found, robot, axis, CONSTANTS[axis - 1])
    # Masses and constants do much the same: never certain.
    assert found.verdict == "undecidable"
    assert found.equivalent == (("payload", "torque_constant@1", "torque_constant@2"),)
    assert found.causes[0].probability <= 0.5
    assert "State the torque constants" in found.next_experiment


def test_friction_everywhere_on_six_axes():
    """Most of what the motors of the hand give is friction; each current has another constant."""
    robot = rigid_arm.arm()
    constants = np.array([0.9, 0.8, 0.37, 0.05, 2.0, 0.02])
    coulomb, viscous = rigid_arm.COULOMB_NM, rigid_arm.VISCOUS
    logs = [
        dataclasses.replace(log, torque_nm=log.torque_nm / constants, nominal_nm_a=(np.nan,) * 6)
        for log in (rigid_arm.log_of(robot, run, coulomb, viscous, 20.0) for run in range(3))
    ]
    nominal = [n.nm_per_a for n in in_torques(robot, logs[:2], logs[2:]).nominal]
    # Of the wrist, whose torque is friction by nine parts of ten, to an eighth.
    np.testing.assert_allclose(nominal, constants, rtol=0.13)
    settings = Settings(bootstrap=50)
    found = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:], settings=settings)
    assert found.verdict == "explained"
    sizes = {(c.effect, c.axis): next(iter(c.parameters.values())) for c in found.causes}
    wanted = {("coulomb_friction", k): x for k, x in enumerate(coulomb, start=1)}
    wanted |= {("viscous_friction", k): x for k, x in enumerate(viscous, start=1)}
    assert sizes.keys() == wanted.keys()
    assert all(sizes[key].low < truth < sizes[key].high for key, truth in wanted.items())
    changes = [found.refit[constant_name(robot, axis)].value for axis in range(1, 7)]
    # Masses and rotors are known to 1.5 %, and the constants with them: twice that.
    np.testing.assert_allclose(nominal * (1 + np.array(changes)), constants, rtol=0.03)


def as_currents(log: Log, *, references: bool = True) -> Log:
    told = log.velocity_ref_rad_s if references else None
    current = log.torque_nm / CONSTANTS[0]
    return dataclasses.replace(
        log, torque_nm=current, nominal_nm_a=(np.nan,), velocity_ref_rad_s=told
    )


def axis_logs(error: float, *, references: bool = True) -> tuple[list[Log], list[Log]]:
    """Logs of an elastic axis with friction, whose motor gives ``1 + error`` of what its controller commands."""
    machine = scattered(bare_axis(), 3)
    missing = [
        Effect("coulomb_friction", 1, {"coulomb_nm": 0.6}),
        Effect("torque_constant", 1, {"relative_error": error}),
    ]
    plans = (PLAN, HELD)
    fit, held = (
        [as_currents(log, references=references) for log in logs_of(machine, missing, plan)]
        for plan in plans
    )
    return fit, held


@pytest.mark.parametrize(("error", "references"), [(0.4, True), (-0.3, True), (0.0, False)])
def test_a_motor_that_gives_other_than_its_controller_believes(error: float, references: bool):
    """In closed loop currents are read by what the controller commands, and the constant is the motor's."""
    robot = bare_axis()
    fit, held = axis_logs(error, references=references)
    (nominal,) = in_torques(robot, fit, held).nominal
    # Of logs without references the noise of positions tells, to its own accuracy.
    assert nominal.nm_per_a == pytest.approx(CONSTANTS[0], rel=1e-6 if references else 1e-3)
    found = diagnose(robot=robot, estimation=fit, validation=held, settings=Settings(seed=1))
    assert (found.mode, found.verdict) == ("closed_loop", "explained")
    assert [cause.label for cause in found.causes] == ["coulomb_friction@1"]
    size = found.causes[0].parameters["coulomb_nm"]
    assert size.low < 0.6 < size.high
    within(found, robot, 1, CONSTANTS[0] * (1 + error))


def test_a_simulator_with_a_constant_gives_the_torque_over_it(tmp_path: Path):
    """u = tau / (1 + e): by hand, where a robot states an error of its own too."""
    robot = load_robot(arm(tmp_path))
    stated = robot.with_effects([Effect("torque_constant", 1, {"relative_error": 0.5})])
    at = tuple(np.ascontiguousarray(x) for x in (*sines(0, 2), np.zeros((1500, 2))))
    plain = predicted_torque(robot, AS_GIVEN, at)
    values = {"shoulder.torque_constant": 0.25, "elbow.mass": robot.parameters()["elbow.mass"]}
    for one in (robot, stated):
        off = predicted_torque(one, Variant(values), at)
        np.testing.assert_allclose(off, plain / [1.25, 1.0], rtol=1e-9, atol=1e-12)
    assert with_values(stated, {}).effects == stated.effects


def column_map(scale: str = '"unknown"') -> str:
    axes = "".join(
        f'[[axis]]\nposition = {{ name = "q{k}", unit = "rad" }}\n'
        f'torque = {{ name = "i{k}", unit = "A", scale = {scale} }}\n'
        for k in (0, 1)
    )
    return f'schema = "axisight.columns/1"\ntime = {{ name = "t" }}\n{axes}'


def table(folder: Path, log: Log) -> Path:
    path = folder / f"{log.name}.parquet"
    columns = {f"q{k}": log.position_rad[:, k] for k in (0, 1)}
    columns |= {f"i{k}": log.torque_nm[:, k] for k in (0, 1)}
    pd.DataFrame({"t": log.time_s, **columns}).to_parquet(path)
    return path


def run(*arguments: object) -> tuple[int, str]:
    result = CliRunner().invoke(app, [*map(str, arguments)])
    return result.exit_code, " ".join(result.output.split())


def test_the_column_map_says_that_nobody_knows(tmp_path: Path):
    path = arm(tmp_path)
    columns = written(tmp_path, column_map(), "columns.toml")
    logs = [table(tmp_path, arm_log(load_robot(path), k, FRICTION_NM)) for k in range(3)]
    verdict = tmp_path / "verdict.json"
    status, said = run("diagnose", path, *logs, "--columns", columns, "--json", verdict)
    assert status == 0, said
    assert "torque_constant_unknown" in said
    read = json.loads(verdict.read_text())
    assert [cause["effect"] for cause in read["causes"]] == ["coulomb_friction"]
    assert {"shoulder.torque_constant", "elbow.torque_constant"} <= read["refit"].keys()
    status, said = run("check", logs[0], "--columns", columns, "--robot", path)
    assert status == 0, said
    assert "a current whose torque constant nobody knows" in said
    assert "flagged: torque_constant_unknown" in said
    # Others need torques.
    torques = ("simulate", path, logs[0], "--torque", "--out", tmp_path / "out.parquet")
    others = ("explore", path, *logs), ("identify", "rigid-body", path, *logs), torques
    for command in others:
        status, said = run(*command, "--columns", columns)
        assert status != 0
        assert "only a diagnosis" in said or "expected torques, got currents" in said, said
    case = 'schema = "axisight.case/1"\nname = "c"\nrobot = "arm.urdf"\n' + "".join(
        f'[[log]]\nfile = "run{k}.parquet"\nrole = "estimation"\n' for k in (0, 1)
    )
    (tmp_path / "case.toml").write_text(case)
    assert read_case(tmp_path, columns, currents=True).logs[0].nominal_nm_a == pytest.approx(
        (np.nan, np.nan), nan_ok=True
    )
    with pytest.raises(LogError, match=r"axis 1: torque: expected scale .*only a diagnosis"):
        read_case(tmp_path, columns)


def test_a_log_of_currents_says_that_it_is_one(tmp_path: Path):
    robot = load_robot(arm(tmp_path, "[joint.elbow]\ntorque_constant = 0.04\n"))
    log, columns = table(tmp_path, arm_log(robot, 0, 0.0)), parse_column_map(column_map())
    read = read_log(log, columns, robot=robot, currents=True)
    # The rated one is taken where the drive data have it.
    assert read.nominal_nm_a == pytest.approx((np.nan, 0.04), nan_ok=True)
    assert read.to_xarray().torque.attrs["units"] == "A, Nm"
    assert unknown_axes([read]) == [1, 2]
    assert unknown_axes([read_log(log, parse_column_map(column_map("0.1")), robot=robot)]) == []
    assert any("nobody knows" in f.message for f in check_log(log, columns).findings)
    with pytest.raises(LogError, match=r'got "unknown", with which only a diagnosis'):
        read_log(log, columns, robot=robot)
    with pytest.raises(InputError, match="nominal_nm_a: expected 2 entries, got 1"):
        dataclasses.replace(read, nominal_nm_a=(0.1,))
    nominal = {n.axis: n.source for n in in_torques(robot, [read], []).nominal}
    assert nominal == {
        1: "torque that the robot predicts over current",
        2: "rated, of the drive data",
    }
    assert {f.name for f in look_beside(robot, read).findings} == {"torque_constant_unknown"}


def test_what_no_constant_can_be_found_from_is_refused(tmp_path: Path):
    robot = load_robot(arm(tmp_path))
    log = arm_log(robot, 0, 0.0)
    known = dataclasses.replace(log, nominal_nm_a=())
    with pytest.raises(InputError, match="expected of the same axes in all logs"):
        in_torques(robot, [log], [known])
    silent = dataclasses.replace(log, torque_nm=0 * log.torque_nm)
    with pytest.raises(InputError, match=r"axis 1: torque: .* that is friction at most"):
        in_torques(robot, [silent], [])
    with pytest.raises(InputError, match="simulated: expected logs of torques"):
        diagnose(robot=robot, estimation=[log], validation=[log], simulated=[known, known])
    with pytest.raises(InputError, match="explore: expected torques"):
        Session("arm", robot, [log], [log])
    # A current of the other sign is no constant below zero: the gate sees it.
    turned = dataclasses.replace(log, torque_nm=log.torque_nm * [-1.0, 1.0])
    (first, _) = in_torques(robot, [turned], []).nominal
    assert first.nm_per_a > 0
    assert any(f.name == "sign_flipped" for f in look_beside(robot, turned).findings)
