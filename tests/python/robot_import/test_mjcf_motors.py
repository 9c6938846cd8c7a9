"""Import of pid and dcmotor actuators, drag, late encoders: MuJoCo's own torques say what they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from axisight import load_robot
from axisight.mujoco.torques import EffectTorques
from axisight.robot_import.load import import_robot
from axisight.write_back import write_model
from found_causes import several
from import_data import written

mujoco = pytest.importorskip("mujoco", minversion="3.12")

GEAR = 50.0
DC = f'<dcmotor name="a" joint="j" gear="{GEAR}" motorconst="0.1 0" resistance="2"'


def model_text(actuator: str, joint: str = "", more: str = "") -> str:
    """Return an MJCF of one joint with an actuator; the torque of gravity is that of a pendulum."""
    return f"""<mujoco model="one">
  <option timestep="0.0005" integrator="implicitfast"/>
  <worldbody>
    <body name="arm">
      <joint name="j" axis="0 1 0" damping="0.5" {joint}/>
      <inertial pos="0.1 0 0" mass="2" diaginertia="0.02 0.03 0.02"/>
    </body>
  </worldbody>
  <actuator>{actuator}</actuator>
  {more}
</mujoco>
"""


SERVOS = {
    "pid": f'<pid name="a" joint="j" kp="4" kv="0.2" gear="{GEAR}"/>',
    "pid without speeds": f'<pid name="a" joint="j" kp="4" kv="0.2" input="pos" gear="{GEAR}"/>',
    "dcmotor": f'{DC} input="pos" controller="4 0 0.2"/>',
    "dcmotor with feedforward": f'{DC} input="pos vel ff" controller="4 0 0.2"/>',
}


@pytest.mark.parametrize("actuator", SERVOS)
def test_a_pid_or_dcmotor_with_targets_is_the_controller(tmp_path: Path, actuator: str):
    """Gains are those of MuJoCo's torque; a cause of the gains, a delay and a limit go back into it."""
    source = written(tmp_path, model_text(SERVOS[actuator]), "arm.xml")
    robot = load_robot(source)
    assert robot.controller_kind == "pd_position"
    assert robot.gear_ratio[0] == pytest.approx(1 / GEAR)
    gains = (robot.controller_gains["kp"][0], robot.controller_gains["kd"][0])
    assert gains == pytest.approx((4.0, 0.2))
    assert ("is taken as zero" in robot.toml) == (actuator in ("pid", "dcmotor with feedforward"))
    causes = [
        several("controller_gain", 1, relative_proportional=0.5, relative_integral=-0.25),
        several("input_delay", 1, delay_s=0.0101),
        several("torque_saturation", 1, limit_nm=3.0),
    ]
    made = write_model(source, robot, causes, tmp_path / "new.xml")
    assert made.left_out == ()
    assert torque(made.path, 0.02, 0.0, target=0.05 * GEAR) == pytest.approx(GEAR * 3.0)
    for angle, speed in ((0.01, 0.3), (-0.005, -0.2)):
        wanted = GEAR * (6.0 * -GEAR * angle - 0.15 * GEAR * speed)
        assert torque(made.path, angle, speed) == pytest.approx(
            np.clip(wanted, -150, 150), rel=1e-6
        )
    again = load_robot(made.path)
    assert again.controller_gains["kp"][0] == pytest.approx(6.0)
    assert {e.name for e in again.effects} == {"input_delay", "torque_saturation"}


def torque(path: Path, angle: float, speed: float, target: float = 0.0) -> float:
    """Return the torque of the actuators on the joint, with other inputs at zero and delays elapsed."""
    model = mujoco.MjModel.from_xml_path(str(path))
    model.actuator_delay[:] = 0.0
    data = mujoco.MjData(model)
    data.qpos[0], data.qvel[0], data.ctrl[0] = angle, speed, target
    mujoco.mj_forward(model, data)
    return float(data.qfrc_actuator[0])


def test_a_dcmotor_that_is_told_its_torque_is_a_motor_with_a_lag(tmp_path: Path):
    """Its torque is the command, and the inductance the lag of it; back EMF is compensated."""
    source = written(tmp_path, model_text(f'{DC} input="ff" inductance="0.004 0"/>'), "arm.xml")
    robot = load_robot(source)
    assert {e.name: e.values() for e in robot.effects} == {
        "actuator_bandwidth": pytest.approx([0.002])
    }
    assert robot.parameters()["j.viscous_friction"] == pytest.approx(0.5 / GEAR**2)
    causes = [
        several("actuator_bandwidth", 1, time_constant_s=0.005),
        several("torque_saturation", 1, limit_nm=0.4),
        several("torque_constant", 1, relative_error=-0.1),
    ]
    made = write_model(source, robot, causes, tmp_path / "new.xml")
    assert made.why == {"torque_constant@1": "a <dcmotor> delivers the torque that it is told"}
    again = {e.name: e.values() for e in load_robot(made.path).effects}
    assert again == {
        "actuator_bandwidth": pytest.approx([0.005]),
        "torque_saturation": pytest.approx([0.4]),
    }
    plain = written(tmp_path, model_text(f'{DC} input="ff"/>'), "plain.xml")
    assert torque(plain, 0.0, 2.0, target=0.7) == pytest.approx(GEAR * 0.7)


def test_back_emf_of_a_motor_on_voltage_is_damping(tmp_path: Path):
    """K^2 / R on the motor; what a volt gives is said, as commands of a robot file are torques."""
    source = written(tmp_path, model_text(f"{DC}/>"), "arm.xml")
    robot = load_robot(source)
    assert robot.parameters()["j.viscous_friction"] == pytest.approx(0.5 / GEAR**2 + 0.1**2 / 2)
    braking = torque(source, 0.0, 2.0)
    assert braking == pytest.approx(-2.0 * GEAR**2 * 0.1**2 / 2)
    assert "actuator 'a' is told voltages: 0.05 Nm/V left out" in robot.toml


def test_cogging_and_bristles_of_a_motor_are_effects(tmp_path: Path):
    """Torques of the imported effects equal those of MuJoCo, at a gear that is not the motor's."""
    ripple = '<dcmotor joint="j" gear="7" motorconst="0 0" resistance="1" input="none" cogging="0.4 3 0.8"/>'
    spring = '<dcmotor joint="j" gear="-1" motorconst="0 0" resistance="1" input="none" cogging="9 1 0.4"/>'
    if mujoco.mj_versionString() < "4":
        ripple, spring = (x.replace('"0 0"', '"1e-9 0"') for x in (ripple, spring))
    source = written(
        tmp_path, model_text(f'<motor joint="j" gear="{GEAR}"/>{ripple}{spring}'), "arm.xml"
    )
    robot = load_robot(source)
    assert [e.name for e in robot.effects] == ["gravity_compensation", "torque_ripple"]
    law = EffectTorques(robot.effects, robot.gear_ratio)
    for angle in (0.0, 0.3, -1.2):
        none = np.zeros(1)
        wanted = law(np.array([angle]), np.zeros((1, 1)), none, none)[0, 0]
        assert torque(source, angle, 0.0) == pytest.approx(wanted, abs=1e-9)


def test_drag_of_joint_and_motor_add_up(tmp_path: Path):
    """Quadratic damping of both is one effect; what it adds is MuJoCo's."""
    text = model_text(f'<motor joint="j" gear="{GEAR}" damping="0 1e-3"/>').replace(
        'damping="0.5"', 'damping="0.5 0.3"'
    )
    source = written(tmp_path, text, "arm.xml")
    robot = load_robot(source)
    (effect,) = robot.effects
    assert effect.name == "quadratic_drag"
    none, speed = np.zeros(1), -1.7
    wanted = EffectTorques([effect], robot.gear_ratio)(none, np.array([[speed]]), none, none)[0, 0]
    model = mujoco.MjModel.from_xml_path(str(source))
    data = mujoco.MjData(model)
    data.qvel[0] = speed
    mujoco.mj_forward(model, data)
    assert data.qfrc_passive[0] == pytest.approx(wanted - 0.5 * speed, rel=1e-9)
    # Another drag takes the place of both; that of the motor stays where it is.
    more = several("quadratic_drag", 1, drag_nm_s2_rad2=1e-5)
    made = write_model(source, robot, [more], tmp_path / "less.xml")
    assert "drag would be" in made.why["quadratic_drag@1"]
    more = several("quadratic_drag", 1, drag_nm_s2_rad2=9e-5)
    made = write_model(source, robot, [more], tmp_path / "more.xml")
    assert load_robot(made.path).effects[0].values() == pytest.approx([9e-5])


LEFT_OUT = {
    "integral": ('<pid name="a" joint="j" kp="4" ki="2"/>', "integral gain 2 Nm/(rad s)"),
    "rate": ('<pid name="a" joint="j" kp="4" slewmax="3"/>', "limit of the target's rate 3 rad/s"),
    "thermal": (
        f'{DC} input="ff" thermal="1 5 0 0.0039 25 40"/>',
        "warming of its winding (thermal) left out",
    ),
    "voltage": (
        f'{DC} input="ff" controller="0 0 0 0 0 24"/>',
        "limit of its voltage 24 V left out",
    ),
    "filter": (
        '<position name="a" joint="j" kp="4" timeconst="0.02"/>',
        "filters its targets over 0.02 s",
    ),
    "late sensor of a servo": (
        '<position name="a" joint="j" kp="4"/>',
        "joint 'j': delay of its position sensor, which its servo does not read, left out",
    ),
    "other late sensor": (
        '<motor name="a" joint="j"/>',
        "sensor 'w': its delay left out: expected sensors of joint positions",
    ),
}
LATE = 'delay="0.01" nsample="21"'
SENSORS = {
    "late sensor of a servo": f'<sensor><jointpos joint="j" {LATE}/></sensor>',
    "other late sensor": f'<sensor><jointvel name="w" joint="j" {LATE}/></sensor>',
}


@pytest.mark.parametrize("what", LEFT_OUT)
def test_what_a_robot_file_cannot_state_is_named(tmp_path: Path, what: str):
    actuator, note = LEFT_OUT[what]
    text = model_text(actuator, more=SENSORS.get(what, ""))
    assert note in import_robot(written(tmp_path, text, "arm.xml")).toml


def test_a_late_encoder_is_read(tmp_path: Path):
    text = model_text('<motor joint="j"/>', more=f'<sensor><jointpos joint="j" {LATE}/></sensor>')
    robot = load_robot(written(tmp_path, text, "arm.xml"))
    assert {e.label: e.values() for e in robot.effects} == {"sensor_delay@1": [0.01]}


def test_a_constant_bias_is_read_and_written_beside_gains(tmp_path: Path):
    """A <position> becomes the <general> that it is, with the bias of the cause."""
    source = written(tmp_path, model_text('<position joint="j" kp="40" kv="2"/>'), "arm.xml")
    causes = [
        several("torque_offset", 1, offset_nm=0.3),
        several("controller_gain", 1, relative_proportional=0.5, relative_integral=0.0),
    ]
    made = write_model(source, load_robot(source), causes, tmp_path / "new.xml")
    assert made.left_out == ()
    assert torque(made.path, 0.01, -0.1) == pytest.approx(0.3 - 60.0 * 0.01 + 2.0 * 0.1)
    again = load_robot(made.path)
    assert {e.label: e.values() for e in again.effects} == {"torque_offset@1": [0.3]}
    assert again.controller_gains["kp"][0] == pytest.approx(60.0)
