"""Effects in MuJoCo at every step: the package's own simulator moves alike, and what is no torque is refused."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from axisight import Effect, Robot, effect_table, load_robot, simulate, to_mujoco
from axisight.errors import ConvergenceError, InputError, MissingExtraError
from axisight.mujoco import apply
from axisight.mujoco.end_of_step import torque_at_end
from axisight.mujoco.torques import EffectTorques, check_applicable
from import_data import URDF, written

SIGN = {"smoothing_rad_s": 0.5}
R = 0.02
# Torque on the motor [Nm] at angle a, speed w, command u and load g of the motor, by docs/effects.md.
LAWS = {
    "viscous_friction": ({"viscous_nm_s_rad": 0.004}, lambda a, w, u, g: -0.004 * w),
    "coulomb_friction": ({"coulomb_nm": 0.05, **SIGN}, lambda a, w, u, g: -0.05 * np.tanh(w / 0.5)),
    "asymmetric_friction": (
        {"forward_nm": 0.07, "backward_nm": 0.03, **SIGN},
        lambda a, w, u, g: -np.tanh(w / 0.5) * (0.05 + 0.02 * np.tanh(w / 0.5)),
    ),
    "stribeck_friction": (
        {"coulomb_nm": 0.05, "excess_nm": 0.03, "stribeck_speed_rad_s": 5.0, **SIGN},
        lambda a, w, u, g: -(0.05 + 0.03 * np.exp(-((w / 5) ** 2))) * np.tanh(w / 0.5),
    ),
    "quadratic_drag": ({"drag_nm_s2_rad2": 2e-4}, lambda a, w, u, g: -2e-4 * w * np.abs(w)),
    "viscous_asymmetry": (
        {"half_difference_nm_s_rad": 0.002, **SIGN},
        lambda a, w, u, g: -0.002 * w * np.tanh(w / 0.5),
    ),
    "load_dependent_friction": (
        {"coefficient": 0.1, **SIGN},
        lambda a, w, u, g: -0.1 * np.abs(g) * np.tanh(w / 0.5),
    ),
    "position_dependent_friction": (
        {"cosine_nm": 0.04, "sine_nm": 0.02, "order": 0.1, **SIGN},
        lambda a, w, u, g: -(0.04 * np.cos(0.1 * a) + 0.02 * np.sin(0.1 * a)) * np.tanh(w / 0.5),
    ),
    "torque_ripple": (
        {"order_1": 2.0, "cosine_1_nm": 0.05, "order_u": 1.0, "sine_u": 0.1},
        lambda a, w, u, g: 0.05 * np.cos(2 * a) + u * 0.1 * np.sin(a),
    ),
    "gravity_compensation": (
        {"cosine_nm": 4.0, "sine_nm": 2.0},
        lambda a, w, u, g: R * (4 * np.cos(R * a) + 2 * np.sin(R * a)),
    ),
    "cable_stiffness": (
        {"stiffness_nm_rad": 6.0, "at_zero_nm": 1.5},
        lambda a, w, u, g: R * (1.5 - 6 * R * a),
    ),
    "power_supply_sag": (
        {"sag_1_w": 0.1, "curvature": 1.0},
        lambda a, w, u, g: -u * (x := 0.1 * np.maximum(u * w, 0)) / (1 + x),
    ),
    "torque_constant": ({"relative_error": 0.2}, lambda a, w, u, g: 0.2 * u),
    "torque_offset": ({"offset_nm": 0.05}, lambda a, w, u, g: 0.05 + 0 * u),
    "torque_deadband": ({"width_nm": 0.1}, lambda a, w, u, g: -np.clip(u, -0.1, 0.1)),
    "torque_saturation": (
        {"limit_nm": 0.15},
        lambda a, w, u, g: np.clip(u, -0.15, 0.15) - u,
    ),
}
REFUSED = sorted(set(effect_table()) - set(LAWS))


@pytest.mark.parametrize("name", LAWS)
def test_torques_are_those_of_the_page_of_effects(name: str):
    """On the second of three axes, whose torque nothing of the others is in."""
    parameters, law = LAWS[name]
    torques = EffectTorques([Effect(name, 2, parameters)], [0.1, R, -0.5])
    random = np.random.default_rng(0)
    for _ in range(20):
        angle, load = 2 * random.normal(size=3), 20 * random.normal(size=3)
        speeds, command = 0.1 * random.normal(size=(5, 3)), 0.2 * random.normal(size=3)
        of_command = torques.of_command(command)
        found = torques(angle, speeds, load, command) + of_command
        spring = 6 * angle[1] - 1.5 if name == "cable_stiffness" else 0.0
        motor = (angle[1] / R, speeds[:, 1] / R, command[1], (load[1] + spring) * R)
        np.testing.assert_allclose(found[:, 1] * R, law(*motor), rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(found[:, [0, 2]], 0.0, atol=1e-11)


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_torque_is_refused(name: str):
    info = effect_table()[name]
    place = {"axis": {"axis": 1}, "axes": {"axes": (1, 2)}, "arm": {}}[info.scope]
    with pytest.raises(InputError, match="expected one that is a torque of the joint's angle"):
        check_applicable([Effect(name, **place)], 2)


def test_mujocos_own_friction_is_refused():
    """It acts on the acceleration, and MuJoCo has it as a number of the joint."""
    friction = Effect("coulomb_friction", 1, {"coulomb_nm": 0.5, "lead_s": 0.0095})
    with pytest.raises(InputError, match="ahead of the speed as MuJoCo's own"):
        check_applicable([friction], 3)
    check_applicable([friction.with_values({"lead_s": 0.0})], 3)


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    """A rigid arm: a gear of fifty in the shoulder, of ten in the elbow."""
    robot = load_robot(written(tmp_path_factory.mktemp("arm"), URDF), sample_time_s=0.001)
    text = robot.toml.replace("gear_ratio = 1.0", "gear_ratio = 0.1")
    robot = Robot.from_toml(text).with_effects([])
    assert robot.gear_ratio.tolist() == [0.02, 0.1]
    return robot.with_parameters({"shoulder.motor_inertia": 1e-4, "elbow.motor_inertia": 2e-4})


def swinging(robot: Robot, n: int = 400) -> np.ndarray:
    """Motor torques (n, n_axes) that swing the arm about where it hangs."""
    t = robot.sample_time_s * np.arange(n)[:, None]
    hold = robot.gravity(robot.operating_point) * robot.gear_ratio
    return hold + [0.12, 0.25] * np.sin(2 * np.pi * np.array([2.5, 4.0]) * t)


def in_mujoco(robot: Robot, effects: list[Effect], torque: np.ndarray, steps: int) -> np.ndarray:
    """Return the motor angles (n, n_axes) that MuJoCo reaches with effects in ``steps`` a sample."""
    model = to_mujoco(robot)
    model.opt.timestep = robot.sample_time_s / steps
    data = mujoco.MjData(model)
    data.qpos[:] = robot.operating_point
    mujoco.mj_forward(model, data)
    angles = []
    for command in torque:
        angles.append(data.qpos / robot.gear_ratio)
        for _ in range(steps):
            mujoco.mj_step1(model, data)
            data.ctrl[:] = command
            apply(model, data, effects, gear_ratio=robot.gear_ratio)
            mujoco.mj_step2(model, data)
    return np.array(angles)


@pytest.mark.parametrize(
    ("names", "smoothing_rad_s"),
    [
        (("position_dependent_friction", "torque_ripple"), 0.5),
        (("stribeck_friction", "torque_constant"), 0.5),
        # Forty times steeper than a step can follow with friction at the speed of its beginning.
        (("coulomb_friction",), 1e-3),
    ],
)
def test_an_arm_moves_as_the_package_has_it(arm: Robot, names: tuple[str, ...], smoothing_rad_s):
    """Of the way that the effects turn the arm aside, little is left, and with half the step half."""
    effects = [
        Effect(
            name,
            axis,
            {
                **LAWS[name][0],
                **({"smoothing_rad_s": smoothing_rad_s} if "friction" in name else {}),
            },
        )
        for axis in (1, 2)
        for name in names
    ]
    torque = swinging(arm)
    ours, without = (
        simulate(arm, torque_nm=torque, effects=given, method="radau5")["motor_position_rad"].values
        for given in (effects, [])
    )
    aside = np.abs(ours - without).max(axis=0)
    off = [np.abs(in_mujoco(arm, effects, torque, k) - ours).max(axis=0) for k in (1, 2)]
    assert (off[0] < 0.05 * aside).all(), off[0] / aside
    assert (off[1] < 0.6 * off[0]).all(), off[1] / off[0]


def test_dry_friction_holds_a_light_joint():
    """A wheel of 1e-4 kg m^2 under a torque below its friction creeps, and does not shake."""
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><option timestep="0.002"/><worldbody><body>
        <joint name="w" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="1e-4 1e-4 1e-4"/>
        </body></worldbody><actuator><motor joint="w"/></actuator></mujoco>"""
    )
    friction = Effect("coulomb_friction", 1, {"coulomb_nm": 0.5, "smoothing_rad_s": 0.01})
    data = mujoco.MjData(model)
    mujoco.set_mjcb_control(lambda m, d: apply(m, d, [friction], ["w"]))
    try:
        data.ctrl[:] = 0.3
        mujoco.mj_step(model, data, 200)
        # It creeps at the speed at which friction is that torque.
        assert data.qvel[0] == pytest.approx(0.01 * np.arctanh(0.6), rel=1e-4)
        assert data.qfrc_applied[0] == pytest.approx(-0.3, rel=1e-4)
        data.ctrl[:] = 1.0
        mujoco.mj_step(model, data, 10)
        assert data.qacc[0] == pytest.approx(0.5 / 1e-4, rel=1e-6)
    finally:
        mujoco.set_mjcb_control(None)


def test_friction_follows_what_gears_carry(arm: Robot):
    """The load is that of inverse dynamics, at the acceleration of the last step."""
    law = {"coefficient": 0.1, "smoothing_rad_s": 1e-4}
    effects = [Effect("load_dependent_friction", axis, law) for axis in (1, 2)]
    model = to_mujoco(arm)
    model.opt.timestep = 1e-6
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.ctrl[:] = [0.4, -0.9], [1.5, -2.0], [0.3, -0.2]
    mujoco.mj_forward(model, data)
    load = arm.inverse_dynamics(data.qpos, data.qvel, data.qacc)
    found = apply(model, data, effects, gear_ratio=arm.gear_ratio)
    np.testing.assert_allclose(found, -0.1 * np.abs(load) * [1, -1], rtol=1e-6)


def test_only_joints_with_effects_are_set(arm: Robot):
    model = to_mujoco(arm)
    data = mujoco.MjData(model)
    with pytest.raises(InputError, match=r"positions that were computed \(mj_forward\)"):
        apply(model, data, [])
    mujoco.mj_forward(model, data)
    data.qfrc_applied[:] = [3.0, 4.0]
    found = apply(model, data, [Effect("torque_offset", 1, {"offset_nm": 0.5})], ["elbow"])
    np.testing.assert_allclose(found, [0.5])
    np.testing.assert_allclose(data.qfrc_applied, [3.0, 0.5])
    assert apply(model, data, []).tolist() == [0.0, 0.0]


def test_misuse_is_named(arm: Robot, monkeypatch: pytest.MonkeyPatch):
    model = to_mujoco(arm)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    drag = Effect("quadratic_drag", 3, {"drag_nm_s2_rad2": 1.0})
    with pytest.raises(InputError, match="axis: expected one from 1 to 2, got 3"):
        apply(model, data, [drag])
    with pytest.raises(
        InputError, match="hinge and slide joints of the model, shoulder, elbow, got 'hip'"
    ):
        apply(model, data, [], ["hip"])
    with pytest.raises(InputError, match="gear_ratio: expected numbers other than zero"):
        apply(model, data, [Effect("quadratic_drag", 1)], gear_ratio=0.0)
    with pytest.raises(InputError, match=r"gear_ratio: expected one, or one of each of 2 joints"):
        apply(model, data, [drag], gear_ratio=[1.0, 2.0, 3.0])

    def no(name: str):
        raise ImportError(name)

    monkeypatch.setattr("axisight.mujoco.dynamics.import_module", no)
    with pytest.raises(MissingExtraError, match=r"pip install 'axisight\[mujoco\]'"):
        apply(model, data, [])


def test_a_torque_that_no_speed_has_is_said():
    with pytest.raises(ConvergenceError, match="take a shorter timestep"):
        torque_at_end(lambda w: np.where(w > 0, -1.0, 1.0), np.zeros(1), 0.1 * np.eye(1))
