"""Causes written as passive dcmotor actuators, drag and constant torque: MuJoCo has the torques of the effects."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from axisight import Effect, load_robot
from axisight.mujoco import apply
from axisight.mujoco.torques import EffectTorques
from axisight.write_back import write_model
from found_causes import several
from import_data import changed, written

mujoco = pytest.importorskip("mujoco", minversion="3.12")

GEAR = -80.0
ARM = f"""<mujoco model="one">
  <option timestep="0.0005" integrator="implicitfast"/>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" axis="0 1 0" damping="0.7" armature="0.2"/>
      <inertial pos="0.1 0 0.2" mass="4" diaginertia="0.2 0.3 0.25"/>
    </body>
  </worldbody>
  <actuator>
    <motor name="m" joint="shoulder" gear="{GEAR}"/>
  </actuator>
</mujoco>
"""
WAVES = {"order_1": 6.5, "cosine_1_nm": 0.02, "sine_1_nm": -0.03, "order_3": 2.0, "sine_3_nm": 0.01}
# Laws that MuJoCo has exactly; their torque is a function of angle, speed and command.
EXACT = {
    "torque_ripple": WAVES,
    "gravity_compensation": {"sine_nm": -30.0, "cosine_nm": 12.0},
    "quadratic_drag": {"drag_nm_s2_rad2": 3e-5},
    "torque_offset": {"offset_nm": -0.04},
}


def added(path: Path, angle: float, speed: float, command: float) -> float:
    """Return the torque on the joint that a model has and the arm as drawn has not."""
    found = []
    for model in (
        mujoco.MjModel.from_xml_path(str(path)),
        mujoco.MjModel.from_xml_string(ARM),
    ):
        assert model.nu == 1
        data = mujoco.MjData(model)
        data.qpos[0], data.qvel[0], data.ctrl[0] = angle, speed, command
        mujoco.mj_forward(model, data)
        found.append(float(data.qfrc_actuator[0] + data.qfrc_passive[0]))
    return found[0] - found[1]


@pytest.mark.parametrize("name", EXACT)
def test_mujoco_has_the_torque_of_the_effect(tmp_path: Path, name: str):
    """Equal to what the core computes, to rounding, and read again as the same effect."""
    source = written(tmp_path, ARM, "arm.xml")
    made = write_model(
        source, load_robot(source), [several(name, 1, **EXACT[name])], tmp_path / "new.xml"
    )
    assert made.left_out == ()
    effect = Effect(name, 1, EXACT[name])
    law = EffectTorques([effect], [1 / GEAR])
    none = np.zeros(1)
    for angle, speed, command in ((0.3, 0.9, 0.1), (-1.1, -2.0, 0.0), (0.02, -0.004, -0.3)):
        at, told = np.array([angle]), np.array([command])
        wanted = law(at, np.array([[speed]]), none, told)[0, 0] + law.of_command(told)[0]
        assert added(made.path, angle, speed, command) == pytest.approx(wanted, rel=1e-6, abs=1e-9)
    again = next(e for e in load_robot(made.path).effects if e.name == name)
    assert again.values()[: len(effect.values())] == pytest.approx(_in_order(effect), rel=1e-8)


def _in_order(effect: Effect) -> list[float]:
    """Return the values of an effect; harmonics are numbered without gaps."""
    if effect.name != "torque_ripple":
        return list(effect.values())
    w = WAVES
    packed = {"order_1": w["order_1"], "cosine_1_nm": w["cosine_1_nm"], "sine_1_nm": w["sine_1_nm"]}
    packed |= {"order_2": w["order_3"], "sine_2_nm": w["sine_3_nm"]}
    return list(Effect("torque_ripple", 1, packed).values())


def test_friction_with_bristles_is_lugre(tmp_path: Path):
    """Torque and rate of the bristles are those of the effect's equation at any deflection, to rounding."""
    coulomb, ratio, speed, yields, time_s = 0.05, 1.4, 3.0, 0.01, 1e-3
    found = several(
        "presliding_friction",
        1,
        coulomb_nm=coulomb,
        static_ratio=ratio,
        stribeck_speed_rad_s=speed,
        presliding_rad=yields,
        bristle_time_s=time_s,
    )
    source = written(tmp_path, ARM, "arm.xml")
    made = write_model(source, load_robot(source), [found], tmp_path / "new.xml")
    assert made.left_out == ()
    model = mujoco.MjModel.from_xml_path(str(made.path))
    data = mujoco.MjData(model)
    for joint_speed, z in ((0.001, 0.0), (0.01, 0.3), (0.1, -0.4), (-0.02, 0.5)):
        data.qvel[0], data.act[0] = joint_speed, z * yields
        mujoco.mj_forward(model, data)
        w = GEAR * joint_speed
        level = 1 + (ratio - 1) * np.exp(-((w / speed) ** 2))
        rate = (w - abs(w) * z / level) / yields
        assert data.act_dot[0] == pytest.approx(rate * yields, rel=1e-9)
        friction = coulomb * (z + time_s * rate)
        assert data.qfrc_actuator[0] == pytest.approx(-GEAR * friction, rel=1e-9)
    again = next(e for e in load_robot(made.path).effects if e.name == "presliding_friction")
    assert again.values() == pytest.approx([coulomb, ratio, speed, yields, time_s, 0.0], rel=1e-9)


def test_friction_that_falls_slips_with_the_same_torque(tmp_path: Path):
    """In slip, three corners and more, the bristles carry what the law says; slower, they hold."""
    values = {
        "coulomb_nm": 0.05,
        "excess_nm": 0.03,
        "stribeck_speed_rad_s": 6.0,
        "smoothing_rad_s": 0.2,
    }
    source = written(tmp_path, ARM, "arm.xml")
    made = write_model(
        source, load_robot(source), [several("stribeck_friction", 1, **values)], tmp_path / "n.xml"
    )
    assert made.left_out == ()
    law = EffectTorques([Effect("stribeck_friction", 1, values)], [1 / GEAR])
    model = mujoco.MjModel.from_xml_path(str(made.path))
    data = mujoco.MjData(model)
    for joint_speed in (0.0075, 0.05, -0.2):
        mujoco.mj_resetData(model, data)
        for _ in range(400):
            data.qpos[0], data.qvel[0] = 0.0, joint_speed
            mujoco.mj_step(model, data)
        data.qvel[0] = joint_speed
        mujoco.mj_forward(model, data)
        wanted = law(np.zeros(1), np.array([[joint_speed]]), np.zeros(1), np.zeros(1))[0, 0]
        # At three corners tanh is 0.995.
        assert data.qfrc_actuator[0] == pytest.approx(wanted, rel=0.006)


@pytest.mark.parametrize("step_s", [0.0005, 0.002])
def test_written_friction_holds_the_joint(tmp_path: Path, step_s: float):
    """Half the level that breaks away does not move it: no chatter at the model's own time step."""
    text = changed(ARM, 'timestep="0.0005"', f'timestep="{step_s}" gravity="0 0 0"')
    source = written(tmp_path, text, "arm.xml")
    for name, values in {
        "stribeck_friction": {"coulomb_nm": 0.06, "excess_nm": 0.08, "smoothing_rad_s": 0.1},
        "presliding_friction": {"coulomb_nm": 0.14, "presliding_rad": 1e-4},
    }.items():
        found = several(name, 1, **values)
        made = write_model(source, load_robot(source), [found], tmp_path / f"{name}.xml")
        model = mujoco.MjModel.from_xml_path(str(made.path))
        data = mujoco.MjData(model)
        data.ctrl[0], data.qvel[0] = 0.07, 0.2
        mujoco.mj_step(model, data, round(2.0 / step_s))
        assert data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number == 0
        assert abs(data.qvel[0]) < 1e-6


def test_what_no_passive_actuator_can_do_is_said(tmp_path: Path):
    limited = changed(ARM, 'armature="0.2"', 'armature="0.2" actuatorfrcrange="-90 90"')
    source = written(tmp_path, limited, "arm.xml")
    ripple = several("torque_ripple", 1, order_1=6.0, cosine_1_nm=0.02)
    made = write_model(source, load_robot(source), [ripple], tmp_path / "limited.xml")
    assert "limits the force of its actuators" in made.why["torque_ripple@1"]
    source = written(tmp_path, ARM, "plain.xml")
    robot = load_robot(source)
    told = several("torque_ripple", 1, order_u=6.0, cosine_u=0.02)
    made = write_model(source, robot, [told], tmp_path / "told.xml")
    assert "proportional to the command" in made.why["torque_ripple@1"]
    once = write_model(source, robot, [ripple], tmp_path / "once.xml")
    twice = write_model(once.path, load_robot(once.path), [ripple], tmp_path / "twice.xml")
    assert "has one already" in twice.why["torque_ripple@1"]


def test_defaults_of_the_file_do_not_reach_a_passive_actuator(tmp_path: Path):
    """Limits, gear, damping and delay of default motors are not those of the cogging."""
    text = changed(
        ARM,
        "  <worldbody>",
        '  <default><motor forcerange="-9 9" damping="0.1" armature="0.01"/></default>\n  <worldbody>',
    )
    source = written(tmp_path, text, "arm.xml")
    ripple = several("torque_ripple", 1, order_1=6.0, cosine_1_nm=0.5)
    made = write_model(source, load_robot(source), [ripple], tmp_path / "new.xml")
    model = mujoco.MjModel.from_xml_path(str(made.path))
    np.testing.assert_array_equal(model.actuator_forcelimited, [1, 0])
    assert model.actuator_damping[1] == model.actuator_armature[1] == 0
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.qfrc_actuator[0] == pytest.approx(GEAR * 0.5)
    # The actuators before it keep their numbers.
    assert model.actuator("m").id == 0


def test_what_is_added_at_every_step_does_not_take_cogging_for_a_command(tmp_path: Path):
    """A dead zone of the command is the same on a model with and without cogging beside the motor."""
    source = written(tmp_path, ARM, "arm.xml")
    ripple = several("torque_ripple", 1, order_1=6.0, cosine_1_nm=0.5)
    made = write_model(source, load_robot(source), [ripple], tmp_path / "new.xml")
    dead = [Effect("torque_deadband", 1, {"width_nm": 0.05})]
    found = []
    for path in (source, made.path):
        model = mujoco.MjModel.from_xml_path(str(path))
        data = mujoco.MjData(model)
        mujoco.mj_step1(model, data)
        data.ctrl[0] = 0.2
        found.append(apply(model, data, dead, ["shoulder"], gear_ratio=1 / GEAR))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-9)
    np.testing.assert_allclose(found[0], [-0.05 * GEAR], rtol=1e-6)
