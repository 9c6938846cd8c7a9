"""Rigid-body results as values of a robot file."""

import numpy as np
import pytest

from axisight import load_robot
from axisight.errors import InputError, RobotError
from axisight.gap.facts.simulator_variant import AS_GIVEN
from axisight.gap.simulator.rigid_torque import predicted_torque
from axisight.rigid_body import USUAL_TERMS, TorqueModel, identified_bodies
from axisight.robot_file import Provenance, load_identified, write_identified

ROBOT = load_robot("irb6600_like")
MODEL = TorqueModel(ROBOT, terms=USUAL_TERMS, side="motor")
FROM = Provenance("test")


def test_nominal_parameters_give_the_values_of_the_file():
    found = identified_bodies(MODEL, MODEL.nominal, FROM)
    known = ROBOT.parameters()
    shared = [n for n in found.names if n in known]
    assert {n.rpartition(".")[2] for n in shared} >= {"mass", "com_z", "motor_inertia"}
    for name in shared:
        # Products of 500 kg and a metre, rounded and taken back.
        assert found.value(name) == pytest.approx(known[name], rel=1e-12, abs=1e-12)


def test_written_robot_has_the_dynamics_of_the_parameters(tmp_path):
    rng = np.random.default_rng(0)
    theta = MODEL.nominal
    scale = 1 + 0.02 * rng.uniform(-1, 1, len(theta))
    # The same factor on all ten of a link keeps the body possible.
    scale[:30] = np.repeat(scale[:3], 10)
    theta = theta * scale
    theta[MODEL.names.index("axis2.coulomb_friction")] = 0.7
    theta[MODEL.names.index("axis3.torque_offset")] = -0.2
    write_identified(ROBOT, tmp_path / "new.toml", identified_bodies(MODEL, theta, FROM))
    back = load_robot(tmp_path / "new.toml")
    q, v, a = rng.uniform(-1, 1, (3, 5, ROBOT.n_joints))
    new = TorqueModel(back, terms=USUAL_TERMS, side="motor")
    bare = theta.copy()
    for name in MODEL.names:
        if name.endswith(("coulomb_friction", "torque_offset")):
            bare[MODEL.names.index(name)] = 0.0
    expected = MODEL.matrix(q, v, a) @ bare
    assert new.matrix(q, v, a) @ new.nominal == pytest.approx(expected, rel=1e-9)
    effects = {e.label: e.parameters for e in load_identified(tmp_path / "new.toml").effects}
    assert effects["coulomb_friction@2"]["coulomb_nm"] == pytest.approx(0.7)
    assert effects["torque_offset@3"]["offset_nm"] == pytest.approx(0.2)


def test_written_simulator_needs_the_torque_of_the_parameters(tmp_path):
    """Inverse dynamics of the simulator with its effects, against the regression: signs agree."""
    robot = load_robot("two_mass_axis")
    model = TorqueModel(robot, terms=USUAL_TERMS, side="motor")
    theta = model.nominal.copy()
    for name, value in (("coulomb_friction", 0.7), ("torque_offset", -0.2)):
        theta[model.names.index(f"axis1.{name}")] = value
    found = identified_bodies(model, theta, FROM, corner_rad_s=[0.001])
    write_identified(robot, tmp_path / "new.toml", found)
    back = load_robot(tmp_path / "new.toml")
    q, v, a = np.random.default_rng(0).uniform(-1, 1, (3, 20, 1))
    motor = tuple(np.ascontiguousarray(x / robot.gear_ratio) for x in (q, v, a))
    at = (*motor, np.zeros((20, 1)))
    needed = predicted_torque(back, AS_GIVEN, at)
    np.testing.assert_allclose(needed, model.matrix(q, v, a) @ theta, rtol=1e-6, atol=1e-9)
    dry = next(e for e in back.effects if e.name == "coulomb_friction")
    assert dry.parameters["smoothing_rad_s"] == pytest.approx(0.001)


def test_covariance_is_carried_to_first_order():
    rng = np.random.default_rng(1)
    theta = MODEL.nominal
    root = 1e-6 * rng.normal(size=(len(theta), len(theta))) * np.maximum(np.abs(theta), 0.1)
    found = identified_bodies(MODEL, theta, FROM, covariance=root.T @ root)
    moved = [
        identified_bodies(MODEL, theta + sign * row, FROM).values
        for row in root
        for sign in (1, -1)
    ]
    slopes = (np.array(moved[::2]) - np.array(moved[1::2])) / 2
    # Central differences are off by the square of relative steps of 1e-6 and by rounding.
    assert found.covariance == pytest.approx(slopes.T @ slopes, rel=1e-6, abs=1e-16)


def test_misuse(tmp_path):
    theta = MODEL.nominal
    joint = TorqueModel(ROBOT, terms=USUAL_TERMS, side="joint")
    with pytest.raises(InputError, match="side 'motor'"):
        identified_bodies(joint, joint.nominal, FROM)
    for bad in (theta[1:], np.full_like(theta, np.nan)):
        with pytest.raises(InputError, match="theta"):
            identified_bodies(MODEL, bad, FROM)
    with pytest.raises(InputError, match="covariance"):
        identified_bodies(MODEL, theta, FROM, covariance=np.eye(3))
    massless = theta.copy()
    massless[0] = -1.0
    with pytest.raises(InputError, match="identify_consistent"):
        identified_bodies(MODEL, massless, FROM)
    impossible = theta.copy()
    impossible[MODEL.names.index("axis1.inertia_zz")] *= 1000
    with pytest.raises(RobotError):
        write_identified(ROBOT, tmp_path / "x.toml", identified_bodies(MODEL, impossible, FROM))
