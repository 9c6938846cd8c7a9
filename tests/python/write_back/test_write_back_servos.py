"""Causes and re-fitted gains written into actuators that have targets: MuJoCo says what they do then."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from axisight import load_robot
from axisight.cli.outcomes import write_found_model
from axisight.gap.facts.result import Interval
from axisight.robot_file import load_identified
from axisight.write_back import write_model
from found_causes import several
from import_data import changed, written
from servo_arm import NOMINAL


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


CONTROLLER = """[controller]
kind = "pd_position"
kp = [9.0, 9.0, 9.0]
kd = [1.0, 1.0, 1.0]
"""


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
    written(tmp_path, CONTROLLER, "arm.drives.toml")
    made = write_model(source, load_robot(source), [OTHER], tmp_path / "other.xml", refit=refit)
    reason = "the controller stands in the drive data, the file has no gains of it"
    assert made.why == {"j1.kp": reason, OTHER.label: reason}
    assert made.path.read_bytes() == source.read_bytes()


@pytest.mark.parametrize("of_defaults", [False, True])
def test_a_servo_with_a_filter_has_a_delay_and_a_limit_but_no_gains(
    tmp_path: Path, of_defaults: bool
):
    """It is no law of a controller, which the drive data say then; what stands before and behind it is written."""
    mujoco = pytest.importorskip("mujoco", minversion="4.0")
    text, own = NOMINAL.mjcf(), '<position joint="j1"'
    if of_defaults:
        defaults = '<default><position timeconst="0.01"/></default>'
        text = changed(text, "<worldbody>", f"{defaults}<worldbody>")
    else:
        text = changed(text, own, f'{own} timeconst="0.01"')
    source = written(tmp_path, text, "arm.xml")
    written(tmp_path, CONTROLLER, "arm.drives.toml")
    weaker = several("torque_constant", 1, relative_error=-0.2)
    late = several("input_delay", 1, delay_s=0.0101)
    limit = several("torque_saturation", 1, limit_nm=30.0)
    made = write_model(source, load_robot(source), [weaker, late, limit], tmp_path / "new.xml")
    assert made.placed == (late.label, limit.label)
    assert made.why == {weaker.label: "<position> is no plain servo (timeconst)"}
    before, after = (mujoco.MjModel.from_xml_path(str(path)) for path in (source, made.path))
    np.testing.assert_array_equal(after.actuator_biasprm, before.actuator_biasprm)
    assert after.actuator_delay[0] == pytest.approx(0.0101)
    assert after.actuator_forcerange[0].tolist() == [-30.0, 30.0]


def test_an_axis_that_the_file_does_not_have_is_told(tmp_path: Path):
    """The robot of another file has other names of axes: nothing of the file is its drive."""
    pytest.importorskip("mujoco")
    renamed = written(tmp_path, NOMINAL.mjcf().replace('"j1"', '"waist"'), "renamed.xml")
    source = written(tmp_path, NOMINAL.mjcf(), "arm.xml")
    weaker = several("torque_constant", 1, relative_error=-0.2)
    refit = {"waist.kp": Interval(0.25, 0.2, 0.3)}
    made = write_model(source, load_robot(renamed), [weaker], tmp_path / "new.xml", refit=refit)
    reason = "the file has no driven joint of this name"
    assert made.why == {weaker.label: reason, "waist.kp": reason}
    assert made.path.read_bytes() == source.read_bytes()


@pytest.mark.parametrize(
    "actuator",
    [
        '<intvelocity joint="j1" kp="900" kv="50" actrange="-3 3"/>',
        '<general joint="j1" dyntype="integrator" biastype="affine" gainprm="900" biasprm="0 -900 -50" '
        'actlimited="true" actrange="-3 3"/>',
    ],
)
def test_a_target_that_is_summed_up_has_no_delay(tmp_path: Path, actuator: str):
    """A delay of the actuator is one of the speeds, before they are summed up; whatever its tag is."""
    pytest.importorskip("mujoco")
    own = f'<position joint="j1" kp="{NOMINAL.kp[0]}" kv="{NOMINAL.kd[0]}"/>'
    source = written(tmp_path, changed(NOMINAL.mjcf(), own, actuator), "arm.xml")
    late = [several("input_delay", axis, delay_s=0.0101) for axis in (1, 2)]
    made = write_model(source, load_robot(source), [*late, OTHER], tmp_path / "new.xml")
    assert made.placed == (late[1].label, OTHER.label)
    tag = actuator.split(maxsplit=1)[0]
    assert made.why == {
        late[
            0
        ].label: f"expected a servo that is told positions, {tag}> delays speeds before it sums them up"
    }


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


def test_fitted_gains_alone_are_a_model(tmp_path: Path):
    """Where no cause was named there is something to write all the same."""
    source = written(tmp_path, NOMINAL.mjcf(), "servo.xml")
    inputs: Any = SimpleNamespace(robot=load_robot(source), robot_source=source)
    options: Any = SimpleNamespace(given=lambda: False)
    for refit, there in (({"j1.mass": LIGHTER}, False), ({"j1.kp": LIGHTER}, True)):
        found: Any = SimpleNamespace(causes=(), refit=refit, remainder=None)
        write_found_model(found, inputs, options, tmp_path / "new.xml", force=False)
        assert (tmp_path / "new.xml").exists() == there
