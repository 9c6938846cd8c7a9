"""Robots as models of Pinocchio and MuJoCo: the same equations of motion."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from axisight import Effect, load_robot, to_mujoco, to_pinocchio
from axisight.errors import MissingExtraError
from axisight.robot import JointLimits
from axisight.robot_export import mjcf
from axisight.robot_import import import_robot
from import_data import URDF, written
from imported_arms import difference_to_pinocchio, states

PRESETS = ["irb6600_like", "two_mass_axis", "scara_like", "cobot_like"]


@pytest.mark.parametrize("name", PRESETS)
def test_pinocchio_moves_the_arm_alike(name: str):
    robot = load_robot(name)
    assert difference_to_pinocchio(robot, to_pinocchio(robot), 100) < 1e-12


def test_pinocchio_has_the_drives(tmp_path: Path):
    robot = load_robot(written(tmp_path, URDF))
    back = import_robot(to_pinocchio(robot))
    for joint, same in zip(robot.joints, back.joints, strict=True):
        assert joint.drive is not None
        assert same.drive is not None
        assert same.drive.gear_ratio == pytest.approx(joint.drive.gear_ratio, rel=1e-12)
        assert same.drive.viscous_friction == pytest.approx(joint.drive.viscous_friction, rel=1e-12)
    assert back.effects[0].values()[0] == pytest.approx(robot.effects[0].values()[0], rel=1e-12)


@pytest.mark.parametrize("name", PRESETS)
def test_mujoco_accelerates_alike(name: str):
    """Gears and elastic joints included: J_m phi'' = tau - F_v phi' - r tau_g beside M q'' = ... ."""
    robot = load_robot(name).with_effects([])
    model = to_mujoco(robot)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    data = mujoco.MjData(model)
    place = {model.joint(i).name: model.jnt_dofadr[i] for i in range(model.njnt)}
    random = np.random.default_rng(2)
    q, v, _ = states(robot, 20)
    for k in range(20):
        joint_force, wanted = np.zeros(robot.n_joints), {}
        rigid_inertia = np.zeros(robot.n_joints)
        axis = 0
        for i, joint in enumerate(robot.joints):
            at = place[joint.name]
            data.qpos[at], data.qvel[at] = q[k, i], v[k, i]
            if joint.drive is None:
                assert joint.spring is not None
                joint_force[i] = -joint.spring.stiffness * q[k, i] - joint.spring.damping * v[k, i]
                continue
            r, torque = joint.drive.gear_ratio, random.normal()
            data.ctrl[axis] = torque
            axis += 1
            if joint.spring is None:
                friction = joint.drive.viscous_friction / r**2 * v[k, i]
                joint_force[i] = torque / r - friction
                rigid_inertia[i] = joint.drive.motor_inertia / r**2
                continue
            deflection, rate = 1e-3 * random.normal(), 0.1 * random.normal()
            gear = joint.spring.stiffness * deflection + joint.spring.damping * rate
            motor = place[f"motor of {joint.name}"]
            # The second of the two in series turns by what the gear gives way.
            data.qpos[at], data.qvel[at] = -deflection, -rate
            data.qpos[motor], data.qvel[motor] = q[k, i] + deflection, v[k, i] + rate
            joint_force[i] = gear
            speed = data.qvel[motor] / r
            wanted[joint.name] = (
                torque - joint.drive.viscous_friction * speed - r * gear
            ) / joint.drive.motor_inertia
        mujoco.mj_forward(model, data)
        mass = robot.inertia_matrix(q[k]) + np.diag(rigid_inertia)
        acceleration = np.linalg.solve(mass, joint_force - robot.bias(q[k], v[k]))
        # MuJoCo solves for both joints of a gear at once: rounding is that of the largest of them.
        largest = max(np.abs(acceleration).max(), 1.0)
        for i, joint in enumerate(robot.joints):
            found = data.qacc[place[joint.name]]
            if joint.name in wanted:
                assert joint.drive is not None
                motor = data.qacc[place[f"motor of {joint.name}"]]
                found = found + motor
                assert abs(motor - joint.drive.gear_ratio * wanted[joint.name]) < 1e-9 * largest
            assert abs(found - acceleration[i]) < 1e-9 * largest


def test_what_mujoco_is_given_comes_back(tmp_path: Path):
    """A rigid arm through MJCF: drives, dry friction, gravity."""
    robot = load_robot(written(tmp_path, URDF)).with_parameters({"elbow.motor_inertia": 0.05})
    back = import_robot(written(tmp_path, mjcf(robot), "arm.xml"))
    q, v, a = states(robot, 20)
    np.testing.assert_allclose(
        back.inverse_dynamics(q, v, a), robot.inverse_dynamics(q, v, a), atol=1e-12
    )
    for name, value in robot.parameters().items():
        if name.endswith(("motor_inertia", "viscous_friction")):
            assert back.parameters()[name] == pytest.approx(value, rel=1e-12)
    np.testing.assert_allclose(back.gear_ratio, robot.gear_ratio, rtol=1e-12)
    # The URDF limits the effort of the shoulder, and MuJoCo cuts torques at such a limit.
    assert sorted(e.label for e in back.effects) == ["coulomb_friction@1", "torque_saturation@1"]
    friction = Effect("coulomb_friction", 2, {"coulomb_nm": 0.4, "smoothing_rad_s": 0.01})
    other = import_robot(written(tmp_path, mjcf(robot.with_effects([friction])), "other.xml"))
    found = {e.label: e.values()[0] for e in other.effects}
    assert found["coulomb_friction@2"] == pytest.approx(0.4)


def test_limits_come_back(tmp_path: Path):
    """Import, export, import: each format returns the limits for which it has a place."""
    first = load_robot(written(tmp_path, URDF))
    shoulder, elbow = first.joint_limits
    assert shoulder == JointLimits((-2.0, 2.0), velocity=3.0, effort=80.0)
    assert elbow == JointLimits()
    limits = [replace(shoulder, acceleration=9.0), JointLimits((-0.5, 1.0), effort=12.5)]
    robot = first.with_joint_limits(limits)
    assert import_robot(to_pinocchio(robot)).joint_limits == (shoulder, limits[1])
    text = mjcf(robot)
    back = import_robot(written(tmp_path, text, "arm.xml"))
    assert back.joint_limits == (replace(shoulder, velocity=None), limits[1])
    assert "No place in MJCF for the limits of velocity and acceleration." in text
    assert "No place" not in mjcf(first.with_joint_limits([JointLimits(), limits[1]]))
    again = import_robot(written(tmp_path, mjcf(back), "again.xml"))
    assert again.joint_limits == back.joint_limits
    assert [e.label for e in again.effects] == [e.label for e in back.effects]


def test_an_elastic_gear_has_its_limits_on_the_motor():
    robot = load_robot("two_mass_axis").with_joint_limits([JointLimits((-1.0, 2.0), effort=40.0)])
    model = to_mujoco(robot)
    (name,) = robot.axis_names
    motor, arm = model.joint(f"motor of {name}"), model.joint(name)
    assert list(motor.range) == [-1.0, 2.0]
    assert list(model.jnt_actfrcrange[motor.id]) == [-40.0, 40.0]
    assert model.jnt_limited[motor.id] == 1
    assert model.jnt_actfrclimited[motor.id] == 1
    assert model.jnt_limited[arm.id] == model.jnt_actfrclimited[arm.id] == 0


def test_mujoco_stops_at_the_limit_of_effort():
    """A constant torque beyond the limit acts as the limit does."""
    robot = load_robot("two_mass_axis")
    limited = to_mujoco(robot.with_joint_limits([JointLimits(effort=40.0)]))
    data = mujoco.MjData(limited)
    data.ctrl[:] = 2 * 40.0 * float(robot.gear_ratio[0])
    mujoco.mj_forward(limited, data)
    assert np.abs(data.qfrc_actuator).max() == pytest.approx(40.0, rel=1e-12)


@pytest.mark.parametrize("function", [to_mujoco, to_pinocchio])
def test_a_missing_library_is_named(monkeypatch: pytest.MonkeyPatch, function):
    def no(name: str):
        raise ImportError(name)

    monkeypatch.setattr(f"{function.__module__}.import_module", no)
    with pytest.raises(MissingExtraError, match="pip install"):
        function(load_robot("two_mass_axis"))
