"""An MJCF is run in MuJoCo itself under the targets of logs: what its import leaves out is no cause."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from axisight import Log, diagnose
from axisight.mujoco.rollout import SAYS, runs_in_mujoco
from axisight.robot_import import import_robot

STEP_S = 0.02
ARM = """<mujoco><option timestep="0.001" integrator="implicitfast"/><worldbody>
<body pos="0 0 1"><joint name="lift" axis="0 1 0" damping="2" armature="0.3"/>
<inertial pos="0.2 0 0" mass="2" diaginertia="0.02 0.02 0.01"/>
<body pos="0.4 0 0"><joint name="elbow" axis="0 1 0" damping="0.5" armature="0.1"/>
<inertial pos="0.15 0 0" mass="1" diaginertia="0.01 0.01 0.003"/></body></body></worldbody>
{more}<actuator>{first}<position joint="elbow" kp="300" kv="15"/></actuator></mujoco>"""
SERVO = '<position joint="lift" kp="800" kv="40"/>'
TENDON = """<tendon><fixed name="t" stiffness="60"><joint joint="lift" coef="1"/>
<joint joint="elbow" coef="1"/></fixed></tendon>"""


def model(folder: Path, more: str = "", first: str = SERVO) -> Path:
    path = folder / "arm.xml"
    path.write_text(ARM.format(more=more, first=first))
    return path


def recorded(path: Path, seed: int, noise_rad: float = 2e-4) -> Log:
    """A run of the file in MuJoCo, written without the code under test."""
    machine = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(machine)
    rng = np.random.default_rng(seed)
    time = np.arange(600) * STEP_S
    target = np.zeros((len(time), 2))
    for line in range(1, 6):
        phase = rng.uniform(0, 2 * np.pi, 2)
        target += 0.15 / line * (np.cos(0.7 * line * time[:, None] + phase) - np.cos(phase))
    for _ in range(round(6.0 / machine.opt.timestep)):
        mujoco.mj_step(machine, data)
    angle = np.empty_like(target)
    for k in range(len(time)):
        angle[k] = data.qpos
        for _ in range(round(STEP_S / machine.opt.timestep)):
            data.ctrl[:] = target[k]
            mujoco.mj_step(machine, data)
    return Log(
        name=f"run{seed}",
        source=Path(f"run{seed}.parquet"),
        sample_time_s=STEP_S,
        time_s=time,
        torque_nm=np.full_like(angle, np.nan),
        position_rad=angle + noise_rad * rng.normal(size=angle.shape),
        position_ref_rad=target,
    )


@pytest.mark.parametrize("more", ["", TENDON], ids=["bare", "tendon"])
def test_runs_are_those_of_mujoco(tmp_path: Path, more: str):
    path = model(tmp_path, more)
    log = recorded(path, 1, noise_rad=0.0)
    (run,) = runs_in_mujoco(import_robot(path, sample_time_s=STEP_S), [log])
    assert not run.has_torque
    # Both begin at rest, to what five seconds leave.
    np.testing.assert_allclose(run.position_rad, log.position_rad, atol=1e-6)


def test_actuators_with_other_numbers_of_commands_are_run(tmp_path: Path):
    """A <pid> that takes speeds too and a passive motor before it: the run is that of the same servo."""
    if not hasattr(mujoco.MjModel, "actuator_ctrlnum"):
        pytest.skip("MuJoCo before 3.12 has one command for each actuator")
    log = recorded(model(tmp_path), 1, noise_rad=0.0)
    nothing = 'motorconst="1e-9 0" resistance="1" input="none" cogging="1e-9 7 0"'
    first = f'<dcmotor joint="elbow" {nothing}/><pid joint="lift" kp="800" kv="40"/>'
    path = model(tmp_path, first=first)
    (run,) = runs_in_mujoco(import_robot(path, sample_time_s=STEP_S), [log])
    np.testing.assert_allclose(run.position_rad, log.position_rad, atol=1e-6)


def test_what_an_import_leaves_out_is_no_cause(tmp_path: Path):
    path = model(tmp_path, TENDON)
    logs = [recorded(path, seed) for seed in (1, 2, 3)]
    robot = import_robot(path, sample_time_s=STEP_S)
    found = diagnose(robot, logs[:2], validation=logs[2:])
    assert found.verdict == "none"
    assert SAYS in found.checks
    # The same model without the file is charged with the tendon.
    alone = diagnose(robot.with_parameters({}), logs[:2], validation=logs[2:])
    assert alone.verdict != "none"


def test_what_is_no_run_of_the_simulator_is_not_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    path = model(tmp_path)
    robot, log = import_robot(path, sample_time_s=STEP_S), recorded(path, 1)
    assert len(runs_in_mujoco(robot, [log])) == 1
    target = log.position_ref_rad
    assert target is not None
    wrong = [
        replace(log, torque_nm=np.zeros_like(target)),
        replace(log, position_ref_rad=None),
        replace(log, position_ref_rad=np.where(target > 0.2, np.nan, target)),
        replace(log, position_ref_rad=1e9 * target),
        replace(log, sample_time_s=0.0123),
        replace(
            log,
            position_rad=log.position_rad[:, :1],
            torque_nm=log.torque_nm[:, :1],
            position_ref_rad=target[:, :1],
            axis_kinds=("revolute",),
        ),
    ]
    for one in wrong:
        assert runs_in_mujoco(robot, [log, one]) == []
    changed = robot.with_parameters({"elbow.mass": 1.2})
    assert runs_in_mujoco(changed, [log]) == []
    # An unstable run leaves no file of warnings behind.
    assert [x.name for x in tmp_path.iterdir()] == ["arm.xml"]
    path.unlink()
    assert runs_in_mujoco(robot, [log]) == []


def test_a_servo_of_speeds_is_not_told_positions(tmp_path: Path):
    servo = '<intvelocity joint="lift" kp="800" kv="40" actrange="-3 3"/>'
    path = model(tmp_path, first=servo)
    log = recorded(model(tmp_path), 1)
    model(tmp_path, first=servo)
    robot = import_robot(path, sample_time_s=STEP_S)
    assert runs_in_mujoco(robot, [log]) == []
