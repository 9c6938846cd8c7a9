"""Causes written into models: the numbers that change, and not a byte beside them."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest

from axisight import Effect, Robot, load_robot
from axisight.cli.diagnose import _write_model
from axisight.errors import InputError
from axisight.gap.result import Cause, Interval
from axisight.gap.rigid_torque import predicted_torque
from axisight.gap.torques import Variant
from axisight.robot_file import load_identified
from axisight.write_back import write_model
from import_data import MJCF, URDF, changed, written
from servo_arm import NOMINAL

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


def several(effect: str, axis: int | None, **values: float) -> Cause:
    parameters = {name: Interval(value, value, value) for name, value in values.items()}
    return Cause(effect, axis, 0.9, parameters, {}, Interval(50.0, 40.0, 60.0))


HEAVIER = several("link_mass", 1, relative_change=0.2)
ASIDE = several("link_com", 2, x_m=0.02, y_m=-0.01, z_m=0.03)
LOAD = several("payload", None, mass_kg=1.5, x_m=0.1, y_m=0.05, z_m=-0.2)
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
    return predicted_torque(robot, Variant({}, tuple(effects)), tuple(motion))


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


def test_an_actuator_that_is_told_positions_has_gains_and_late_targets(tmp_path: Path):
    """MuJoCo reads them as the law that the effects make of the stated one, and they are read again."""
    mujoco = pytest.importorskip("mujoco", minversion="4.0")
    source = written(tmp_path, NOMINAL.mjcf(), "servo.xml")
    causes = [
        several("controller_gain", 1, relative_proportional=0.25, relative_integral=-0.1),
        several("torque_constant", 2, relative_error=-0.2),
        several("input_delay", 3, delay_s=0.0101),
        several("torque_saturation", 3, limit_nm=30.0),
    ]
    made = write_model(source, load_robot(source), causes, tmp_path / "new.xml")
    assert made.left_out == ()
    model = mujoco.MjModel.from_xml_path(str(made.path))
    kp, kd = np.array(NOMINAL.kp), np.array(NOMINAL.kd)
    kp[0], kd[0] = 1.25 * kp[0], 0.9 * kd[0]
    kp[1], kd[1] = 0.8 * kp[1], 0.8 * kd[1]
    np.testing.assert_allclose(model.actuator_gainprm[:, 0], kp)
    np.testing.assert_allclose(model.actuator_biasprm[:, 1:3], -np.transpose([kp, kd]))
    np.testing.assert_allclose(model.actuator_delay, [0.0, 0.0, 0.0101])
    again = load_robot(made.path)
    assert {e.label: e.values() for e in again.effects} == {
        "torque_saturation@3": [30.0],
        "input_delay@3": pytest.approx([0.0101]),
    }
    gains = load_robot(source).controller_gains
    for key, factors in (("kp", [1.25, 0.8, 1.0]), ("kd", [0.9, 0.8, 1.0])):
        np.testing.assert_allclose(again.controller_gains[key], gains[key] * np.array(factors))


OTHER = several("controller_gain", 1, relative_proportional=0.25, relative_integral=-0.5)
LIGHTER = Interval(-0.1, -0.2, 0.0)
# Defaults of a file, and the first of its actuators.
SERVOS = {
    "own gains": ("", '<position joint="j1" kp="900" kv="50"/>'),
    "gains of defaults": (
        '<default><position kp="1500" kv="40"/></default>',
        '<position joint="j1"/>',
    ),
    "damping ratio": ("", '<position joint="j1" kp="900" dampratio="0.9"/>'),
    "summed up": ("", '<intvelocity joint="j1" kp="900" kv="50" actrange="-3 3"/>'),
    "general": ("", '<general joint="j1" biastype="affine" gainprm="900" biasprm="0 -900 -50"/>'),
    "general of defaults": (
        '<default><default class="a"><general biastype="affine" gainprm="900" biasprm="0 -900 -50"/></default>'
        "</default>",
        '<general class="a" joint="j1"/>',
    ),
}


@pytest.mark.parametrize("actuator", SERVOS)
def test_gains_of_actuators_are_written_wherever_they_stand(tmp_path: Path, actuator: str):
    """MuJoCo has them times what was found; those of its defaults and of its damping ratios too."""
    mujoco = pytest.importorskip("mujoco")
    defaults, own = SERVOS[actuator]
    text = changed(
        NOMINAL.mjcf(), f'<position joint="j1" kp="{NOMINAL.kp[0]}" kv="{NOMINAL.kd[0]}"/>', own
    )
    source = written(tmp_path, changed(text, "<worldbody>", f"{defaults}<worldbody>"), "servo.xml")
    before, after = (
        mujoco.MjModel.from_xml_path(str(path))
        for path in (
            source,
            write_model(source, load_robot(source), [OTHER], tmp_path / "new.xml").path,
        )
    )
    assert after.actuator_gainprm[0, 0] == pytest.approx(1.25 * before.actuator_gainprm[0, 0])
    kp, kv = before.actuator_biasprm[0, 1:3]
    assert after.actuator_biasprm[0, :3] == pytest.approx([0.0, 1.25 * kp, 0.5 * kv])
    np.testing.assert_array_equal(after.actuator_biasprm[1:], before.actuator_biasprm[1:])
    # Fitted gains are written as those of causes are.
    refit = {
        "j1.kp": Interval(0.25, 0.2, 0.3),
        "j1.kd": Interval(-0.5, -0.6, -0.4),
        "j1.mass": LIGHTER,
    }
    made = write_model(source, load_robot(source), [], tmp_path / "fit.xml", refit=refit)
    assert (made.placed, made.left_out) == (("j1.kp", "j1.kd"), ())
    fitted = mujoco.MjModel.from_xml_path(str(made.path))
    np.testing.assert_allclose(fitted.actuator_biasprm, after.actuator_biasprm)
    assert (
        "<!-- axisight: j1.kp: 1.25 (1.2 to 1.3) times the stated gain, re-fitted; j1.kd: 0.5 (0.4 to 0.6) times the "
        "stated gain, re-fitted -->"
    ) in made.path.read_text()
    assert fitted.body_mass.tolist() == before.body_mass.tolist()


def test_gains_that_no_file_has_are_told(tmp_path: Path):
    refit = {"j1.kp": Interval(0.25, 0.2, 0.3)}
    ratio = changed(
        NOMINAL.mjcf(), "<worldbody>", '<default><position dampratio="1"/></default><worldbody>'
    )
    for kd in NOMINAL.kd:
        ratio = changed(ratio, f' kv="{kd}"', "")
    source = written(tmp_path, ratio, "servo.xml")
    made = write_model(source, load_robot(source), [], tmp_path / "new.xml", refit=refit)
    assert made.why == {"j1.kp": "expected kv of the <position> instead of a dampratio in defaults"}
    assert made.left_out == ("j1.kp",)
    source = written(tmp_path, NOMINAL.mjcf(), "arm.xml")
    written(
        tmp_path,
        '[controller]\nkind = "pd_position"\nkp = [9.0, 9.0, 9.0]\nkd = [1.0, 1.0, 1.0]\n',
        "arm.drives.toml",
    )
    made = write_model(source, load_robot(source), [], tmp_path / "other.xml", refit=refit)
    assert made.why == {
        "j1.kp": "the controller stands in the drive data, the file has no gains of it"
    }
    assert made.path.read_bytes() == source.read_bytes()


def test_a_robot_file_gets_the_gains(tmp_path: Path):
    """Of the controller, with comments and, beside it, their standard errors; all else stays."""
    source = written(tmp_path, NOMINAL.mjcf(), "servo.xml")
    robot = load_robot(source)
    refit = {"j2.kp": Interval(0.5, 0.402, 0.598), "j3.kd": Interval(-0.2, -0.3, -0.1)}
    made = write_model(source, robot, [], tmp_path / "new.toml", refit=refit)
    assert made.placed == ("j2.kp", "j3.kd")
    again = load_robot(made.path)
    for key, value in (("kp", [1800.0, 2700.0, 500.0]), ("kd", [120.0, 110.0, 20.0])):
        np.testing.assert_allclose(again.controller_gains[key], value)
    assert again.parameters() == robot.parameters()
    back = load_identified(made.path)
    assert dict(zip(back.names, back.standard_errors, strict=True)) == {
        "j2.kp": pytest.approx(1800 * 0.05),
        "j3.kd": pytest.approx(25 * 0.2 / 3.92),
    }
    assert (
        "# identified: j2.kp = 2700 Nm/rad, standard error 90 (3.3 %), before 1800"
        in made.path.read_text()
    )


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
    lighter = several("viscous_friction", 1, viscous_nm_s_rad=-1.0)
    thinner = several("link_inertia", 2, relative_change=-0.9)
    servo = several("torque_constant", 2, relative_error=0.1)
    causes = [PLAY, ripple, lighter, thinner, servo]
    made = write_model(source, robot, causes, tmp_path / "new.xml")
    assert made.placed == ()
    assert made.path.read_bytes() == source.read_bytes()
    assert [effect.label for effect in made.remaining] == [c.label for c in causes]
    assert made.why == {
        "backlash@1": "MJCF has no number for it: axisight.mujoco.apply adds it to a joint that is the gear's spring",
        "torque_ripple@1": "MJCF has no number for it: axisight.mujoco.apply adds it at every step",
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


def test_fitted_gains_alone_are_a_model(tmp_path: Path):
    """Where no cause was named there is something to write all the same."""
    source = written(tmp_path, NOMINAL.mjcf(), "servo.xml")
    inputs: Any = SimpleNamespace(robot=load_robot(source), robot_source=source)
    options: Any = SimpleNamespace(given=lambda: False)
    for refit, there in (({"j1.mass": LIGHTER}, False), ({"j1.kp": LIGHTER}, True)):
        found: Any = SimpleNamespace(causes=(), refit=refit)
        _write_model(found, inputs, options, tmp_path / "new.xml", force=False)
        assert (tmp_path / "new.xml").exists() == there
