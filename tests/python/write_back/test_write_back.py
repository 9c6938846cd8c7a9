"""Causes written into models: the numbers that change, and not a byte beside them."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np
import pytest

from axisight import Effect, Robot, load_robot
from axisight.effects.stated import DRY_FRICTION
from axisight.errors import InputError
from axisight.gap.facts.result import Cause, Interval
from axisight.gap.facts.simulator_variant import Variant
from axisight.gap.simulator.rigid_torque import predicted_torque
from axisight.remainder import ModelledRemainder, Remainder
from axisight.write_back import write_model
from found_causes import several
from import_data import MJCF, URDF, changed, written

UNITS = {"coulomb_nm": "Nm", "viscous_nm_s_rad": "Nm s/rad", "half_width_rad": "rad"}


def cause(effect: str, axis: int, name: str, value: float) -> Cause:
    interval = Interval(value, 0.9 * value, 1.1 * value)
    return Cause(effect, axis, 0.97, {name: interval}, UNITS, Interval(50.0, 40.0, 60.0))


# One joint a body, the second as it is.
PLAIN = changed(MJCF, '        <joint name="slide" type="slide" axis="1 0 0" pos="0 0.1 0"/>\n', "")

DRY, VISCOUS = (
    cause("coulomb_friction", 1, "coulomb_nm", 0.05),
    cause("viscous_friction", 2, "viscous_nm_s_rad", 0.3),
)
PLAY = cause("backlash", 1, "half_width_rad", 1e-4)


def lines_changed(before: Path, after: Path) -> list[str]:
    """Return the lines that are not in both, with their signs."""
    texts = [path.read_text().splitlines() for path in (before, after)]
    found = difflib.unified_diff(*texts, n=0, lineterm="")
    return [line for line in found if not line.startswith(("---", "+++", "@@"))]


def test_friction_stands_in_a_urdf(tmp_path: Path):
    """One joint has <dynamics>, the other gets it; the shoulder's gear is fifty."""
    source = written(tmp_path, URDF)
    robot = load_robot(source)
    made = write_model(source, robot, [DRY, VISCOUS, PLAY], tmp_path / "new.urdf")
    assert made.placed == ("coulomb_friction@1", "viscous_friction@2")
    assert made.left_out == ("backlash@1",)
    assert lines_changed(source, made.path) == [
        '-    <dynamics damping="0.7" friction="1.5"/>',
        "+    <!-- axisight: coulomb_friction@1: coulomb_nm = 0.05 (0.045 to 0.055) Nm on the motor, "
        "probability 0.97 -->",
        '+    <dynamics damping="0.7" friction="2.5"/>',
        "+    <!-- axisight: viscous_friction@2: viscous_nm_s_rad = 0.3 (0.27 to 0.33) Nm s/rad on the motor, "
        "probability 0.97 -->",
        '+    <dynamics damping="0.3"/>',
    ]
    again = load_robot(made.path)
    assert again.effects[0].values()[0] == pytest.approx(0.05)
    assert again.parameters()["elbow.viscous_friction"] == pytest.approx(0.3)
    rest = {n: v for n, v in robot.parameters().items() if n != "elbow.viscous_friction"}
    assert {n: again.parameters()[n] for n in rest} == rest


def test_both_frictions_of_a_joint_are_one_change(tmp_path: Path):
    source = written(tmp_path, URDF)
    both = [DRY, cause("viscous_friction", 1, "viscous_nm_s_rad", 1e-4)]
    made = write_model(source, load_robot(source), both, tmp_path / "new.urdf")
    again = load_robot(made.path)
    # What is found comes on top of the viscous friction that the simulator has.
    assert again.parameters()["shoulder.viscous_friction"] == pytest.approx(0.7 / 50**2 + 1e-4)
    assert again.effects[0].values()[0] == pytest.approx(0.05)
    assert made.path.read_text().count("axisight:") == 1


def test_an_element_without_content_gets_one(tmp_path: Path):
    """MJCF has numbers as attributes; quotes, order and line breaks of others stay."""
    source = written(tmp_path, changed(MJCF, 'name="elbow"', "name='elbow'"), "arm.xml")
    robot = load_robot(source)
    made = write_model(source, robot, [DRY, VISCOUS], tmp_path / "new.xml")
    assert lines_changed(source, made.path) == [
        "+      <!-- axisight: coulomb_friction@1: coulomb_nm = 0.05 (0.045 to 0.055) Nm on the motor, "
        "probability 0.97 -->",
        '-             frictionloss="1.5" armature="0.2" stiffness="3"/>',
        '+             frictionloss="2.5" armature="0.2" stiffness="3"/>',
        "-        <joint name='elbow' axis=\"0 0 -1\"/>",
        "+        <!-- axisight: viscous_friction@2: viscous_nm_s_rad = 0.3 (0.27 to 0.33) Nm s/rad on the motor, "
        "probability 0.97 -->",
        '+        <joint name=\'elbow\' axis="0 0 -1" damping="0.3"/>',
    ]
    assert load_robot(made.path).parameters()["elbow.viscous_friction"] == pytest.approx(0.3)


def test_what_motors_add_stays_on_them(tmp_path: Path):
    """A joint gets what its motor has not; the machine is the one that was found."""
    if int(mujoco.__version__.split(".")[0]) < 4:
        pytest.skip("motors have no damping before MuJoCo 4")
    text = changed(MJCF, 'gear="50"', 'gear="50" armature="1e-5" damping="2e-4"')
    source = written(tmp_path, text, "arm.xml")
    robot = load_robot(source)
    more = cause("viscous_friction", 1, "viscous_nm_s_rad", 1e-3)
    made = load_robot(write_model(source, robot, [more], tmp_path / "new.xml").path)
    before, after = (r.parameters()["shoulder.viscous_friction"] for r in (robot, made))
    assert before == pytest.approx(0.7 / 50**2 + 2e-4)
    assert after == pytest.approx(before + 1e-3)


def test_a_robot_file_has_place_for_all(tmp_path: Path):
    source = written(tmp_path, URDF)
    robot = load_robot("irb6600_like")
    made = write_model("irb6600_like", robot, [DRY, VISCOUS, PLAY], tmp_path / "new.toml")
    assert made.left_out == ()
    labels = [effect.label for effect in load_robot(made.path).effects]
    assert sorted(labels) == ["backlash@1", "coulomb_friction@1", "viscous_friction@2"]
    urdf = write_model(source, load_robot(source), [DRY], tmp_path / "of_urdf.toml")
    assert load_robot(urdf.path).effects[0].values()[0] == pytest.approx(0.05)


HEAVIER = several("link_mass", 1, relative_change=0.2)
ASIDE = several("link_com", 2, x_m=0.02, y_m=-0.01, z_m=0.03)
LOAD = several("payload", None, mass_kg=1.5, x_m=0.1, y_m=0.05, z_m=-0.2, gyration_m2=0.04)
BULKIER = several("link_inertia", 2, relative_change=0.4)
LONGER = several("link_geometry", 1, x_m=0.03, y_m=-0.02, z_m=0.01)
ZEROS = [several("joint_zero_offset", axis, offset_rad=0.1 * axis) for axis in (1, 2)]
TILTED = several("base_tilt", None, about_x_rad=0.12, about_y_rad=-0.2)
GAIN = several("torque_constant", 1, relative_error=0.07)
SPRING = several("cable_stiffness", 2, stiffness_nm_rad=4.0, at_zero_nm=1.2)
ROTORS = (
    several("rotor_inertia", 2, inertia_kg_m2=0.3),
    several("motor_inertia", 1, relative_change=0.5),
)


def torque_of(robot: Robot, effects: Sequence[Effect] = ()) -> np.ndarray:
    """Return motor torques at random motions, all effects of the robot and these with it."""
    random = np.random.default_rng(0)
    motion = [random.normal(size=(200, robot.n_axes)) for _ in range(4)]
    # MuJoCo rounds the corner of its friction by the inertia; a cause has a corner of its own.
    friction, _, corner = DRY_FRICTION
    alike = {e.label: e.with_values({corner: 0.1}) for e in robot.effects if e.name == friction}
    alike |= {e.label: e.with_values({corner: 0.1}) for e in effects if e.name == friction}
    others = [e for e in effects if e.name != friction]
    return predicted_torque(robot, Variant({}, (*others, *alike.values())), tuple(motion))


@pytest.mark.parametrize(
    "causes",
    [
        [HEAVIER],
        [ASIDE],
        [LOAD],
        [BULKIER],
        [LONGER],
        ZEROS[:1],
        ZEROS[1:],
        [TILTED],
        [HEAVIER, ASIDE, LOAD, BULKIER, VISCOUS, LONGER, *ZEROS, TILTED],
    ],
    ids=lambda causes: causes[0].label if len(causes) == 1 else "all",
)
@pytest.mark.parametrize("kind", ["urdf", "xml"])
def test_links_become_what_the_simulator_has(tmp_path: Path, causes: list[Cause], kind: str):
    """Frames that are turned, bodies on fixed joints, another motion of the same robot: the same torque."""
    text = URDF if kind == "urdf" else PLAIN
    source = written(tmp_path, text, f"arm.{kind}")
    robot = load_robot(source)
    made = write_model(source, robot, causes, tmp_path / f"new.{kind}")
    assert made.placed == tuple(c.label for c in causes)
    assert (made.left_out, made.remaining) == ((), ())
    wanted = torque_of(robot, [c.as_effect() for c in causes])
    assert np.abs(wanted - torque_of(robot)).max() > 0.005
    np.testing.assert_allclose(torque_of(load_robot(made.path)), wanted, atol=1e-8)
    # Nothing but numbers and comments.
    assert [*map(str.strip, made.path.read_text().splitlines())][-1] == text.split()[-1].strip()
    removed = [line for line in lines_changed(source, made.path) if line.startswith("-")]
    assert len(removed) <= 3 * len(causes)


def test_an_mjcf_has_gains_springs_and_rotors(tmp_path: Path):
    source = written(tmp_path, MJCF, "arm.xml")
    robot = load_robot(source)
    causes = [GAIN, SPRING, *ROTORS]
    made = write_model(source, robot, causes, tmp_path / "new.xml")
    assert made.left_out == ()
    wanted = torque_of(robot, [c.as_effect() for c in causes])
    again = load_robot(made.path)
    np.testing.assert_allclose(torque_of(again), wanted, atol=1e-8)
    np.testing.assert_allclose(again.gear_ratio, robot.gear_ratio)
    assert '<general joint="shoulder" gear="50" gainprm="1.07"/>' in made.path.read_text()
    # Written once more, it is what was found last and not on top.
    other = write_model(
        made.path,
        again,
        [several("torque_constant", 1, relative_error=0.02)],
        tmp_path / "more.xml",
    )
    assert 'gainprm="1.02"/>' in other.path.read_text()


@pytest.mark.parametrize("unit", ["radian", "degree"])
@pytest.mark.parametrize("at_zero_nm", [0.0, 1.2])
def test_a_spring_rests_where_it_was_found_to(tmp_path: Path, unit: str, at_zero_nm: float):
    """It takes the place of the one in the file, whose rest is that of the file until then."""
    text = changed(MJCF, 'angle="radian"', f'angle="{unit}"')
    text = changed(text, "stiffness=", 'springref="0.4" stiffness=')
    source = written(tmp_path, text, "arm.xml")
    before, rest = load_robot(source), 0.4 if unit == "radian" else np.deg2rad(0.4)
    assert before.effects[0].values() == pytest.approx([3.0, 3.0 * rest])
    cause = several("cable_stiffness", 1, stiffness_nm_rad=4.0, at_zero_nm=at_zero_nm)
    made = write_model(source, before, [cause], tmp_path / "new.xml")
    assert load_robot(made.path).effects[0].values() == pytest.approx([4.0, at_zero_nm])


@pytest.mark.parametrize("unit", ["radian", "degree"])
@pytest.mark.parametrize("at_zero_n", [0.0, 1.2])
def test_a_spring_of_a_slide_rests_where_it_was_found_to(
    tmp_path: Path, unit: str, at_zero_n: float
):
    """In metres, whatever the file's unit of angles: MuJoCo's own passive force is that of the cause."""
    mujoco = pytest.importorskip("mujoco")
    text = changed(MJCF, 'angle="radian"', f'angle="{unit}"')
    text = changed(text, 'type="slide"', 'type="slide" stiffness="40" springref="0.05"')
    source = written(tmp_path, text, "arm.xml")
    before = load_robot(source)
    assert next(e for e in before.effects if e.axis == 3).values() == pytest.approx([40.0, 2.0])
    cause = several("cable_stiffness", 3, stiffness_nm_rad=60.0, at_zero_nm=at_zero_n)
    made = write_model(source, before, [cause], tmp_path / "new.xml")
    assert made.left_out == ()
    again = next(e for e in load_robot(made.path).effects if e.axis == 3)
    assert (again.name, again.values()) == ("cable_stiffness", pytest.approx([60.0, at_zero_n]))
    model = mujoco.MjModel.from_xml_path(str(made.path))
    data = mujoco.MjData(model)
    for place_m in (0.0, 0.05, 0.2):
        data.joint("slide").qpos = place_m
        mujoco.mj_forward(model, data)
        (force,) = data.joint("slide").qfrc_passive
        assert force == pytest.approx(at_zero_n - 60.0 * place_m, abs=1e-12)


DRIVE = [
    several("torque_saturation", 1, limit_nm=3.0),
    several("input_delay", 1, delay_s=0.007),
    several("actuator_bandwidth", 1, time_constant_s=0.004),
    GAIN,
]


def test_a_motor_of_an_mjcf_has_limits_delays_and_lags(tmp_path: Path):
    """MuJoCo makes of a command what the torque path of the effects does, and it is read again as such."""
    mujoco = pytest.importorskip("mujoco", minversion="4.0")
    source = written(tmp_path, MJCF, "arm.xml")
    made = write_model(source, load_robot(source), DRIVE, tmp_path / "new.xml")
    assert made.left_out == ()
    again = {e.name: e.values()[0] for e in load_robot(made.path).effects if e.axis == 1}
    for cause in DRIVE:
        (value,) = cause.parameters.values()
        assert again[cause.effect] == pytest.approx(value.value)
    model = mujoco.MjModel.from_xml_path(str(made.path))
    data = mujoco.MjData(model)
    step_s = model.opt.timestep
    # From rest: before a model begins, its history holds the first command.
    commands = np.repeat(np.r_[0.0, np.random.default_rng(3).normal(size=40) * 3.0], 5)
    forces = []
    for command in commands:
        data.ctrl[0] = command
        mujoco.mj_step(model, data)
        forces.append(data.actuator_force[0])
    # Late by three steps and a half; limited, which could as well be before; a lag from step to step; 1.07
    # times as much.
    before = np.concatenate([np.zeros(4), commands])
    late = np.clip(0.5 * (before[1:-3] + before[:-4]), -3.0, 3.0)
    keep, state, expected = np.exp(-step_s / 0.004), 0.0, []
    for value in late:
        expected.append(1.07 * state)
        state = keep * state + (1 - keep) * value
    np.testing.assert_allclose(forces, expected, atol=1e-9)
    # One at a time, a limit or a delay leaves a motor one.
    for cause, attributes in (
        (DRIVE[0], 'gear="50" ctrllimited="true" ctrlrange="-3 3"/>'),
        (DRIVE[1], 'gear="50" delay="0.007" nsample="5" interp="linear"/>'),
    ):
        alone = write_model(
            source, load_robot(source), [cause], tmp_path / "one.xml", overwrite=True
        )
        assert f'<motor joint="shoulder" {attributes}' in alone.path.read_text()


def test_a_lag_does_not_take_gains_of_defaults(tmp_path: Path):
    pytest.importorskip("mujoco")
    servos = '<default><general biastype="affine" gainprm="400" biasprm="0 -400 -20"/></default>'
    text = changed(MJCF, "  <worldbody>", f"  {servos}\n  <worldbody>")
    source = written(tmp_path, text, "arm.xml")
    made = write_model(source, load_robot(source), [DRIVE[2]], tmp_path / "new.xml")
    robot = load_robot(made.path)
    assert [e.name for e in robot.effects if e.axis == 1 and "torque" in e.name] == []
    assert [e.values()[0] for e in robot.effects if e.name == "actuator_bandwidth"] == [0.004]
    # Again, with another one.
    other = several("actuator_bandwidth", 1, time_constant_s=0.002)
    more = write_model(made.path, robot, [other], tmp_path / "more.xml")
    assert more.left_out == ()
    again = load_robot(more.path).effects
    assert [e.values()[0] for e in again if e.name == "actuator_bandwidth"] == [0.002]


def test_limits_that_are_no_torque_are_told(tmp_path: Path):
    pytest.importorskip("mujoco")
    one_way = changed(
        MJCF, 'gear="50"', 'gear="50" ctrllimited="true" ctrlrange="-1 3" forcerange="-9 8"'
    )
    robot = load_robot(written(tmp_path, one_way, "arm.xml"))
    assert [e.name for e in robot.effects if e.name == "torque_saturation"] == []
    for words in ("limits of its command left out", "limits of its force left out"):
        assert words in robot.toml


def test_a_motor_with_an_end_tag_becomes_general(tmp_path: Path):
    text = changed(
        MJCF, '<motor joint="shoulder" gear="50"/>', '<motor joint="shoulder" gear="50"> </motor>'
    )
    source = written(tmp_path, text, "arm.xml")
    made = write_model(source, load_robot(source), [GAIN], tmp_path / "new.xml")
    line = '<general joint="shoulder" gear="50" gainprm="1.07"> </general>'
    assert line in made.path.read_text()
    assert [e.label for e in load_robot(made.path).effects if e.name == GAIN.effect] == [GAIN.label]


def test_defaults_do_not_make_a_motor_a_servo(tmp_path: Path):
    """What a file has for all <general> does not reach the one that a <motor> becomes; a servo stays."""
    servos = '<default><general biastype="affine" gainprm="400" biasprm="0 -400 -20"/></default>'
    text = changed(MJCF, "  <worldbody>", f"  {servos}\n  <worldbody>")
    source = written(tmp_path, text, "arm.xml")
    made = write_model(source, load_robot(source), [GAIN], tmp_path / "new.xml")
    line = 'gear="50" gainprm="1.07" gaintype="fixed" biastype="none" dyntype="none"/>'
    assert line in made.path.read_text()
    again = load_robot(made.path)
    assert [e.label for e in again.effects if e.name == GAIN.effect] == [GAIN.label]
    assert write_model(made.path, again, [GAIN], tmp_path / "more.xml").left_out == ()
    source = written(tmp_path, changed(text, "<motor", "<general"), "servo.xml")
    made = write_model(source, load_robot(source), [GAIN], tmp_path / "other.xml")
    # It has gains itself.
    assert 'gainprm="428" biasprm="0 -428 -21.4"/>' in made.path.read_text()


def test_only_numbers_that_change_are_written(tmp_path: Path):
    source = written(tmp_path, MJCF, "arm.xml")
    made = write_model(source, load_robot(source), [HEAVIER], tmp_path / "new.xml")
    assert lines_changed(source, made.path) == [
        '-      <inertial pos="0.1 0 0.2" mass="4" fullinertia="0.2 0.3 0.25 0.01 0 -0.02"/>',
        "+      <!-- axisight: link_mass@1: relative_change = 0.2 (0.2 to 0.2), probability 0.90 -->",
        '+      <inertial pos="0.1 0 0.2" mass="4.8" fullinertia="0.2 0.3 0.25 0.01 0 -0.02"/>',
    ]


def test_a_body_of_shapes_gets_an_inertial(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    # MuJoCo writes a warning of the option below beside what runs.
    monkeypatch.chdir(tmp_path)
    shapes = changed(
        MJCF,
        '<inertial pos="0.1 0 0.2" mass="4" fullinertia="0.2 0.3 0.25 0.01 0 -0.02"/>',
        '<geom type="capsule" fromto="0 0 0 0.5 0 0.1" size="0.05"/>',
    )
    source = written(tmp_path, shapes, "arm.xml")
    robot = load_robot(source)
    made = write_model(source, robot, [HEAVIER], tmp_path / "new.xml")
    np.testing.assert_allclose(
        torque_of(load_robot(made.path)), torque_of(robot, [HEAVIER.as_effect()]), atol=1e-7
    )
    assert "in place of its geoms" in made.path.read_text()
    own = written(
        tmp_path, changed(shapes, 'angle="radian"', 'angle="radian" settotalmass="9"'), "b.xml"
    )
    made = write_model(own, load_robot(own), [HEAVIER], tmp_path / "c.xml")
    assert made.why == {"link_mass@1": "the compiler option settotalmass makes masses of its own"}


def test_a_body_of_another_file_stays(tmp_path: Path):
    inner = MJCF[MJCF.index('      <body name="lower"') : MJCF.index("    </body>\n  </worldbody>")]
    written(tmp_path, f"<mujoco>{inner}</mujoco>", "lower.xml")
    source = written(tmp_path, changed(MJCF, inner, '<include file="lower.xml"/>'), "arm.xml")
    made = write_model(source, load_robot(source), [HEAVIER, LOAD], tmp_path / "new.xml")
    assert made.placed == ("link_mass@1",)
    assert made.why == {"payload": "'lower' stands in another file or has no name"}


def test_what_has_no_place_is_told_why(tmp_path: Path):
    source = written(tmp_path, MJCF, "arm.xml")
    robot = load_robot(source)
    ripple = several("torque_ripple", 1, order_1=6.0, cosine_1_nm=0.1)
    loaded = several("load_dependent_friction", 1, coefficient=0.1)
    lighter = several("viscous_friction", 1, viscous_nm_s_rad=-1.0)
    thinner = several("link_inertia", 2, relative_change=-0.9)
    servo = several("torque_constant", 2, relative_error=0.1)
    causes = [PLAY, loaded, lighter, thinner, servo]
    made = write_model(source, robot, causes, tmp_path / "new.xml")
    assert made.placed == ()
    assert made.path.read_bytes() == source.read_bytes()
    assert [effect.label for effect in made.remaining] == [c.label for c in causes]
    assert made.why == {
        "backlash@1": "MJCF has no number for it: --play-joints, or play_joints=True, writes a joint with a range, "
        "axisight.mujoco.apply adds it to a joint that is the gear's spring",
        "load_dependent_friction@1": "MJCF has no number for it: axisight.mujoco.apply adds it at every step",
        "viscous_friction@1": "damping would be -2499, and models have none below zero",
        "link_inertia@2": "'lower' has no mass of its own",
        "torque_constant@2": "expected one motor of the joint that has a gain, got none",
    }
    pull = [several("cable_stiffness", 1, stiffness_nm_rad=0.0, at_zero_nm=1.0)]
    made = write_model(source, robot, pull, tmp_path / "o.xml")
    assert made.why == {"cable_stiffness@1": "without stiffness a spring rests nowhere"}
    made = write_model(source, load_robot("scara_like"), [LOAD], tmp_path / "s.xml")
    assert made.why == {"payload": "the robot is not the chain that the file says"}
    urdf = written(tmp_path, URDF)
    made = write_model(urdf, load_robot(urdf), [thinner, ripple], tmp_path / "new.urdf")
    assert made.why == {
        "link_inertia@2": "the inertia that 'lower' would have is that of no body",
        "torque_ripple@1": "URDF has no number for it",
    }


def test_a_remainder_has_no_place_in_other_formats(tmp_path: Path):
    none = np.zeros(2)
    modelled = ModelledRemainder(
        model=Remainder((), none, none),
        gap_before=0.2,
        gap_after=0.1,
        before_per_axis=none,
        after_per_axis=none,
        moving_before=0.2,
        moving_after=0.1,
    )
    for name, text, word in (("arm.xml", MJCF, "apply_remainder"), ("arm.urdf", URDF, "URDF")):
        source = written(tmp_path, text, name)
        robot, target = load_robot(source), tmp_path / f"new_{name}"
        made = write_model(source, robot, [], target, remainder=modelled)
        assert made.left_out == ("remainder",)
        assert word in made.why["remainder"]
        assert target.read_bytes() == source.read_bytes()


def test_misuse_is_named(tmp_path: Path):
    source = written(tmp_path, URDF)
    robot = load_robot(source)
    with pytest.raises(InputError, match=r"expected \.urdf as the model.*'\.xml'"):
        write_model(source, robot, [DRY], tmp_path / "new.xml")
    with pytest.raises(InputError, match="exists"):
        write_model(source, robot, [DRY], source)
    with pytest.raises(InputError, match=r"expected \.toml as the model"):
        write_model("irb6600_like", robot, [DRY], tmp_path / "new.urdf")
    with pytest.raises(InputError, match=r"got '\.csv'"):
        write_model("arm.csv", robot, [DRY], tmp_path / "new.csv")
