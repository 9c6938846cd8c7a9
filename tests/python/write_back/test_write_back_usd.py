"""Causes written into layers over USD stages."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from axisight import Effect, Robot, load_robot
from axisight.effects import effect_info
from axisight.errors import InputError
from axisight.gap.facts.result import Cause, Interval
from axisight.gap.facts.simulator_variant import Variant
from axisight.gap.simulator.rigid_torque import predicted_torque
from axisight.robot_import.usd import usd_model
from axisight.write_back import write_model
from usd_data import JOINT_TEXT, arm, saved

STATED = "float newton:armature = 0.5\n float newton:damping = 0.25\n float newton:friction = 3"
SERVOS = {
    name: f"float drive:angular:physics:stiffness = {kp}\n float drive:angular:physics:damping = 2\n"
    " float drive:angular:physics:maxForce = 90"
    for name, kp in (("turn", 50), ("shoulder", 60), ("elbow", 20))
}


def found(effect: str, axis: int | None, values: Mapping[str, float]) -> Cause:
    """Return a cause of a diagnosis with these parameters."""
    units = {p.name: p.unit for p in effect_info(effect).parameters}
    held = {name: Interval(x, x - 0.1 * abs(x), x + 0.1 * abs(x)) for name, x in values.items()}
    return Cause(effect, axis, 0.97, held, units, Interval(50.0, 40.0, 60.0))


def torque(robot: Robot, effects: list[Effect]) -> np.ndarray:
    """Return the torque (n, n_axes) [Nm] of a robot with effects in place of its own, away from reversals."""
    random = np.random.default_rng(5)
    speed = random.choice([-1.0, 1.0], (40, 3)) * random.uniform(0.5, 2.0, (40, 3))
    angle, acceleration = random.uniform(-1.5, 1.5, (40, 3)), random.uniform(-3.0, 3.0, (40, 3))
    motion = (angle, speed, acceleration, np.zeros((40, 3)))
    return np.asarray(predicted_torque(robot, Variant({}, tuple(effects)), motion))


CAUSES = {
    "dry friction": found("coulomb_friction", 2, {"coulomb_nm": 5.0, "smoothing_rad_s": 0.01}),
    "viscous friction": found("viscous_friction", 1, {"viscous_nm_s_rad": 2.5}),
    "rotor": found("motor_inertia", 2, {"relative_change": 0.4}),
    "heavier link": found("link_mass", 2, {"relative_change": 0.3}),
    "other centre": found("link_com", 3, {"x_m": 0.04, "y_m": 0.01, "z_m": -0.02}),
    "inertia": found("link_inertia", 2, {"relative_change": 0.25}),
    "load": found("payload", None, {"mass_kg": 2.0, "x_m": 0.3, "y_m": 0.02, "z_m": 0.05}),
    "spring": found("cable_stiffness", 2, {"stiffness_nm_rad": 60.0, "at_zero_nm": 20.0}),
    "length": found("link_geometry", 1, {"x_m": 0.01, "y_m": 0.02, "z_m": 0.03}),
    "zero": found("joint_zero_offset", 2, {"offset_rad": 0.05}),
    "tilt": found("base_tilt", None, {"about_x_rad": 0.03, "about_y_rad": -0.05}),
}


@pytest.mark.parametrize("case", CAUSES)
@pytest.mark.parametrize("units", [(1.0, 1.0), (0.5, 0.25)])
def test_the_written_arm_has_the_torque_of_the_cause(
    tmp_path: Path, case: str, units: tuple[float, float]
):
    """Torques of arm with effect and of the written arm; the stage has single precision."""
    text = arm(JOINT_TEXT | {"shoulder": STATED}, metres=units[0], kilograms=units[1])
    source, cause = saved(tmp_path, text), CAUSES[case]
    robot = load_robot(source)
    made = write_model(source, robot, [cause], tmp_path / "new.usda")
    assert made.placed == (cause.label,), made.why
    again = load_robot(made.path)
    own = [e for e in robot.effects if e.label != cause.label]
    want, got = torque(robot, [*own, cause.as_effect()]), torque(again, list(again.effects))
    plain = torque(robot, list(robot.effects))
    size = np.abs(want).max()
    assert np.abs(want - plain).max() > 1e-3 * size
    assert np.abs(want - got).max() < 2e-6 * size


def test_the_layer_holds_the_change_and_nothing_else(tmp_path: Path):
    source = saved(tmp_path, arm(JOINT_TEXT | {"shoulder": STATED}))
    before = source.read_bytes()
    made = write_model(source, load_robot(source), [CAUSES["dry friction"]], tmp_path / "new.usda")
    text = made.path.read_text()
    assert source.read_bytes() == before
    assert "@./arm.usda@" in text
    assert (
        'doc = "axisight: coulomb_friction@2: coulomb_nm = 5 (4.5 to 5.5) Nm on the motor' in text
    )
    assert [line.split()[1] for line in text.splitlines() if line.strip().startswith("over")] == [
        '"arm"',
        '"shoulder"',
    ]
    assert "physics:" not in text


def test_friction_is_converted_for_every_engine(tmp_path: Path):
    """PhysX: an effort at rest and in motion, the coefficient of load gone. Newton: an effort; MuJoCo holds."""
    text = JOINT_TEXT | {"shoulder": "float physxJoint:jointFriction = 0.2"}
    source = saved(tmp_path, arm(text, metres=0.01))
    made = write_model(source, load_robot(source), [CAUSES["dry friction"]], tmp_path / "new.usdc")
    model = usd_model(made.path)
    prim = model.joints["shoulder"].prim
    effort = pytest.approx(5.0 / 0.01**2)
    for name in ("staticFrictionEffort", "dynamicFrictionEffort"):
        assert prim.GetAttribute(f"physxJointAxis:angular:{name}").Get() == effort
    assert prim.GetAttribute("newton:friction").Get() == effort
    assert prim.GetAttribute("physxJoint:jointFriction").Get() == 0.0
    assert prim.GetAttribute("mjc:solimpfriction").Get()[0] == 0.9999
    assert not prim.GetAttribute("mjc:frictionloss")
    schemas = prim.GetMetadata("apiSchemas").GetAppliedItems()
    assert set(schemas) == {"NewtonJointAPI", "PhysxJointAxisAPI:angular"}


def test_damping_is_per_degree_except_for_mujoco(tmp_path: Path):
    source = saved(tmp_path, arm(JOINT_TEXT | {"turn": "double mjc:damping = 1"}))
    made = write_model(
        source, load_robot(source), [CAUSES["viscous friction"]], tmp_path / "new.usda"
    )
    model = usd_model(made.path)
    prim = model.joints["turn"].prim
    assert prim.GetAttribute("mjc:damping").Get() == pytest.approx(3.5)
    per_degree = pytest.approx(np.radians(3.5))
    assert prim.GetAttribute("newton:damping").Get() == per_degree
    assert (
        prim.GetAttribute("physxJointAxis:angular:viscousFrictionCoefficient").Get() == per_degree
    )


def test_gains_and_limits_of_drives_are_written(tmp_path: Path):
    """A weaker motor has smaller gains and a smaller limit; the limit found comes before its gain."""
    source = saved(tmp_path, arm(SERVOS, schemas='"PhysicsDriveAPI:angular"'))
    robot = load_robot(source)
    causes = [
        found("torque_constant", 1, {"relative_error": -0.2}),
        found("torque_saturation", 2, {"limit_nm": 40.0}),
        found("controller_gain", 3, {"relative_proportional": 0.5, "relative_integral": 0.1}),
    ]
    refit = {"turn.kp": Interval(0.25, 0.2, 0.3)}
    made = write_model(source, robot, causes, tmp_path / "new.usda", refit=refit)
    assert made.left_out == ()
    again = load_robot(made.path)
    kp, kd = (np.radians(again.controller_gains[name]) for name in ("kp", "kd"))
    assert kp == pytest.approx([50 * 0.8 * 1.25, 60, 30])
    assert kd == pytest.approx([1.6, 2, 2.2])
    limits = {e.axis: e.values()[0] for e in again.effects}
    assert limits == pytest.approx({1: 72, 2: 40, 3: 90})


def test_what_a_stage_has_no_place_for_is_named(tmp_path: Path):
    source = saved(tmp_path, arm())
    causes = [
        found("torque_ripple", 1, {"order_1": 1.0, "cosine_1_nm": 0.1}),
        found("input_delay", 1, {"delay_s": 0.01}),
        found("torque_constant", 2, {"relative_error": -0.2}),
    ]
    made = write_model(source, load_robot(source), causes, tmp_path / "new.usda")
    assert made.placed == ()
    why = [made.why[cause.label] for cause in causes]
    assert why[:2] == ["USD has no number for it"] * 2
    assert "PhysicsDriveAPI" in why[2]
    assert [effect.name for effect in made.remaining] == [cause.effect for cause in causes]


def test_a_layer_stands_beside_its_stage(tmp_path: Path):
    source = saved(tmp_path, arm())
    robot, other = load_robot(source), tmp_path / "other"
    other.mkdir()
    for target, told in ((other / "new.usda", "folder of"), (tmp_path / "new.urdf", "layer")):
        with pytest.raises(InputError, match=told):
            write_model(source, robot, [], target)


def test_bodies_in_instances_are_not_written(tmp_path: Path):
    saved(tmp_path, arm(), "asset.usda")
    text = (
        '#usda 1.0\n(\n defaultPrim = "robot"\n metersPerUnit = 1\n upAxis = "Z"\n)\n'
        'def Xform "robot" (\n instanceable = true\n references = @./asset.usda@\n)\n{\n}\n'
    )
    source = saved(tmp_path, text, "scene.usda")
    causes = [CAUSES["heavier link"], CAUSES["dry friction"]]
    made = write_model(source, load_robot(source), causes, tmp_path / "new.usda")
    assert made.placed == ()
    assert all("instance" in why for why in made.why.values())
