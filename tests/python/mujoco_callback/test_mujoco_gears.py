"""Effects inside gears in MuJoCo: a joint that is the spring has them, and moves as the package has it."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from axisight import Effect, Robot, _core, load_robot, simulate
from axisight.effects import core_effects
from axisight.errors import ConvergenceError, InputError
from axisight.mujoco import apply
from axisight.mujoco.gears import Gear
from axisight.robot_export import mjcf

K, D = 2e4, 30.0
# Torque of a gear of stiffness K and damping D on the joint [Nm] at deflection x and its rate w, by docs/effects.md.
LAWS = {
    "joint_stiffness": ({"relative_change": -0.3}, lambda x, w: 0.7 * K * x + D * w),
    "joint_damping": ({"relative_change": 2.0}, lambda x, w: K * x + 3 * D * w),
    "nonlinear_stiffness": ({"cubic_nm_rad3": 3e9}, lambda x, w: K * x + 3e9 * x**3 + D * w),
    "backlash": (
        {"half_width_rad": 1e-3},
        lambda x, w: (K * (abs(x) - 1e-3) * np.sign(x) + D * w) * (abs(x) > 1e-3),
    ),
}
# A wave of the gear, which moves the arm or the motor alone, and laws that remember.
MORE = {
    "backlash": {"half_width_rad": 3e-5, "damped": 0.5},
    "gear_hysteresis": {
        "share": 0.5,
        "deflection_rad": 1e-4,
        "sharpness": 0.7,
        "strain_at_rest": 0.3,
    },
    "lost_motion": {"softness": 0.5, "half_width_rad": 1e-4},
    "transmission_error": {"order": 20.0, "cosine_rad": 1e-4, "returned": 0.0},
}


@pytest.mark.parametrize("ratio", [0.01, -0.02])
@pytest.mark.parametrize("name", LAWS)
def test_torques_are_those_of_the_page_of_effects(name: str, ratio: float):
    """Out of the rounded corners of a backlash, half a tenth of its width."""
    parameters, law = LAWS[name]
    gear = Gear((Effect(name, 1, parameters),), ratio, K, D)
    assert gear.n_kept == 0
    random = np.random.default_rng(1)
    for x in (-2e-3, -1.2e-3, 3e-4, 0.0, 8e-4, 4e-3):
        motor, speeds = random.normal(), random.normal(size=2)
        on_motor, on_spring = gear.torques(np.array([motor, -x]), speeds, np.zeros(0))
        # The spring of the model pulls by -K and -D times its angle and speed, the gear by its law.
        added = law(x, -speeds[1]) - (K * x - D * speeds[1])
        assert on_spring == pytest.approx(added, rel=1e-9, abs=1e-8)
        # What the arm feels the motor feels: nothing acts on both together.
        assert on_motor == pytest.approx(0.0, abs=1e-8)


def test_a_wave_of_the_gear_does_no_work_where_it_is_returned():
    """Power on arm and motor is what the spring takes up: K e (e' - motion of the arm)."""
    wave = {"order": 7.0, "cosine_rad": 2e-3, "returned": 1.0}
    ratio = 0.05
    gear = Gear((Effect("transmission_error", 1, wave),), ratio, K, 0.0)
    place, speed = np.array([0.3, 2e-3]), np.array([0.7, -0.4])
    on_motor, on_spring = gear.torques(place, speed, np.zeros(0))
    turned = 7 * place[0] / ratio
    deflection = 2e-3 * np.cos(turned) - place[1]
    rate = -2e-3 * np.sin(turned) * 7 * speed[0] / ratio - speed[1]
    power = on_motor * speed[0] + (on_spring - K * place[1]) * speed[1]
    assert power == pytest.approx(-K * deflection * rate, rel=1e-9)


def in_mujoco(robot: Robot, effects: list[Effect], torque: np.ndarray, steps: int) -> np.ndarray:
    """Return the motor angles (n, n_axes) that MuJoCo reaches from rest in ``steps`` a sample."""
    text = mjcf(robot).replace("<compiler", '<size nuserdata="24"/><compiler')
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.timestep = robot.sample_time_s / steps
    data = mujoco.MjData(model)
    rest = robot.core.equilibrium(core_effects(effects), robot.operating_point.tolist())
    for name, angle in zip(robot.joint_names, rest["joint_angle"], strict=True):
        data.joint(name).qpos = angle
    motors = [f"motor of {name}" for name in robot.axis_names]
    turned = rest["motor_angle"] * robot.gear_ratio
    for motor, name, angle in zip(motors, robot.axis_names, turned, strict=True):
        data.joint(motor).qpos = angle
        data.joint(name).qpos -= angle
    mujoco.mj_forward(model, data)
    gears = dict(zip(motors, robot.axis_names, strict=True))
    places = [model.joint(motor).qposadr[0] for motor in motors]
    angles = []
    for command in torque:
        angles.append(data.qpos[places] / robot.gear_ratio)
        for _ in range(steps):
            mujoco.mj_step1(model, data)
            data.ctrl[:] = command
            apply(model, data, effects, motors, gear_ratio=robot.gear_ratio, gears=gears)
            mujoco.mj_step2(model, data)
    return np.array(angles)


@pytest.mark.parametrize("name", ["two_mass_axis", "irb6600_like"])
@pytest.mark.parametrize("effect", MORE)
def test_a_robot_moves_as_the_package_has_it(name: str, effect: str):
    """MuJoCo's step is of first order: from two lengths of it follows what one of no length gives.

    What is left is of second order where laws are smooth, less than a hundredth of the way that the effect turns
    motors aside. A step in which a gear comes to a flank or a knee is not: there it is less than a twentieth.
    """
    robot = load_robot(name).with_effects([])
    axes = range(1, robot.n_axes + 1)
    effects = [Effect(effect, axis, MORE[effect]) for axis in axes]
    if name != "two_mass_axis":
        # The friction of a motor beside it.
        effects += [Effect("coulomb_friction", a, {"coulomb_nm": 0.3}) for a in axes]
    t = robot.sample_time_s * np.arange(240)[:, None]
    hold = robot.core.equilibrium([], robot.operating_point.tolist())["motor_torque"]
    torque = hold + 8 * np.sin(2 * np.pi * np.linspace(8, 13, robot.n_axes) * t)
    ours, without = (
        simulate(robot, torque_nm=torque, effects=given, method="radau5")[
            "motor_position_rad"
        ].values
        for given in (effects, effects[robot.n_axes :])
    )
    aside = np.abs(ours - without).max(axis=0)
    once, twice = (in_mujoco(robot, effects, torque, steps) for steps in (1, 2))
    off = np.abs(2 * twice - once - ours).max(axis=0)
    assert (off < (0.05 if effect in ("backlash", "lost_motion") else 0.01) * aside).all(), (
        off / aside
    )


ONE_LINE = """<mujoco><option timestep="0.0005" gravity="0 0 0"/><size nuserdata="{room}"/><worldbody><body>
<joint name="arm" axis="0 0 1" armature="0.5"/>
<joint name="gear of arm" axis="0 0 1" stiffness="20000" damping="30"/>
<inertial pos="0 0 0" mass="1" diaginertia="2 2 2"/></body></worldbody>
<actuator><motor joint="arm"/></actuator></mujoco>"""
GEARS = {"arm": "gear of arm"}
HYSTERESIS = Effect(
    "gear_hysteresis", 1, {"share": 0.5, "deflection_rad": 1e-3, "included": 0.0, "sharpness": 0.0}
)


def model_of_one(room: int = 8):
    model = mujoco.MjModel.from_xml_string(ONE_LINE.format(room=room))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def test_a_motor_in_its_play_leaves_the_arm_alone():
    """One line of MJCF gives a rigid joint a gear: the arm rests until the motor has crossed the play."""
    model, data = model_of_one(0)
    play = Effect("backlash", 1, {"half_width_rad": 0.01})
    crossed = False
    for _ in range(400):
        mujoco.mj_step1(model, data)
        data.ctrl[:] = 1.0
        apply(model, data, [play], ["arm"], gears=GEARS)
        mujoco.mj_step2(model, data)
        motor, arm = data.qpos[0], data.qpos.sum()
        crossed |= motor >= 0.0095
        if not crossed:
            assert abs(arm) < 1e-12
            # The motor alone: half of 1 Nm / 0.5 kg m^2 times the square of the time, ahead by half a step.
            assert motor == pytest.approx(data.time * (data.time + 0.0005), rel=1e-9)
    # Both have the momentum that the motor was given: 0.2 s of 1 Nm.
    assert crossed
    assert 0.5 * data.qvel[0] + 2 * data.qvel.sum() == pytest.approx(0.2, rel=1e-9)


@pytest.mark.parametrize("parts", [1, 7])
def test_a_gear_remembers_by_the_law_of_dahl(parts: int):
    """Loaded by 2 mrad and unloaded by half of it: the exact solution, however many calls it takes."""
    model, data = model_of_one()
    apply(model, data, [HYSTERESIS], ["arm"], gears=GEARS)
    way = np.concatenate([np.linspace(0, 2e-3, parts + 1), np.linspace(2e-3, 1e-3, parts + 1)])
    for k, x in enumerate(way):
        data.time, data.qpos[1] = 0.01 * (k + 1), -x
        for _ in range(2):  # MuJoCo may ask more than once at a time.
            apply(model, data, [HYSTERESIS], ["arm"], gears=GEARS)
    loaded = 1 - np.exp(-2.0)
    strain = -1 + (1 + loaded) * np.exp(-1.0)
    # Without sharpness all four elements slip at 1 mrad.
    assert data.qfrc_applied[1] == pytest.approx(0.5 * 20000 * 1e-3 * strain, rel=1e-5)
    mujoco.mj_resetData(model, data)
    mujoco.mj_forward(model, data)
    apply(model, data, [HYSTERESIS], gears=GEARS)
    assert data.qfrc_applied.tolist() == [0.0, 0.0]


def test_misuse_is_named():
    model, data = model_of_one(7)
    for effect in ("backlash", "gear_hysteresis"):
        with pytest.raises(InputError, match="acts inside the gear: give the model a joint that"):
            apply(model, data, [Effect(effect, 1)])
    with pytest.raises(InputError, match='remember, <size nuserdata="8"/>, got 7'):
        apply(model, data, [HYSTERESIS], gears=GEARS)
    with pytest.raises(InputError, match="gears: expected joints of axes, arm, got 'leg'"):
        apply(model, data, [], ["arm"], gears={"leg": "gear of arm"})
    for spring, said in (("leg", "'leg'"), ("arm", "'arm'")):
        with pytest.raises(InputError, match=f"gears: arm: expected a hinge.*got {said}"):
            apply(model, data, [], ["arm"], gears={"arm": spring})
    with pytest.raises(InputError, match=r"none of the axes', .*got 'gear of arm'"):
        apply(model, data, [], ["arm", "gear of arm"], gears=GEARS)
    with pytest.raises(InputError, match="with stiffness, got 'arm' with 0"):
        apply(model, data, [], ["gear of arm"], gears={"gear of arm": "arm"})


ELSEWHERE = """<mujoco><worldbody><body><joint name="arm" axis="0 0 1"/>
<geom size="0.1" mass="1"/>{inside}<body pos="0.3 0 0">{outside}<geom size="0.1" mass="1"/></body>
</body></worldbody></mujoco>"""


@pytest.mark.parametrize(
    ("inside", "outside"),
    [
        ("", '<joint name="spring" axis="0 0 1" stiffness="1e3"/>'),
        ('<joint name="spring" axis="0 1 0" stiffness="1e3"/>', ""),
        ('<joint name="spring" axis="0 0 1" pos="0 0.1 0" stiffness="1e3"/>', ""),
    ],
    ids=["another body", "another axis", "another line"],
)
def test_a_spring_elsewhere_is_none_of_the_gear(inside: str, outside: str):
    model = mujoco.MjModel.from_xml_string(ELSEWHERE.format(inside=inside, outside=outside))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with pytest.raises(InputError, match="got 'spring', which is elsewhere"):
        apply(model, data, [], gears={"arm": "spring"})


def test_what_cannot_be_remembered_is_said(monkeypatch: pytest.MonkeyPatch):
    model, data = model_of_one()
    data.time = 1.0
    apply(model, data, [HYSTERESIS], gears=GEARS)
    data.time = 0.5
    with pytest.raises(InputError, match=r"data\.time: expected it to go on from 1 s, got 0\.5 s"):
        apply(model, data, [HYSTERESIS], gears=GEARS)
    # A few times the deflection at which it slips, in no more than two parts.
    data.time, data.qpos[1] = 1.1, 5e-4
    with monkeypatch.context() as few:
        few.setattr("axisight.mujoco.gears._MOST_PARTS", 2)
        with pytest.raises(ConvergenceError, match="take a shorter timestep"):
            apply(model, data, [HYSTERESIS], gears=GEARS)
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    with pytest.raises(InputError, match="Euler or implicit, got RK4"):
        apply(model, data, [HYSTERESIS], gears=GEARS)


def test_states_of_another_shape_are_refused():
    core = load_robot("two_mass_axis").with_effects([]).core
    assert _core.state_at_rest(core, [], [0.0]).tolist() == [0.0] * 4
    with pytest.raises(InputError, match=r"state: expected shape \(n, 4\), got \(1, 3\)"):
        _core.state_rates(core, [], np.zeros((1, 3)), [0.0])
    with pytest.raises(InputError, match="torque: expected 1 numbers, got 2"):
        _core.state_rates(core, [], np.zeros((1, 4)), [0.0, 0.0])
