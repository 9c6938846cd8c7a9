"""Written layers in Newton: friction that holds at rest, drives and masses as written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from axisight import load_robot
from axisight.gap.facts.result import Cause, Interval
from axisight.write_back import write_model
from found_causes import several
from newton_arm import NewtonArm
from usd_data import arm, body, joint, saved

pytest.importorskip("newton", reason="needs pip install 'newton[sim]': docs/usd.md")

INERTIA, FRICTION_NM, PUSH_NM, STEP_S = 0.0016, 1.0, 0.3, 0.001
# MuJoCo's default constraint of friction: impedance d at rest, and rate b = 2 / (dmax timeconst).
DEFAULT = (0.9, 2 / (0.95 * 0.02))
WRITTEN = (0.9999, 200.0)


def link(text: str = "") -> str:
    """Return a stage with one wheel on an upright axis."""
    head = '#usda 1.0\n(\n defaultPrim = "arm"\n metersPerUnit = 1\n upAxis = "Z"\n)\n'
    wheel = body("wheel", 1, "0, 0, 0", f"{INERTIA}, {INERTIA}, {INERTIA}")
    axis = joint("spin", "", "wheel", text='uniform token physics:axis = "Z"\n        ' + text)
    root = 'def Xform "arm" (\n prepend apiSchemas = ["PhysicsArticulationRootAPI"]\n)\n{\n'
    return head + root + wheel + axis + "}\n"


# Newton takes a single joint to the world as no articulation, and says so.
STANDALONE = pytest.mark.filterwarnings("ignore:SolverMuJoCo is converting")


def creep(path: Path) -> float:
    """Return the speed [rad/s] of the joint after 0.2 s under a torque below its friction."""
    push = np.array([PUSH_NM])
    return float(NewtonArm(path).run(lambda *_: push, np.zeros(1), 0.2, STEP_S)[1][-1, 0])


def law(impedance: float, rate: float) -> float:
    """Return the speed [rad/s] at which a soft constraint holds the torque (docs/usd.md)."""
    return PUSH_NM / INERTIA * (1 - impedance) / impedance / rate


@STANDALONE
def test_friction_holds_at_rest_where_the_number_alone_creeps(tmp_path: Path):
    """Both speeds are those of the soft constraint, to the half per mille of single-precision numbers."""
    source = saved(tmp_path, link())
    values = {"coulomb_nm": Interval(FRICTION_NM, 0.9, 1.1)}
    dry = Cause("coulomb_friction", 1, 0.97, values, {}, Interval(50.0, 40.0, 60.0))
    made = write_model(source, load_robot(source), [dry], tmp_path / "new.usda")
    copied = saved(tmp_path, link(f"float newton:friction = {FRICTION_NM}"), "copied.usda")
    assert creep(copied) == pytest.approx(law(*DEFAULT), rel=1e-3)
    # 1 - d has three digits in single precision.
    assert creep(made.path) == pytest.approx(law(*WRITTEN), rel=1e-2)
    assert creep(made.path) < creep(copied) / 1000


@STANDALONE
def test_a_joint_slips_beyond_its_friction(tmp_path: Path):
    """What exceeds the friction accelerates the wheel."""
    source = saved(tmp_path, link())
    values = {"coulomb_nm": Interval(0.2, 0.19, 0.21)}
    dry = Cause("coulomb_friction", 1, 0.97, values, {}, Interval(50.0, 40.0, 60.0))
    made = write_model(source, load_robot(source), [dry], tmp_path / "new.usda")
    # 0.2 s less the step before the first: 199 steps of acceleration.
    assert creep(made.path) == pytest.approx((PUSH_NM - 0.2) / INERTIA * 199 * STEP_S, rel=1e-3)


def test_newton_reads_what_is_written(tmp_path: Path):
    """Drive, armature, damping and mass of the layer as Newton's own reader has them."""
    servo = "float drive:angular:physics:stiffness = 50\n float drive:angular:physics:damping = 2"
    texts = dict.fromkeys(("turn", "shoulder", "elbow"), servo + "\n float newton:armature = 0.5")
    source = saved(tmp_path, arm(texts, schemas='"PhysicsDriveAPI:angular"'))
    causes = [
        several("controller_gain", 1, relative_proportional=0.5, relative_integral=0.1),
        several("torque_saturation", 2, limit_nm=40.0),
        several("motor_inertia", 3, relative_change=0.4),
        several("viscous_friction", 3, viscous_nm_s_rad=2.5),
        several("link_mass", 2, relative_change=0.25),
    ]
    made = write_model(source, load_robot(source), causes, tmp_path / "new.usda")
    assert made.left_out == ()
    model = NewtonArm(made.path).model
    per_radian = 180 / np.pi
    assert model.joint_target_ke.numpy() == pytest.approx(np.array([75, 50, 50]) * per_radian)
    assert model.joint_target_kd.numpy() == pytest.approx(np.array([2.2, 2, 2]) * per_radian)
    assert model.joint_effort_limit.numpy()[1] == pytest.approx(40.0)
    assert model.joint_armature.numpy() == pytest.approx([0.5, 0.5, 0.7])
    assert model.joint_damping.numpy() == pytest.approx([0.0, 0.0, 2.5])
    assert model.body_mass.numpy()[2] == pytest.approx(17.5)
