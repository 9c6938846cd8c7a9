"""Dry friction of a machine that MuJoCo simulates is found with its size, and nothing else with it."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from axisight import Log, Settings, diagnose
from axisight.robot_import import import_robot

SAMPLE_S, STEP_S, LATE_STEPS = 0.005, 0.001, 6
FRICTION_NM = 0.2
ARM = """<mujoco><option timestep="0.001" integrator="implicitfast"/><worldbody><body>
<joint name="hinge" axis="0 1 0" damping="0.08" armature="0.03" frictionloss="{friction}"/>
<inertial pos="0 0 -0.12" mass="0.4" diaginertia="0.001 0.001 0.0002"/></body></worldbody>
<actuator><position joint="hinge" kp="70" kv="0.9"/></actuator></mujoco>"""


def recorded(seed: int) -> Log:
    """Return a run under a target of rising frequency, followed late; written without the code under test."""
    machine = mujoco.MjModel.from_xml_string(ARM.format(friction=FRICTION_NM))
    data = mujoco.MjData(machine)
    rng = np.random.default_rng(seed)
    time = SAMPLE_S * np.arange(2400)
    turn = 2 * np.pi * (0.4 + rng.uniform(0.25, 0.3) * time) * time
    target = 0.25 * np.sin(turn)
    told = np.concatenate([np.zeros(LATE_STEPS), np.repeat(target, round(SAMPLE_S / STEP_S))])
    angle = np.empty_like(target)
    for k in range(len(told) - LATE_STEPS):
        if k % round(SAMPLE_S / STEP_S) == 0:
            angle[k // round(SAMPLE_S / STEP_S)] = data.qpos[0]
        data.ctrl[0] = told[k]
        mujoco.mj_step(machine, data)
    return Log(
        name=f"run{seed}",
        source=Path(f"run{seed}.parquet"),
        sample_time_s=SAMPLE_S,
        time_s=time,
        torque_nm=np.full((len(time), 1), np.nan),
        position_rad=(angle + 2e-5 * rng.normal(size=angle.shape))[:, None],
        position_ref_rad=target[:, None],
    )


def test_friction_and_a_delay_of_a_machine_in_mujoco_are_found(tmp_path: Path):
    path = tmp_path / "bare.xml"
    path.write_text(ARM.format(friction=0.0))
    robot = import_robot(path, sample_time_s=STEP_S)
    logs = [recorded(seed) for seed in (1, 2, 3)]
    found = diagnose(robot, logs[:2], validation=logs[2:], settings=Settings(threads=1))
    assert found.verdict == "explained", found.headline
    values = {c.label: c.parameters for c in found.causes}
    assert values.keys() == {"input_delay@1", "coulomb_friction@1"}
    friction = values["coulomb_friction@1"]["coulomb_nm"]
    assert friction.low < FRICTION_NM < friction.high
    # Plain dry friction ends 10 to 20 % below it; the corner of the law leaves about one per cent open.
    assert friction.value == pytest.approx(FRICTION_NM, rel=0.03)
    late = values["input_delay@1"]["delay_s"]
    assert late.low < LATE_STEPS * STEP_S < late.high
