"""The controller whose targets are positions, as the robot file states it."""

from __future__ import annotations

import pickle
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from axisight import Effect, Robot, load_robot, simulate
from axisight.errors import InputError, RobotError

Array = NDArray[np.float64]

KP, KD = (900.0, 900.0, 500.0), (40.0, 40.0, 20.0)
# Rounding of sums of a few terms of a hundred newton metres.
ROUNDING_NM = 1e-9


def robot_with(folder: Path, controller: str, schema: int = 2) -> Robot:
    """Return the three-axis preset with another controller."""
    text = (resources.files("axisight.robot.presets") / "irb6600_like.toml").read_text("utf-8")
    head, rest = text.split("[controller]")
    after = rest[rest.index("\n[") :]
    head = head.replace("axisight.robot/1", f"axisight.robot/{schema}")
    path = folder / "robot.toml"
    path.write_text(f"{head}[controller]\n{controller}{after}", "utf-8")
    return load_robot(path)


def pd(extra: str = "") -> str:
    return f'kind = "pd_position"\nkp = {list(KP)}\nkd = {list(KD)}\n{extra}\n'


def references(n: int = 800) -> Array:
    """Return speeds that begin and end at rest (n, 3) [rad/s], motor side."""
    t = np.arange(n) / n
    return 8.0 * np.sin(np.pi * t)[:, None] ** 2 * np.sin(2 * np.pi * t[:, None] * [1, 2, 3])


def law(robot: Robot, reference: Array, position: Array, *, fed: bool) -> Array:
    """Return what the controller commands beyond what holds the arm at the start (n, 3) [Nm]."""
    time = robot.sample_time_s
    target = position[0] + np.vstack([np.zeros(3), np.cumsum(reference, axis=0)[:-1]]) * time
    speed = np.diff(position, axis=0, prepend=position[:1]) / time
    return np.asarray(np.array(KP) * (target - position) + np.array(KD) * (fed * reference - speed))


@pytest.mark.parametrize("fed", [True, False])
def test_commands_are_the_stated_law_of_targets_and_measured_positions(
    tmp_path: Path, fed: bool
) -> None:
    robot = robot_with(tmp_path, pd(f"velocity_feedforward = {str(fed).lower()}"))
    assert robot.velocity_feedforward is fed
    assert robot.controller_kind == "pd_position"
    assert robot.controller_gains["kd"].tolist() == list(KD)
    out = simulate(robot, references(), noise_seed=1, method="rk4")
    torque, position = out["torque_cmd_nm"].values, out["position_rad"].values
    # The first measured speed is none: noise of the first position is in no speed.
    added = torque - robot.equilibrium()["motor_torque_nm"].values
    # The contract's phi_ref begins at the true angle, this law at the measured one.
    noise = position[0] - out["motor_position_rad"].values[0]
    expected = law(robot, references(), position, fed=fed) - np.array(KP) * noise
    assert np.abs(added - expected).max() < ROUNDING_NM


def test_with_speeds_fed_forward_it_is_a_speed_controller_with_integral(tmp_path: Path) -> None:
    """Formally ``kd`` is its proportional gain and ``kp`` the integral one: the same commands."""
    other = f'kind = "pi_velocity"\nkp = {list(KD)}\nki = {list(KP)}\n'
    found = [
        simulate(robot_with(tmp_path, c), references(), method="rk4")["torque_cmd_nm"].values
        for c in (pd(), other)
    ]
    assert np.abs(found[0] - found[1]).max() < ROUNDING_NM


def test_gravity_compensation_follows_the_measured_pose_of_the_stated_robot(
    tmp_path: Path,
) -> None:
    """What the machine carries beyond it is left to the gains; what is fitted does not change it."""
    robot = robot_with(tmp_path, pd("gravity_compensation = true"))
    load = Effect("link_mass", 3, {"relative_change": 0.2})
    for machine, effects in ((robot, []), (robot, [load])):
        out = simulate(machine, references(), effects=effects, method="rk4")
        position = out["position_rad"].values
        joints = np.zeros((len(position), robot.n_joints))
        joints[:, robot.axis_joints] = position * robot.gear_ratio
        gravity = robot.gravity(joints)[:, robot.axis_joints] * robot.gear_ratio
        fed = law(robot, references(), position, fed=True)
        torque = out["torque_cmd_nm"].values
        held = torque[0] - gravity[0]
        assert np.abs(torque - held - gravity - fed).max() < ROUNDING_NM
    without = simulate(robot_with(tmp_path, pd()), references(), effects=[load], method="rk4")
    assert np.abs(without["torque_cmd_nm"].values - torque).max() > 1e-3


def test_pickle_keeps_targets_and_operating_point(tmp_path: Path) -> None:
    robot = robot_with(tmp_path, pd()).with_velocity_feedforward(on=False)
    robot = robot.with_operating_point([0.1, 0.2, -0.1]).with_controller_speed(2.0)
    again = pickle.loads(pickle.dumps(robot))
    assert not again.velocity_feedforward
    assert again.operating_point.tolist() == [0.1, 0.2, -0.1]
    assert again.controller_gains["kp"].tolist() == [4 * k for k in KP]
    assert again.controller_gains["kd"].tolist() == [2 * k for k in KD]


@pytest.mark.parametrize(
    ("controller", "schema", "named"),
    [
        (pd(), 1, "kind"),
        (pd("gravity_compensation = 1"), 2, "gravity_compensation"),
        (pd("ki = [1.0, 1.0, 1.0]"), 2, "ki"),
        ('kind = "pd_position"\nkp = [1.0, 1.0, 1.0]\n', 2, "kd"),
    ],
)
def test_what_it_does_not_have_is_refused_by_name(
    tmp_path: Path, controller: str, schema: int, named: str
) -> None:
    with pytest.raises(RobotError, match=named):
        robot_with(tmp_path, controller, schema)


def test_other_controllers_have_no_such_switch(tmp_path: Path) -> None:
    robot = load_robot("irb6600_like")
    assert robot.velocity_feedforward
    with pytest.raises(InputError, match="pd_position"):
        robot.with_velocity_feedforward(on=False)
    with pytest.raises(InputError, match="angle"):
        robot.with_operating_point([0.0])
