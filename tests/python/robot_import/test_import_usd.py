"""Robots out of USD stages, against MuJoCo and Newton."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from axisight import load_robot
from axisight.errors import MissingExtraError, RobotError
from axisight.robot_import import import_robot, is_model_file
from axisight.robot_import.usd import usd_model
from import_data import changed
from imported_arms import difference_to_mujoco, states
from usd_data import JOINT_TEXT, MJCF, arm, body, joint, saved

TURNS = {
    "newton": "float newton:armature = 0.5\n float newton:damping = 0.25\n float newton:friction = 3",
    "physx": "float physxJointAxis:angular:armature = 0.5\n"
    " float physxJointAxis:angular:viscousFrictionCoefficient = 0.25\n"
    " float physxJointAxis:angular:staticFrictionEffort = 3\n"
    " float physxJointAxis:angular:dynamicFrictionEffort = 3",
    "mujoco": f"double mjc:armature = 0.5\n double mjc:damping = {np.degrees(0.25)}\n double mjc:frictionloss = 3",
}


def test_a_stage_moves_as_in_mujoco(tmp_path: Path):
    """All numbers are exact in single precision, so the arms differ by rounding of double precision."""
    path = saved(tmp_path, arm())
    assert is_model_file(path)
    robot = load_robot(path)
    assert robot.joint_names == ["turn", "shoulder", "elbow"]
    assert difference_to_mujoco(robot, mujoco.MjModel.from_xml_string(MJCF)) < 1e-13
    assert robot.joint_ranges[2] == pytest.approx((-np.pi / 2, np.pi / 2))


def test_a_binary_stage_and_a_layer_over_it_are_the_same_robot(tmp_path: Path):
    sdf = pytest.importorskip("pxr.Sdf")
    plain = load_robot(saved(tmp_path, arm()))
    sdf.Layer.FindOrOpen(str(tmp_path / "arm.usda")).Export(str(tmp_path / "arm.usdc"))
    over = '#usda 1.0\n(\n defaultPrim = "arm"\n metersPerUnit = 1\n upAxis = "Z"\n subLayers = [@./arm.usdc@]\n)\n'
    for path in (tmp_path / "arm.usdc", saved(tmp_path, over, "over.usda")):
        robot = load_robot(path)
        assert robot.toml.partition("\n")[2] == plain.toml.partition("\n")[2]


@pytest.mark.parametrize("engine", TURNS)
def test_every_engine_states_the_same_numbers(tmp_path: Path, engine: str):
    """Damping of a joint that turns is per degree, except MuJoCo's."""
    robot = load_robot(saved(tmp_path, arm(JOINT_TEXT | {"shoulder": TURNS[engine]})))
    drive = robot.joints[1].drive
    assert drive is not None
    assert drive.motor_inertia == pytest.approx(0.5)
    assert drive.viscous_friction == pytest.approx(np.degrees(0.25))
    (dry,) = robot.effects
    assert dry.label == "coulomb_friction@2"
    assert dry.values()[0] == pytest.approx(3.0)
    assert "left out" not in robot.toml


def test_units_of_the_stage_are_applied(tmp_path: Path):
    """The same numbers in grams and centimetres are another arm: all torques are 1e-7 times as large."""
    text = JOINT_TEXT | {"shoulder": TURNS["newton"]}
    one = load_robot(saved(tmp_path, arm(text)))
    other = load_robot(saved(tmp_path, arm(text, metres=0.01, kilograms=0.001), "small.usda"))
    q, v, a = states(one, 5)
    # Weights scale by 1e-5, as gravity is stated in units of length too; without it all torques are alike.
    bare = [r.inverse_dynamics(q, v, a) - np.array([r.gravity(x) for x in q]) for r in (one, other)]
    assert np.abs(bare[1] - 1e-7 * bare[0]).max() < 1e-12 * 1e-7 * np.abs(bare[0]).max() * 1e3
    weight = [np.array([r.gravity(x) for x in q]) for r in (one, other)]
    assert weight[1] == pytest.approx(1e-5 * weight[0], rel=1e-6, abs=1e-12)
    assert other.effects[0].values()[0] == pytest.approx(3e-7)


def test_drives_become_a_controller(tmp_path: Path):
    """Gains of drives that turn are per degree; the force limit is one of torque."""
    texts = {
        name: f"float drive:angular:physics:stiffness = {kp}\n float drive:angular:physics:damping = 2\n"
        f" float drive:angular:physics:maxForce = {limit}"
        for name, kp, limit in (("turn", 50, 90), ("shoulder", 60, 80), ("elbow", 20, "inf"))
    }
    robot = load_robot(
        saved(tmp_path, arm(texts, schemas='"PhysicsDriveAPI:angular"')), sample_time_s=0.01
    )
    assert robot.controller_kind == "pd_position"
    assert robot.controller_gains["kp"] == pytest.approx(np.degrees([50, 60, 20]))
    assert robot.controller_gains["kd"] == pytest.approx(np.degrees([2, 2, 2]))
    limits = {e.axis: e.values()[0] for e in robot.effects if e.name == "torque_saturation"}
    assert limits == pytest.approx({1: 90, 2: 80})


def test_a_spring_rests_at_its_reference(tmp_path: Path):
    text = "double mjc:stiffness = 40\n double mjc:springref = 30"
    robot = load_robot(saved(tmp_path, arm(JOINT_TEXT | {"elbow": text})))
    (spring,) = robot.effects
    assert dict(spring.parameters or {})["stiffness_nm_rad"] == pytest.approx(40)
    assert dict(spring.parameters or {})["at_zero_nm"] == pytest.approx(40 * np.pi / 6)


def test_a_flipped_joint_and_a_slide_move_as_in_mujoco(tmp_path: Path):
    """The joint names its bodies in the other order, so its angle turns the other way."""
    text = changed(
        arm(),
        "rel physics:body0 = </arm/column>\n        rel physics:body1 = </arm/upper>",
        "rel physics:body0 = </arm/upper>\n        rel physics:body1 = </arm/column>",
    )
    text = changed(text, "localPos0 = (0.125, 0, 0.25)", "localPos0 = (0, 0, -0.0625)")
    at = text.index("localPos1 = (0, 0, -0.0625)")
    text = text[:at] + text[at:].replace("(0, 0, -0.0625)", "(0.125, 0, 0.25)", 1)
    text = changed(text, 'PhysicsRevoluteJoint "turn"', 'PhysicsPrismaticJoint "turn"')
    twin = changed(MJCF, 'name="shoulder" axis="0 1 0"', 'name="shoulder" axis="0 -1 0"')
    twin = changed(twin, 'name="turn"', 'name="turn" type="slide"')
    robot = load_robot(saved(tmp_path, text))
    assert difference_to_mujoco(robot, mujoco.MjModel.from_xml_string(twin)) < 1e-13


def test_y_up_is_gravity_along_y(tmp_path: Path):
    text = changed(changed(arm(), 'upAxis = "Z"', 'upAxis = "Y"'), "(0, 0, -1)", "(0, 0, 0)")
    text = text.replace("float physics:gravityMagnitude = 9.8125", "")
    robot = load_robot(saved(tmp_path, text))
    assert list(robot.gravity_m_s2) == [0.0, -9.81, 0.0]


def test_a_full_inertia_replaces_the_principal_moments(tmp_path: Path):
    full = "double[] newton:inertia = [0.0625, 0.125, 0.125, 0.015625, 0, 0]"
    text = changed(arm(), "float3 physics:diagonalInertia = (0.0625, 0.125, 0.125)", full)
    robot = load_robot(saved(tmp_path, text))
    assert robot.joints[2].link is not None
    assert robot.joints[2].link.inertia_kg_m2[3] == 0.015625


NOTED = {
    "static friction": (
        "float physxJointAxis:angular:staticFrictionEffort = 5\n"
        " float physxJointAxis:angular:dynamicFrictionEffort = 3",
        "staticFrictionEffort 5 left out",
    ),
    "friction of old assets": ("float physxJoint:jointFriction = 0.1", "physxJoint:jointFriction"),
    "speed limit": ("float newton:velocityLimit = 90", "newton:velocityLimit"),
    "two numbers": (
        "float newton:friction = 3\n double mjc:frictionloss = 4",
        "mjc:frictionloss (4 in SI units) left out: newton:friction states 3",
    ),
    "acceleration": (
        'uniform token drive:angular:physics:type = "acceleration"\n'
        " float drive:angular:physics:stiffness = 4",
        "they make accelerations",
    ),
}


@pytest.mark.parametrize("case", NOTED)
def test_what_is_left_out_is_named(tmp_path: Path, case: str):
    text, note = NOTED[case]
    robot = load_robot(saved(tmp_path, arm(JOINT_TEXT | {"shoulder": text})))
    (line,) = [one for one in robot.toml.splitlines() if note in one]
    assert "'shoulder'" in line


def test_loose_bodies_and_excluded_joints_are_named(tmp_path: Path):
    loop = joint("loop", "column", "fore", text="bool physics:excludeFromArticulation = 1")
    more = body("box", 1, "0, 0, 0", "1, 1, 1") + loop
    robot = load_robot(saved(tmp_path, arm(more=more)))
    assert "bodies without a joint left out: box" in robot.toml
    assert "joint 'loop' left out: excluded from the articulation" in robot.toml


def test_a_floating_base_stands_where_the_stage_puts_it(tmp_path: Path):
    text = arm()
    start, end = text.index("    def PhysicsFixedJoint"), text.index('    def Xform "column"')
    robot = load_robot(saved(tmp_path, text[:start] + text[end:]))
    assert "body 'base' is fixed to no body" in robot.toml
    assert difference_to_mujoco(robot, mujoco.MjModel.from_xml_string(MJCF)) < 1e-13


_LAYERS = ("    upAxis", "    subLayers = [@{}@]\n    upAxis")
# What becomes of the stage, and what is said of it.
REFUSED = {
    "no joints": ("def Physics", "def Other", "expected joints"),
    "loop": ("upAxis", "upAxis", "closed loop"),
    "ball": (
        'PhysicsRevoluteJoint "elbow"',
        'PhysicsSphericalJoint "elbow"',
        "PhysicsSphericalJoint",
    ),
    "no inertia": ("float3 physics:diagonalInertia = (0.5, 0.5, 0.0625)", "", "diagonalInertia"),
    "no mass": ("float physics:mass = 14", "", "physics:mass"),
    "negative": ("physics:mass = 14", "physics:mass = -14", "zero or more"),
    "friction": ("physics:mass = 7", "physics:mass = 7", "zero or more"),
    "outside": (_LAYERS[0], _LAYERS[1].format("../other.usda"), "inside the folder"),
    "remote": (_LAYERS[0], _LAYERS[1].format("https://a.org/b.usd"), "inside the folder"),
    "missing": (_LAYERS[0], _LAYERS[1].format("./other.usda"), "other.usda"),
    "no USD": ("#usda 1.0", "#robot", "USD"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_no_serial_chain_is_refused(tmp_path: Path, case: str):
    old, new, told = REFUSED[case]
    loop = joint("loop", "column", "fore") if case == "loop" else ""
    text = "float newton:friction = -1" if case == "friction" else ""
    path = saved(tmp_path, arm(JOINT_TEXT | {"elbow": text}, more=loop).replace(old, new))
    with pytest.raises(RobotError, match=told) as failed:
        import_robot(path)
    assert "arm.usda" in str(failed.value)


def test_without_usd_core_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(__import__("sys").modules, "pxr.Usd", None)
    with pytest.raises(MissingExtraError, match=r"axisight\[usd\]"):
        load_robot(saved(tmp_path, arm()))


def test_newton_reads_the_same_masses_and_joints(tmp_path: Path):
    """Newton's own parser of USD is the oracle of masses, armature, damping, friction and limits."""
    newton = pytest.importorskip("newton", reason="newton is installed by hand (docs/usd.md)")
    path = saved(tmp_path, arm(JOINT_TEXT | {"shoulder": TURNS["newton"]}))
    builder = newton.ModelBuilder()
    builder.add_usd(str(path))
    model, tree = builder.finalize(device="cpu"), usd_model(path).tree
    names = [label.rpartition("/")[2] for label in model.body_label]
    for name in ("column", "upper", "fore"):
        at, mass = names.index(name), tree.bodies[name].mass
        assert mass is not None
        assert model.body_mass.numpy()[at] == pytest.approx(mass.mass_kg)
        assert model.body_com.numpy()[at] == pytest.approx(mass.com_m)
        assert model.body_inertia.numpy()[at] == pytest.approx(mass.inertia_kg_m2, abs=1e-7)
    drive = load_robot(path).joints[1].drive
    assert drive is not None
    assert model.joint_armature.numpy()[1] == pytest.approx(drive.motor_inertia)
    assert model.joint_damping.numpy()[1] == pytest.approx(drive.viscous_friction)
    assert model.joint_friction.numpy()[1] == pytest.approx(3.0)
    assert model.joint_limit_upper.numpy()[2] == pytest.approx(np.pi / 2)
