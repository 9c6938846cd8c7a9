"""Motors that a model file leaves out are named, and not taken for links of another shape."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from test_write_back import cause

from axisight import Effect, Log, Robot, diagnose, load_robot
from axisight.effects import effect_info
from axisight.gap.hypotheses.candidates import _places
from axisight.robot_import import import_robot
from axisight.write_back import write_model
from import_data import MJCF, URDF, changed, written

STEP_S = 0.01
# On the joint [kg m^2]: of the order of the links'.
ROTORS = np.array([0.4, 0.06])


def arm(folder: Path) -> Robot:
    """Two joints without gears and friction, as most model files have them."""
    bare = URDF.replace('<dynamics damping="0.7" friction="1.5"/>', "")
    text = bare[: bare.index("  <transmission")] + "</robot>"
    return import_robot(written(folder, text), sample_time_s=STEP_S)


def logs_of(robot: Robot, rotors: np.ndarray) -> list[Log]:
    random = np.random.default_rng(0)
    time = STEP_S * np.arange(1500)
    out = []
    for k in range(3):
        waves = [(0.6, 1.1 + 0.2 * k, 0.3), (0.4, 2.3, 1.0 + k), (0.1, 5.1, 2.0)]
        phase = [[(a, w, w * time + p + i) for a, w, p in waves] for i in (0.0, 1.4)]
        q = np.column_stack([sum(a * np.sin(x) for a, _, x in axis) for axis in phase])
        v = np.column_stack([sum(a * w * np.cos(x) for a, w, x in axis) for axis in phase])
        a = np.column_stack([sum(-s * w**2 * np.sin(x) for s, w, x in axis) for axis in phase])
        torque = robot.inverse_dynamics(q, v, a) + rotors * a
        name = f"run{k}"
        out.append(
            Log(
                name=name,
                source=Path(name),
                sample_time_s=STEP_S,
                time_s=time,
                velocity_ref_rad_s=None,
                torque_nm=torque + 0.02 * random.normal(size=q.shape),
                position_rad=q + 1e-6 * random.normal(size=q.shape),
                velocity_rad_s=v,
            )
        )
    return out


def test_missing_rotors_are_named(tmp_path: Path):
    """They came out as other lengths, centres of mass and springs, certain."""
    robot = arm(tmp_path)
    logs = logs_of(robot, ROTORS)
    found = diagnose(robot=robot, estimation=logs[:2], validation=logs[2:])
    assert found.verdict == "explained"
    values = {cause.label: cause.parameters["inertia_kg_m2"] for cause in found.causes}
    assert sorted(values) == ["rotor_inertia@1", "rotor_inertia@2"]
    for axis, rotor in enumerate(ROTORS, 1):
        value = values[f"rotor_inertia@{axis}"]
        assert value.value == pytest.approx(rotor, rel=0.03)
    none = logs_of(robot, np.zeros(2))
    assert diagnose(robot=robot, estimation=none[:2], validation=none[2:]).verdict == "none"


def test_a_rotor_that_is_there_changes_by_a_share(tmp_path: Path):
    """Of one quantity one law is tried: a share of what the simulator has, or what it has not."""
    bare = arm(tmp_path)
    with_one = bare.with_parameters({"shoulder.motor_inertia": 0.1})
    share, added = effect_info("motor_inertia"), effect_info("rotor_inertia")
    assert (_places(bare, share), _places(bare, added)) == ([], [1, 2])
    assert (_places(with_one, share), _places(with_one, added)) == ([1], [2])
    elastic = load_robot("irb6600_like")
    assert (_places(elastic, share), _places(elastic, added)) == ([1, 2, 3], [])


def test_both_laws_give_the_same_torque(tmp_path: Path):
    robot = arm(tmp_path).with_parameters({"shoulder.motor_inertia": 0.1})
    state = [0.3, -0.2]
    more = robot.with_effects([Effect("rotor_inertia", 1, {"inertia_kg_m2": 0.02})])
    share = robot.with_effects([Effect("motor_inertia", 1, {"relative_change": 0.2})])
    wanted = robot.with_parameters({"shoulder.motor_inertia": 0.12}).linearize(state)
    for other in (more, share):
        for one, same in zip(other.linearize(state), wanted, strict=True):
            np.testing.assert_allclose(one, same, rtol=1e-12)


def test_armature_goes_back_into_an_mjcf(tmp_path: Path):
    source = written(tmp_path, changed(MJCF, 'armature="0.2" ', ""), "arm.xml")
    rotor = cause("rotor_inertia", 1, "inertia_kg_m2", 0.2 / 50**2)
    made = write_model(source, load_robot(source), [rotor], tmp_path / "new.xml")
    assert made.placed == ("rotor_inertia@1",)
    drive = load_robot(made.path).joints[0].drive
    assert drive is not None
    assert drive.motor_inertia == pytest.approx(0.2 / 50**2)
