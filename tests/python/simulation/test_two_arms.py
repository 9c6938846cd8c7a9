"""A robot with two arms in simulation, against MuJoCo, and its identification from a simulated motion."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from axisight import Robot, simulate, simulate_batch
from axisight.rigid_body import TorqueModel, base_parameters, identify_rigid_body
from axisight.rigid_body.friction import USUAL_TERMS
from axisight.robot import Accelerometer
from axisight.robot_export import mjcf

Array = NDArray[np.float64]

# A waist and two arms; each arm ends in an elastic joint, and one gear is rigid.
_JOINTS = (
    ("waist", "base", [0.0, 0.0, 0.5], [0.0, 0.0, 1.0], 4e4),
    ("left_shoulder", "waist", [0.0, 0.3, 0.4], [0.0, 1.0, 0.0], 2e4),
    ("left_elbow", "left_shoulder", [0.4, 0.0, 0.0], [0.0, 0.6, 0.8], 1e4),
    ("left_bend", "left_elbow", [0.2, 0.0, 0.0], [0.0, 0.0, 1.0], 4e3),
    ("right_shoulder", "waist", [0.0, -0.3, 0.4], [0.0, 1.0, 0.0], 2e4),
    ("right_slide", "right_shoulder", [0.3, 0.0, 0.0], [1.0, 0.0, 0.0], None),
    ("right_bend", "right_slide", [0.1, 0.0, 0.0], [0.0, 1.0, 0.0], 3e3),
)


def two_arms() -> Robot:
    """Return a robot whose arms differ, with elastic gears and joints."""
    tables = []
    for i, (name, parent, origin, axis, stiffness) in enumerate(_JOINTS):
        elastic = name.endswith("bend")
        spring = (
            "" if stiffness is None else f"stiffness = {stiffness}\ndamping = {stiffness * 2e-3}\n"
        )
        drive = "[joint.drive]\ngear_ratio = 0.02\nmotor_inertia = 4e-4\nviscous_friction = 2e-3\n"
        tables.append(
            f'[[joint]]\nname = "{name}"\nparent = "{parent}"\nkind = "{"elastic" if elastic else "driven"}"\n'
            f'motion = "{"prismatic" if name.endswith("slide") else "revolute"}"\n'
            f"origin = {origin}\naxis = {axis}\n{spring}[joint.link]\nmass = {6.0 - 0.6 * i}\n"
            f"com = [{0.15 + 0.01 * i}, {0.02 * i}, 0.03]\ninertia = [0.05, 0.08, 0.07, 0.004, -0.003, 0.002]\n"
            f"{'' if elastic else drive}"
        )
    head = (
        'schema = "axisight.robot/2"\nname = "two arms"\ngravity = [0.0, 0.0, -9.81]\n'
        "sample_time = 1e-3\n[operating_point]\njoint_angle = [0.1, 0.4, -0.6, 0.5, 0.1]\n"
    )
    return Robot.from_toml(head + "".join(tables))


def torques(robot: Robot, samples: int) -> Array:
    """Return torques (samples, n_axes) that hold the robot and shake it."""
    time = robot.sample_time_s * np.arange(samples)
    holding = robot.equilibrium()["motor_torque_nm"].values
    size = np.array([0.8, 0.5, 0.3, 0.5, 0.3])
    pitch_hz = np.array([1.5, 2.3, 3.1, 1.9, 2.7])
    return holding + size * np.sin(2 * np.pi * pitch_hz * time[:, None])


def in_mujoco(robot: Robot, torque_nm: Array, steps: int) -> Array:
    """Return joint positions (n, n_joints) at the samples, by Runge-Kutta with ``steps`` steps a sample."""
    model = mujoco.MjModel.from_xml_string(mjcf(robot))
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    model.opt.timestep = robot.sample_time_s / steps
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    data = mujoco.MjData(model)
    place = {model.joint(i).name: int(model.jnt_qposadr[i]) for i in range(model.njnt)}
    rest = robot.equilibrium()
    angle = rest["joint_angle_rad"].values
    turned = dict(zip(robot.axis_names, rest["motor_angle_rad"].values, strict=True))
    geared = [f"motor of {name}" in place for name in robot.joint_names]
    for joint, at, has_gear in zip(robot.joints, angle, geared, strict=True):
        data.qpos[place[joint.name]] = at
        if has_gear and joint.drive is not None:
            motor = joint.drive.gear_ratio * turned[joint.name]
            data.qpos[place[f"motor of {joint.name}"]] = motor
            data.qpos[place[joint.name]] -= motor
    out = np.empty((len(torque_nm), robot.n_joints))
    for k, torque in enumerate(torque_nm):
        for j, name in enumerate(robot.joint_names):
            out[k, j] = data.qpos[place[name]]
            if geared[j]:
                out[k, j] += data.qpos[place[f"motor of {name}"]]
        data.ctrl[:] = torque
        for _ in range(steps):
            mujoco.mj_step(model, data)
    return out


def test_two_arms_move_as_in_mujoco():
    robot = two_arms()
    torque = torques(robot, 300)
    found = simulate(robot, torque_nm=torque, tolerance=1e-10)
    assert found.attrs["status"] == "completed"
    joint = found["joint_position_rad"].values
    # The joints move by tenths of a radian. Runge-Kutta at 1/20 of a sample is exact to about 1e-9 here.
    assert np.ptp(joint, axis=0).max() > 0.1
    assert np.abs(joint - in_mujoco(robot, torque, 20)).max() < 1e-7


def test_lanes_run_as_one_run():
    robot = two_arms()
    torque = torques(robot, 50)
    one = simulate(robot, torque_nm=torque, method="rk4", substeps=4)
    many = simulate_batch(robot, torque_nm=np.stack([torque] * 9), method="rk4", substeps=4)
    assert np.array_equal(many["joint_position_rad"][8], one["joint_position_rad"])


def test_accelerometers_on_every_branch_read_gravity_at_rest():
    where = ["left_bend", "right_slide", "waist"]
    robot = two_arms().with_accelerometers(
        [Accelerometer(name, name, (0.1, 0.0, 0.2)) for name in where]
    )
    q = robot.equilibrium()["joint_angle_rad"].values
    read = robot.specific_force(q, np.zeros(7), np.zeros(7))
    for name, got in zip(where, read, strict=True):
        wanted = robot.pose(q, name)[0].T @ -robot.gravity_m_s2
        np.testing.assert_allclose(got, wanted, atol=1e-12)


def test_the_linearized_robot_is_the_slope_of_its_equations():
    """Accelerations of the joints per joint angle and torque, from the equations without motors."""
    robot = two_arms()
    a, b, _ = robot.linearize()
    n, motors = robot.n_joints, 4
    rest = robot.equilibrium()["joint_angle_rad"].values
    mass = robot.inertia_matrix(rest)
    rigid = robot.joint_names.index("right_slide")
    ratio = 0.02
    mass[rigid, rigid] += 4e-4 / ratio**2
    springs = np.array([0.0 if x[4] is None else x[4] for x in _JOINTS])
    step = 1e-6
    gravity = np.stack(
        [
            (robot.gravity(rest + step * unit) - robot.gravity(rest - step * unit)) / (2 * step)
            for unit in np.eye(n)
        ],
        axis=1,
    )
    slope = -np.linalg.solve(mass, gravity + np.diag(springs))
    states = motors + n
    found = a[states + motors :, motors:states]
    # Central differences of gravity torques near 100 Nm are exact to about 1e-8 of them.
    assert np.abs(found - slope).max() < 1e-6 * np.abs(slope).max()
    pushed = np.linalg.solve(mass, np.eye(n)[rigid] / ratio)
    np.testing.assert_allclose(b[states + motors :, robot.axis_names.index("right_slide")], pushed)


@pytest.mark.parametrize("side", ["joint", "motor"])
def test_base_parameters_come_back_from_a_motion(side: str):
    robot = two_arms()
    model = TorqueModel(robot, side=side)  # type: ignore[arg-type]
    base = base_parameters(model)
    rng = np.random.default_rng(1)
    q, v, a = rng.normal(size=(3, 400, 7))
    rows = model.matrix(q, v, a).reshape(-1, model.n_parameters)
    forces = robot.inverse_dynamics(q, v, a) @ model.row_map.T
    found = np.linalg.lstsq(rows[:, base.columns], forces.ravel(), rcond=None)[0]
    # Least squares with a condition below 1e4 on numbers without noise.
    np.testing.assert_allclose(found, base.matrix @ model.nominal, rtol=1e-9, atol=1e-9)


def test_identification_finds_the_masses_of_both_arms():
    """Torques of a true robot with other masses, drives and noise: every error within its uncertainty."""
    nominal = two_arms()
    changed = {
        "left_elbow.mass": 6.5,
        "right_slide.com_x": 0.3,
        "left_shoulder.motor_inertia": 6e-4,
    }
    truth = TorqueModel(nominal.with_parameters(changed), terms=USUAL_TERMS, side="motor")
    model = TorqueModel(nominal, terms=USUAL_TERMS, side="motor")
    rng = np.random.default_rng(2)
    time = np.arange(3000) * 2e-3
    axes = nominal.axis_joints
    pitch_rad_s, phase = 2 * np.pi * rng.uniform(0.3, 2.0, (5, 4)), rng.uniform(0, 6, (5, 4))
    size = rng.uniform(0.2, 0.5, (5, 4))
    q, v, a = np.zeros((3, len(time), 7))
    for axis, joint in enumerate(axes):
        turns = pitch_rad_s[axis] * time[:, None] + phase[axis]
        q[:, joint] = np.sin(turns) @ size[axis]
        v[:, joint] = np.cos(turns) @ (size[axis] * pitch_rad_s[axis])
        a[:, joint] = -np.sin(turns) @ (size[axis] * pitch_rad_s[axis] ** 2)
    torque = truth.matrix(q, v, a) @ truth.nominal
    torque += 0.01 * torque.std(axis=0) * rng.normal(size=torque.shape)
    base = base_parameters(model, locked=True)
    found = identify_rigid_body(model, q, v, a, torque, base=base)
    want = found.base.from_standard(truth.nominal)
    # About thirty normal errors: the largest exceeds 4.5 standard deviations once in 3,000 tests.
    assert np.abs((found.values - want) / found.standard_error).max() < 4.5
    assert found.relative_error.max() < 0.012
    assert np.abs(found.base.from_standard(model.nominal) - want).max() > 0.1
