"""What accelerometers on the links read, in simulations and along given motions."""

from __future__ import annotations

import numpy as np
import pytest

import three_axes
from axisight import Effect, Robot, load_robot, simulate, simulate_batch
from axisight.robot import Accelerometer
from axisight.robot_export import mjcf

ELBOW = Accelerometer("elbow", "axis2_yaw", (0.0, 0.1, 1.0), ((1.0, 0.0, 0.0),))
TIP = Accelerometer("tip", "axis3_yaw", (1.2, 0.1, 0.2))
ARM = load_robot("irb6600_like").with_accelerometers([ELBOW, TIP])
POSE = [0.2, 0.3, -0.4]

ONE_AXIS = """
schema = "axisight.robot/2"
name = "turntable"
gravity = [0.0, 0.0, -9.81]
sample_time = 1e-3
[[joint]]
name = "axis1"
kind = "driven"
origin = [0.3, 0.0, 0.5]
axis = [0.0, 0.0, 1.0]
[joint.link]
mass = 2.0
com = [0.0, 0.0, 0.1]
inertia = [0.02, 0.02, 0.05, 0.0, 0.0, 0.0]
[joint.drive]
gear_ratio = 0.5
motor_inertia = 0.01
viscous_friction = 0.0
[[accelerometer]]
name = "rim"
joint = "axis1"
position = [0.4, 0.0, 0.05]
[operating_point]
joint_angle = [0.7]
"""


def at_rest(robot: Robot, pose: list[float]) -> dict[str, np.ndarray]:
    """Minus gravity in the frame of each sensor's link."""
    angles = robot.equilibrium(pose)["joint_angle_rad"].values
    upward = -robot.gravity_m_s2
    return {
        one.name: np.array(one.directions) @ (robot.pose(angles, one.joint)[0].T @ upward)
        for one in robot.accelerometers
    }


def motion(robot: Robot, seconds: float, size: float) -> np.ndarray:
    time = robot.sample_time_s * np.arange(round(seconds / robot.sample_time_s))
    sines = [np.sin(2 * np.pi * f * time) for f in (1.5, 2.0, 3.0)]
    return size * np.stack(sines, axis=1)


@pytest.mark.parametrize("model", ["nonlinear", "linear"])
def test_at_rest_they_read_minus_gravity(model) -> None:
    sim = simulate(ARM, np.zeros((20, 3)), start_rad=POSE, model=model)
    for name, expected in at_rest(ARM, POSE).items():
        found = sim["acceleration_m_s2"].sel(accelerometer=name).values
        # The equilibrium is found to 1e-9 of the forces.
        np.testing.assert_allclose(found[:, : len(expected)], np.tile(expected, (20, 1)), atol=1e-6)
        assert np.isnan(found[:, len(expected) :]).all()


def test_a_turning_axis_has_the_closed_form() -> None:
    """A constant torque on a rigid gear: radius times the square of the speed, and radius times acceleration.

    The motor adds J / r^2 = 0.04 to the inertia of 0.05 kg m^2 about the axis. The first sample is taken before
    the torque acts.
    """
    robot = Robot.from_toml(ONE_AXIS)
    torque, radius = 0.045, 0.4
    acceleration = torque / 0.5 / (0.05 + 0.01 / 0.5**2)
    sim = simulate(robot, torque_nm=np.full((500, 1), torque))
    speed = acceleration * sim["time"].values
    found = sim["acceleration_m_s2"].sel(accelerometer="rim").values
    tangential = np.full(500, radius * acceleration)
    tangential[0] = 0.0
    # The integrator's tolerance is 1e-7 of a speed of 0.5 rad/s.
    np.testing.assert_allclose(found[:, 0], -radius * speed**2, atol=1e-7)
    np.testing.assert_allclose(found[:, 1], tangential, atol=1e-12)
    np.testing.assert_allclose(found[:, 2], 9.81, atol=1e-12)


def test_the_second_difference_of_the_position_is_the_oracle() -> None:
    """Forward kinematics along a simulated motion with elastic gears and links, differenced twice.

    The second difference of a wave of 20 Hz, the highest mode that moves, is off by (2 pi f T)^2 / 12 = 3e-4.
    """
    sim = simulate(ARM, motion(ARM, 0.4, 20.0), start_rad=POSE, tolerance=1e-9)
    angles, step = sim["joint_position_rad"].values, ARM.sample_time_s
    for one in ARM.accelerometers:
        poses = [ARM.pose(q, one.joint) for q in angles]
        point = np.array([p + r @ np.array(one.position_m) for r, p in poses])
        curvature = (point[2:] - 2 * point[1:-1] + point[:-2]) / step**2 - ARM.gravity_m_s2
        expected = np.array(
            [
                np.array(one.directions) @ (r.T @ f)
                for (r, _), f in zip(poses[1:-1], curvature, strict=True)
            ]
        )
        found = sim["acceleration_m_s2"].sel(accelerometer=one.name).values[1:-1]
        found = found[:, : len(one.directions)]
        size = np.abs(found - found.mean(axis=0)).max()
        assert size > 1.0
        assert np.abs(found - expected).max() < 1e-3 * size


@pytest.mark.parametrize("kind", ["", 'motion = "prismatic"'])
def test_mujoco_is_the_oracle(kind: str) -> None:
    """Random poses, speeds and torques; MuJoCo gives readings and the accelerations of the joints."""
    mujoco = pytest.importorskip("mujoco")
    places = {"turn": (0.3, -0.1, 0.2), "lift": (0.1, 0.2, -0.3), "reach": (0.4, 0.1, -0.2)}
    sensors = [Accelerometer(f"on_{joint}", joint, place) for joint, place in places.items()]
    robot = three_axes.robot(kind)
    text = robot.toml.replace("axisight.robot/1", "axisight.robot/2")
    robot = Robot.from_toml(text).with_accelerometers(sensors)
    spec = mujoco.MjSpec.from_string(mjcf(robot))
    for one in sensors:
        spec.body(f"link of {one.joint}").add_site(name=one.name, pos=one.position_m)
        spec.add_sensor(
            type=mujoco.mjtSensor.mjSENS_ACCELEROMETER,
            objtype=mujoco.mjtObj.mjOBJ_SITE,
            objname=one.name,
        )
    model = spec.compile()
    data = mujoco.MjData(model)
    rng = np.random.default_rng(1)
    for _ in range(20):
        data.qpos, data.qvel = rng.normal(0, 1, 3), rng.normal(0, 3, 3)
        data.ctrl = rng.normal(0, 2, 3)
        mujoco.mj_forward(model, data)
        found = robot.specific_force(data.qpos, data.qvel, data.qacc)
        # Rounding of accelerations of some hundred m/s^2.
        np.testing.assert_allclose(found.ravel(), data.sensordata, atol=1e-9)


def test_a_stiff_base_changes_nothing() -> None:
    """Two joints below the first one move the sensors to other places in the chain.

    A compliance of 1e-10 rad/Nm under moments of 10 kNm turns the base by 1 urad, and gravity by 1e-5 m/s^2.
    """
    stiff = Effect("base_compliance", None, {"about_x_rad_nm": 1e-10, "about_y_rad_nm": 1e-10})
    reference = motion(ARM, 0.05, 5.0)
    fixed = simulate(ARM, reference, start_rad=POSE, tolerance=1e-9)
    based = simulate(ARM, reference, start_rad=POSE, method="radau5", effects=[stiff])
    a, b = (sim["acceleration_m_s2"].values for sim in (fixed, based))
    assert np.nanmax(np.abs(a - a[0])) > 0.1
    np.testing.assert_allclose(a, b, atol=1e-3)


@pytest.mark.parametrize("rigid", [False, True])
def test_the_linear_model_is_the_nonlinear_one_for_small_motions(rigid: bool) -> None:
    """Only centripetal terms, of second order, are left out: here below one per cent."""
    robot, torque_nm = (Robot.from_toml(ONE_AXIS), 0.005) if rigid else (ARM, 0.05)
    n = robot.n_axes
    rest = robot.equilibrium()["motor_torque_nm"].values
    wave = motion(robot, 0.2, torque_nm)[:, :n] + rest
    exact = simulate(robot, torque_nm=wave, tolerance=1e-10)["acceleration_m_s2"].values
    linear = simulate(robot, torque_nm=wave, model="linear")["acceleration_m_s2"].values
    size = np.nanmax(np.abs(exact - exact[0]))
    assert size > 1e-3
    assert np.nanmax(np.abs(exact - linear)) < 1e-2 * size


def test_a_batch_equals_single_runs() -> None:
    reference = np.stack([motion(ARM, 0.05, size) for size in (1.0, 2.0, 3.0)])
    together = simulate_batch(ARM, reference, method="rk4")["acceleration_m_s2"]
    assert together.dims == ("run", "time", "accelerometer", "direction")
    for run, one in enumerate(reference):
        alone = simulate(ARM, one, method="rk4")["acceleration_m_s2"]
        np.testing.assert_array_equal(together.values[run], alone.values)


def test_a_robot_without_accelerometers_has_no_readings() -> None:
    sim = simulate(ARM.with_accelerometers([]), np.zeros((5, 3)))
    assert "acceleration_m_s2" not in sim
