"""Broken model files: each is refused by file, line and element, and none reads anything else."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from axisight.errors import RobotError
from axisight.robot import load_robot
from axisight.robot_import import import_robot
from import_data import DH, MJCF, URDF, changed, dh_toml, written

UPPER = '<mass value="4"/>'
ELBOW = '<joint name="elbow" type="continuous">'
INERTIA = '<inertia ixx="0.2" ixy="0.01" ixz="0" iyy="0.3" iyz="-0.02" izz="0.25"/>'
LOWER_INERTIAL = """    <inertial>
      <mass value="2"/>
      <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.025"/>
    </inertial>
"""
FLANGE_INERTIAL = """    <inertial>
      <origin xyz="0 0 0.05"/>
      <mass value="0.5"/>
      <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/>
    </inertial>
"""
BARE = changed(changed(URDF, LOWER_INERTIAL, ""), FLANGE_INERTIAL, "")
EXTRA_LINK = '<link name="x"/><joint name="j" type="{}"><parent link="{}"/><child link="{}"/></joint></robot>'

LOOP = '<joint name="j" type="fixed"><parent link="lower"/><child link="base"/></joint></robot>'


def urdf(old: str, new: str) -> str:
    return changed(URDF, old, new)


def more(kind: str, parent: str, child: str) -> str:
    return urdf("</robot>", EXTRA_LINK.format(kind, parent, child))


# What is broken: the text, what import_robot is told, and what the message says, with its line.
BROKEN_URDF = {
    "no inertial": (BARE, {}, r"line \d+, <joint 'elbow'>.*mass.*'lower'"),
    "no mass": (urdf(UPPER, ""), {}, r"line 5, <inertial>: expected <mass>, got none"),
    "no inertia": (urdf(INERTIA, ""), {}, r"line 5, <inertial>: expected <inertia>, got none"),
    "zero mass": (urdf(UPPER, '<mass value="0"/>'), {}, r"line 24, <joint 'shoulder'>.*mass"),
    "negative mass": (urdf(UPPER, '<mass value="-4"/>'), {}, r"line 7, <mass>: value.*-4 kg"),
    "mass is a word": (urdf(UPPER, '<mass value="4kg"/>'), {}, r"line 7, <mass>.*'4kg'"),
    "mass without value": (urdf(UPPER, "<mass/>"), {}, r"line 7, <mass>: expected value"),
    "negative inertia": (urdf('ixx="0.2"', 'ixx="-0.2"'), {}, r"line 8, <inertia>: ixx.*-0.2"),
    "inertia not definite": (urdf('ixy="0.01"', 'ixy="0.6"'), {}, r"<joint 'shoulder'>.*principal"),
    "no moment of inertia": (urdf('ixx="0.2" ', ""), {}, r"line 8, <inertia>: expected ixx"),
    "closed loop": (
        more("revolute", "lower", "upper"),
        {},
        r"<joint 'j'>.*closed loop.*'shoulder'",
    ),
    "loop without root": (
        urdf("</robot>", LOOP),
        {},
        r"expected one link that no joint moves, got none",
    ),
    "circle beside": (
        urdf(
            "</robot>",
            '<link name="x"/><link name="y"/>'
            '<joint name="a" type="fixed"><parent link="x"/><child link="y"/></joint>'
            '<joint name="b" type="fixed"><parent link="y"/><child link="x"/></joint></robot>',
        ),
        {},
        r"<joint '.'>: expected a tree, got a closed loop of x, y",
    ),
    "two roots": (urdf("</robot>", '<link name="x"/></robot>'), {}, r"got 2: base, x"),
    "unknown tip": (
        URDF,
        {"tip": "hand"},
        r"line 3, <link 'base'>: --tip: expected a link.*base, upper, lower, flange, got 'hand'",
    ),
    "unknown base": (URDF, {"base": "floor"}, r"line 3, <link 'base'>: --base.*got 'floor'"),
    "base beyond the tip": (
        URDF,
        {"base": "flange", "tip": "upper"},
        r"line 38, <joint 'mount'>: --base.*got 'flange'",
    ),
    "nothing between": (
        URDF,
        {"tip": "base"},
        r"line 3, <link 'base'>: expected at least one revolute",
    ),
    "unknown parent": (
        urdf('<parent link="upper"/>', '<parent link="arm"/>'),
        {},
        r"<parent>.*'arm'",
    ),
    "no child": (urdf('<child link="lower"/>', ""), {}, r"<joint 'elbow'>: expected <child"),
    "joint without name": (urdf(ELBOW, ELBOW.replace('name="elbow" ', "")), {}, r"<joint>.*name"),
    "joint named twice": (urdf(ELBOW, ELBOW.replace("elbow", "mount")), {}, r"no other joint has"),
    "link named twice": (
        urdf('<link name="base"/>', '<link name="upper"/>'),
        {},
        r"no other link has",
    ),
    "joint without type": (
        urdf(ELBOW, '<joint name="elbow">'),
        {},
        r"<joint 'elbow'>: expected type",
    ),
    "unknown type": (
        urdf(ELBOW, '<joint name="elbow" type="ball">'),
        {},
        r"<joint 'elbow'>.*'ball'",
    ),
    "floating": (urdf(ELBOW, '<joint name="elbow" type="floating">'), {}, r"got type 'floating'"),
    "planar": (urdf(ELBOW, '<joint name="elbow" type="planar">'), {}, r"got type 'planar'"),
    "mimic": (urdf(ELBOW, ELBOW + '<mimic joint="shoulder"/>'), {}, r"mimics 'shoulder'"),
    "branches": (
        more("continuous", "upper", "x"),
        {},
        r"line 24, <joint 'shoulder'>: .*2 moving branches",
    ),
    "axis without length": (urdf('xyz="0 1 1"', 'xyz="0 0 0"'), {}, r"line 28, <axis>: xyz"),
    "axis of two numbers": (
        urdf('xyz="0 1 1"', 'xyz="0 1"'),
        {},
        r"<axis>: xyz: expected 3 numbers",
    ),
    "axis that is no number": (urdf('xyz="0 1 1"', 'xyz="0 nan 1"'), {}, r"<axis>: xyz.*'0 nan 1'"),
    "axis twice": (
        urdf('<axis xyz="0 1 1"/>', '<axis xyz="0 1 1"/><axis xyz="0 0 1"/>'),
        {},
        r"at most one <axis>",
    ),
    "infinite turn": (urdf('rpy="0 1.2 0"', 'rpy="0 inf 0"'), {}, r"<origin>: rpy"),
    "limits swapped": (urdf('lower="-2"', 'lower="3"'), {}, r"<limit>: expected lower <= upper"),
    "negative damping": (urdf('damping="0.7"', 'damping="-1"'), {}, r"<dynamics>: damping"),
    "no reduction": (urdf("50</", "0</"), {}, r"<mechanicalReduction>.*got '0'"),
    "no reduction of ros2_control": (
        urdf(
            "</robot>",
            '<ros2_control name="c"><transmission name="t"><joint name="elbow"><mechanical_reduction>'
            "many</mechanical_reduction></joint></transmission></ros2_control></robot>",
        ),
        {},
        r"line 47, <mechanical_reduction>.*got 'many'",
    ),
    "no links": ("<robot name='x'/>", {}, r"line 1, <robot 'x'>: expected at least one <link>"),
    "another root": ("<sdf version='1.6'/>", {}, r"<sdf>: expected <robot> \(URDF\) or <mujoco>"),
    "xacro not run": (
        urdf("</robot>", '<xacro:arm xmlns:xacro="http://x"/></robot>'),
        {},
        r"<xacro:arm>.*run `xacro arm.urdf > robot.urdf` first",
    ),
    "cut off": (URDF[:700], {}, r"line 25, within <joint 'shoulder'>: expected XML"),
    "empty": ("", {}, r"line 1: expected XML, got no element found"),
    "no text": (b"\x00\x01\x02<robot>", {}, r"expected XML"),
    "nested without end": ("<robot>" + "<a>" * 300, {}, r"at most 200 elements in one another"),
}
ENTITIES = """<?xml version="1.0"?>
<!DOCTYPE robot [{}]>
<robot name="&x;"><link name="base"/></robot>
"""
BROKEN_ENTITIES = {
    "entity from a file": ENTITIES.format('<!ENTITY x SYSTEM "{secret}">'),
    "entities of entities": ENTITIES.format('<!ENTITY a "ha"><!ENTITY x "&a;&a;&a;&a;&a;">'),
    "definition elsewhere": '<!DOCTYPE robot SYSTEM "{secret}"><robot name="x"/>',
}
FLANGE = '<body name="flange" pos="0.3 0.1 0" euler="0 0 1">'
BODY = '<body name="upper" pos="0 0 0.4" euler="0.3 0.1 -0.2">'


def mjcf(old: str, new: str) -> str:
    return changed(MJCF, old, new)


def asset(line: str) -> str:
    return mjcf("<worldbody>", f"<asset>{line}</asset>\n<worldbody>")


BROKEN_MJCF = {
    "include above": (
        mjcf("<worldbody>", '<include file="../x.xml"/><worldbody>'),
        r"<include>.*inside",
    ),
    "include by root": (
        mjcf("<worldbody>", '<include file="/etc/x.xml"/><worldbody>'),
        r"<include>.*inside",
    ),
    "include itself": (
        mjcf("<worldbody>", '<include file="arm.xml"/><worldbody>'),
        r"includes itself",
    ),
    "include nothing": (
        mjcf("<worldbody>", '<include file="x.xml"/><worldbody>'),
        r"expected a file, got 'x.xml'",
    ),
    "mesh above": (
        asset('<mesh name="m" file="../../m.stl"/>'),
        r"line 3, <mesh 'm'>: file.*inside",
    ),
    "mesh by root": (asset('<mesh name="m" file="/tmp/m.stl"/>'), r"<mesh 'm'>: file.*inside"),
    "texture above": (
        asset('<texture type="cube" fileup="../t.png"/>'),
        r"<texture>: fileup.*inside",
    ),
    "folder of meshes above": (
        mjcf('angle="radian"', 'angle="radian" meshdir="../meshes"'),
        r"line 2, <compiler>: meshdir.*inside",
    ),
    "mesh above by its folder": (
        changed(asset('<mesh name="m" file="../../m.stl"/>'), 'angle="radian"', 'meshdir="a"'),
        r"<mesh 'm'>: file.*inside",
    ),
    "unknown element": (mjcf("<worldbody>", "<wrld/><worldbody>"), r"MuJoCo:.*wrld"),
    "negative mass": (mjcf('mass="4"', 'mass="-4"'), r"MuJoCo:.*mass"),
    "no inertia": (
        mjcf('mass="4" fullinertia="0.2 0.3 0.25 0.01 0 -0.02"', 'mass="4"'),
        r"MuJoCo:",
    ),
    "moving body without mass": (
        mjcf(FLANGE, '<body name="w"><joint name="wrist"/></body>' + FLANGE),
        r"MuJoCo: Error: mass and inertia of moving bodies.*line 12",
    ),
    "ball joint": (
        mjcf('<joint name="elbow" axis="0 0 -1"/>', '<joint name="elbow" type="ball"/>').replace(
            '<joint name="slide" type="slide" axis="1 0 0" pos="0 0.1 0"/>', ""
        ),
        r"<joint 'elbow'>.*ball or free",
    ),
    "mimic": (
        mjcf(
            "</actuator>",
            '</actuator><equality><joint joint1="elbow" joint2="shoulder"/></equality>',
        ),
        r"line 9, <joint 'elbow'>: .*mimics 'shoulder': cut it by --tip",
    ),
    "free base": (
        mjcf(BODY, BODY + "<freejoint/>")
        .replace(
            '<joint name="shoulder" axis="0 1 1" pos="0.02 0 0.01" ref="0.3" damping="0.7"\n'
            '             frictionloss="1.5" armature="0.2" stiffness="3"/>',
            "",
        )
        .replace('<actuator><motor joint="shoulder" gear="50"/></actuator>', ""),
        r"line 4, <freejoint>: .*ball or free",
    ),
    "axis without length": (
        mjcf('axis="0 1 1"', 'axis="0 0 0"'),
        r"MuJoCo: .*axis too small.*'shoulder'.*line 5",
    ),
    "turn of no length": (
        mjcf('euler="0 1.2 0"', 'quat="0 0 0 0"'),
        r"MuJoCo: .*zero quaternion.*'body', line 8",
    ),
    "axes that span no frame": (
        mjcf('euler="0 1.2 0"', 'xyaxes="1 0 0 1 0 0"'),
        r"MuJoCo: .*yaxis too small.*'lower'.*line 8",
    ),
    "inertia not definite": (
        mjcf("0.25 0.01 0 -0.02", "0.25 0.6 0 -0.02"),
        r"MuJoCo: .*positive eigenvalues.*'upper'.*line 4",
    ),
    "inertia of no body": (
        mjcf("0.02 0.03 0.025", "0.02 0.03 0.5"),
        r"MuJoCo: .*A \+ B >= C.*'lower'.*line 8",
    ),
    "entities": ('<!DOCTYPE m [<!ENTITY a "b">]>' + MJCF, r"line 1: expected no document type"),
}
BROKEN_DH = {
    "unknown column below a remark": (
        "# of the maker\n" + changed(DH, "theta_rad", "theta"),
        r"line 2: .*unknown theta",
    ),
    "no number below a remark": (
        "# of the maker\n" + changed(DH, "-0.2,0.05", "-0.2,far"),
        r"line 4, joint 'two': d_m.*'far'",
    ),
    "unknown column": (changed(DH, "theta_rad", "theta"), r"line 1: .*unknown theta"),
    "no column": (changed(DH, ",mass_kg", ",ixz"), r"line 1: .*no mass_kg"),
    "another convention": (
        DH.replace("two,standard", "two,craig"),
        r"line 3, joint 'two': convention",
    ),
    "no number": (changed(DH, "-0.2,0.05", "-0.2,far"), r"line 3, joint 'two': d_m.*'far'"),
    "zero mass": (changed(DH, "0.3,2,", "0.3,0,"), r"line 3, joint 'two': mass_kg"),
    "joint twice": (
        changed(DH, "two,", "one,"),
        r"line 3: joint: expected a name no other row has",
    ),
    "sliding sideways": (
        DH.replace("convention,", "convention,motion,").replace("standard,", "standard,screw,"),
        r"line 2, joint 'one': motion",
    ),
}
TABLE = dh_toml()
BROKEN_DH_TOML = {
    "no TOML": ("convention standard\n", r"arm.toml: expected TOML"),
    "unknown key": (
        changed(TABLE, "theta_rad = -0.2", "theta = -0.2"),
        r"\[\[joint\]\] 2, joint 'two': expected the keys .*unknown theta",
    ),
    "no key": (changed(TABLE, "d_m = 0.05\n", ""), r"joint 'two': expected the keys .*got no d_m"),
    "no name": (changed(TABLE, 'joint = "two"\n', ""), r"\[\[joint\]\] 2, .*got no joint"),
    "a name that is none": (
        changed(TABLE, 'joint = "two"', "joint = 2"),
        r"\[\[joint\]\] 2: joint: expected a word, got 2",
    ),
    "unknown key of the file": ("units = 1\n" + TABLE, r"arm.toml: expected the keys .*'units'"),
    "another convention": (
        changed(TABLE, '"standard"', '"craig"'),
        r"arm.toml: convention: expected standard or modified, got 'craig'",
    ),
    "no convention": (
        changed(TABLE, 'convention = "standard"\n', ""),
        r"convention: expected standard or modified",
    ),
    "convention of a row": (
        changed(TABLE, 'joint = "two"', 'joint = "two"\nconvention = "modified"'),
        r"joint 'two': expected the keys .*unknown convention",
    ),
    "a text for a number": (
        changed(TABLE, "d_m = 0.05", 'd_m = "0.05"'),
        r"joint 'two': d_m: expected a number, got '0.05'",
    ),
    "a truth for a number": (changed(TABLE, "d_m = 0.05", "d_m = true"), r"joint 'two': d_m: "),
    "no finite number": (changed(TABLE, "d_m = 0.05", "d_m = inf"), r"joint 'two': d_m: .*'inf'"),
    "zero mass": (
        changed(TABLE, "mass_kg = 2", "mass_kg = 0"),
        r"joint 'two': mass_kg: .*positive",
    ),
    "joint twice": (
        changed(TABLE, '"two"', '"one"'),
        r"\[\[joint\]\] 2: joint: expected a name no other row has, got 'one'",
    ),
    "sliding sideways": (
        changed(TABLE, 'joint = "two"', 'joint = "two"\nmotion = "screw"'),
        r"joint 'two': motion: expected revolute or prismatic",
    ),
    "no joints": ('convention = "standard"\n', r"arm.toml: joint: expected tables \[\[joint\]\]"),
    "joints that are none": (
        'convention = "standard"\njoint = [1]\n',
        r"arm.toml: joint: expected tables",
    ),
}
BROKEN_DRIVES = {
    "unknown key": ("gear = 3\n", r"my.toml: gear"),
    "no TOML": ("gear 3\n", r"my.toml: expected TOML"),
    "unknown joint": (
        "[joint.wrist]\nmotor_inertia = 1.0\n",
        r"joint.wrist: expected one of shoulder",
    ),
    "negative rotor": ("[joint.elbow]\nmotor_inertia = -1.0\n", r"joint.elbow.motor_inertia"),
    "no gear": ("[joint.elbow]\ngear_ratio = 0.0\n", r"joint.elbow.gear_ratio.*zero"),
    "spring without damping": ("[joint.elbow]\nstiffness = 1.0\nmotor_inertia = 1.0\n", r"damping"),
    "gains of another robot": ('[controller]\nkind = "p_velocity"\nkp = [1.0]\n', r"kp"),
}


@pytest.mark.parametrize("name", BROKEN_URDF)
def test_a_broken_urdf_is_refused(tmp_path: Path, name: str):
    text, told, message = BROKEN_URDF[name]
    path = written(tmp_path, text)
    with pytest.raises(RobotError, match=message) as refused:
        import_robot(path, **told)
    assert str(path) in str(refused.value)


@pytest.mark.parametrize("name", BROKEN_ENTITIES)
def test_entities_are_never_expanded(tmp_path: Path, name: str):
    secret = written(tmp_path, "secret", "secret.txt")
    path = written(tmp_path, BROKEN_ENTITIES[name].replace("{secret}", str(secret)))
    with pytest.raises(RobotError, match=r"line \d: expected no document type") as refused:
        import_robot(path)
    assert "secret" not in str(refused.value)


def test_a_urdf_opens_no_mesh(tmp_path: Path):
    """Shapes may be anywhere: nobody needs them."""
    shape = '<link name="base"><visual><geometry><mesh filename="file:///etc/m.stl"/></geometry></visual></link>'
    path = written(tmp_path, urdf('<link name="base"/>', shape))
    assert import_robot(path).n_axes == 2


@pytest.mark.parametrize("name", BROKEN_MJCF)
def test_a_broken_mjcf_is_refused(tmp_path: Path, name: str):
    text, message = BROKEN_MJCF[name]
    path = written(tmp_path, text, "arm.xml")
    with pytest.raises(RobotError, match=message) as refused:
        import_robot(path)
    assert str(path) in str(refused.value)


def test_a_link_out_of_the_folder_is_not_followed(tmp_path: Path):
    outside = written(tmp_path, "<mujoco/>", "outside.xml")
    folder = tmp_path / "model"
    folder.mkdir()
    (folder / "inside.xml").symlink_to(outside)
    path = written(
        folder, mjcf("<worldbody>", '<include file="inside.xml"/><worldbody>'), "arm.xml"
    )
    with pytest.raises(RobotError, match=r"<include>: file.*inside the folder"):
        import_robot(path)


@pytest.mark.parametrize("name", BROKEN_DH)
def test_a_broken_table_is_refused(tmp_path: Path, name: str):
    text, message = BROKEN_DH[name]
    path = written(tmp_path, text, "arm.csv")
    with pytest.raises(RobotError, match=message):
        import_robot(path)


@pytest.mark.parametrize("name", BROKEN_DH_TOML)
def test_a_broken_table_as_toml_is_refused(tmp_path: Path, name: str):
    text, message = BROKEN_DH_TOML[name]
    path = written(tmp_path, text, "arm.toml")
    with pytest.raises(RobotError, match=message):
        import_robot(path)
    if name != "no TOML":  # which nobody can tell from a robot file that is none
        with pytest.raises(RobotError, match=message):
            load_robot(path)


def test_a_toml_that_is_no_robot_says_what_would_be(tmp_path: Path):
    for text in ("", "gear = 3\n", "[joint.elbow]\ngear_ratio = 0.02\n", "joint = [1]\n"):
        path = written(tmp_path, text, "arm.toml")
        for read in (load_robot, import_robot):
            with pytest.raises(
                RobotError,
                match=r"arm.toml: expected a robot file \(schema .* or a table of Denavit",
            ):
                read(path)
    path = written(tmp_path, 'schema = "axisight.columns/1"\n', "map.toml")
    with pytest.raises(RobotError, match=r"schema.*expected \"axisight.robot/1.*columns"):
        load_robot(path)
    path = written(tmp_path, load_robot("two_mass_axis").toml, "robot.toml")
    with pytest.raises(RobotError, match=r"expected a table of .*got a file of schema 'axisight.r"):
        import_robot(path)


@pytest.mark.parametrize("name", BROKEN_DRIVES)
def test_broken_drive_data_are_refused(tmp_path: Path, name: str):
    text, message = BROKEN_DRIVES[name]
    path = written(tmp_path, URDF)
    with pytest.raises(RobotError, match=message):
        import_robot(path, drives=written(tmp_path, text, "my.toml"))


def test_a_file_that_is_not_there_is_said(tmp_path: Path):
    for name in ("none.urdf", "none.xml", "none.csv", "none.toml"):
        with pytest.raises(RobotError, match=re.escape(f"{tmp_path / name}: expected a readable")):
            import_robot(tmp_path / name)
