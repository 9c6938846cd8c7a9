"""What a Robot says of itself: as its description has it, with the parameters replaced since."""

import pickle
import tomllib

import numpy as np
import pytest

from axisight import Effect, InputError, Robot, _core, load_robot
from three_axes import TEXT

ARM = load_robot("irb6600_like")
SLIDER = Robot.from_toml(TEXT.replace("MOTION", 'motion = "prismatic"'))


@pytest.mark.parametrize("robot", [ARM, SLIDER, load_robot("two_mass_axis")], ids=lambda r: r.name)
def test_joints_are_those_of_the_description(robot: Robot) -> None:
    """Oracle: the text itself."""
    document = tomllib.loads(robot.toml)
    assert robot.gravity_m_s2.tolist() == document["gravity"]
    for joint, want in zip(robot.joints, document["joint"], strict=True):
        assert joint.name == want["name"]
        assert joint.prismatic == (want.get("motion") == "prismatic")
        assert joint.origin_m.tolist() == want["origin"]
        assert joint.axis.tolist() == want["axis"]
        spring = None if joint.spring is None else (joint.spring.stiffness, joint.spring.damping)
        stated = (want["stiffness"], want["damping"]) if "stiffness" in want else None
        assert spring == stated
        assert (joint.drive is not None) == (want["kind"] == "driven")
        if joint.drive is not None:
            drive = want["drive"]
            assert joint.drive.gear_ratio == drive["gear_ratio"]
            assert joint.drive.motor_inertia == drive["motor_inertia"]
            assert joint.drive.viscous_friction == drive["viscous_friction"]
        assert (joint.link is not None) == ("link" in want)
        if joint.link is not None:
            assert joint.link.mass_kg == want["link"]["mass"]
            assert joint.link.com_m.tolist() == want["link"]["com"]
            assert joint.link.inertia_kg_m2.tolist() == want["link"]["inertia"]


def test_axes_are_the_driven_joints() -> None:
    joints = ARM.joints
    driven = [i for i, joint in enumerate(joints) if joint.drive is not None]
    assert ARM.axis_joints == driven
    assert ARM.axis_names == [joints[i].name for i in driven]
    assert [joints[i].prismatic for i in driven] == ARM.axis_is_prismatic
    assert [joints[i].spring is None for i in driven] == ARM.axis_is_rigid
    assert SLIDER.axis_is_prismatic == [False, False, True]
    assert SLIDER.axis_is_rigid == [True, True, True]


def test_changed_parameters_show_in_joints_but_not_in_the_text() -> None:
    """Oracle: mass, first moments and inertia about the origin as the regression has them."""
    first = ARM.joint_names[0]
    changed = ARM.with_parameters(
        {f"{first}.com_x": 0.3, f"{first}.inertia_scale": 2.0, f"{first}.stiffness": 1e6}
    )
    joint = changed.joints[0]
    assert joint.spring is not None and joint.link is not None
    assert joint.spring.stiffness == 1e6 == changed.parameters()[f"{first}.stiffness"]
    m, (x, y, z) = joint.link.mass_kg, joint.link.com_m
    links, values = _core.inertial_parameters(changed.core)
    own = values.reshape(-1, 10)[links.index(0)]
    assert own[:4] == pytest.approx([m, m * x, m * y, m * z], rel=1e-14)
    xx, _, zz, xy, *_ = joint.link.inertia_kg_m2
    want = [xx + m * (y * y + z * z), zz + m * (x * x + y * y), xy - m * x * y]
    assert own[[4, 6, 7]] == pytest.approx(want, rel=1e-12)
    assert changed.toml == ARM.toml
    assert ARM.joints[0].link is not None and ARM.joints[0].link.com_m[0] != 0.3
    again = pickle.loads(pickle.dumps(changed)).joints[0]
    assert again.link.inertia_kg_m2.tolist() == joint.link.inertia_kg_m2.tolist()


def test_copies_keep_what_they_do_not_change() -> None:
    friction = Effect("coulomb_friction", 1, {"coulomb_nm": 0.5})
    robot = ARM.with_effects([friction])
    assert robot.effects == (friction,)
    assert robot.with_parameters({}).effects == (friction,)
    assert robot.parameters() == ARM.parameters()
    with pytest.raises(InputError, match=r"no\.such"):
        robot.with_parameters({"no.such": 1.0})


def test_what_is_returned_is_a_copy() -> None:
    ARM.gear_ratio[:] = 0.0
    ARM.joints[0].origin_m[:] = 7.0
    ARM.controller_gains["kp"][:] = 0.0
    assert (ARM.gear_ratio != 0).all() and (ARM.controller_gains["kp"] > 0).all()
    assert not np.array_equal(ARM.joints[0].origin_m, np.full(3, 7.0))
