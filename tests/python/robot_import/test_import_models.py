"""Robots out of URDF, MJCF, tables and Pinocchio models, against the libraries that own these formats."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pinocchio
import pytest

from axisight import Robot, load_robot
from axisight.errors import MissingExtraError, RobotError
from axisight.robot_import import import_robot, is_model_file
from axisight.robot_import.drives import DriveData
from import_data import DH, MJCF, URDF, changed, dh_toml, written
from imported_arms import difference_to_mujoco, difference_to_pinocchio, states


def test_a_urdf_moves_as_in_pinocchio(tmp_path: Path):
    path = written(tmp_path, URDF)
    robot = load_robot(path)
    assert robot.joint_names == ["shoulder", "elbow"]
    assert difference_to_pinocchio(robot, pinocchio.buildModelFromUrdf(str(path))) < 1e-12
    # What is written is a robot file like any other.
    again = Robot.from_toml(robot.toml)
    q, v, a = states(robot, 5)
    assert np.array_equal(again.inverse_dynamics(q, v, a), robot.inverse_dynamics(q, v, a))


def test_a_urdf_says_drives(tmp_path: Path):
    """Damping and friction act on the joint, and stand on the motor side in a robot file."""
    robot = import_robot(written(tmp_path, URDF))
    shoulder, elbow = robot.joints
    assert shoulder.drive is not None
    assert elbow.drive is not None
    assert shoulder.drive.gear_ratio == pytest.approx(1 / 50)
    assert shoulder.drive.viscous_friction == pytest.approx(0.7 / 50**2)
    assert shoulder.drive.motor_inertia == 0.0
    assert elbow.drive.gear_ratio == 1.0
    (dry,) = robot.effects
    assert dry.label == "coulomb_friction@1"
    assert dry.values()[0] == pytest.approx(1.5 / 50)
    # Of a reversal that takes 0.01 rad/s of the joint.
    assert (dry.parameters or {})["smoothing_rad_s"] == pytest.approx(0.01 * 50)


TRANSMISSION = URDF[URDF.index("  <transmission") : URDF.index("</robot>")]


@pytest.mark.parametrize("joint", ["shoulder", "elbow"])
def test_gears_of_ros2_control_are_read(tmp_path: Path, joint: str):
    """Beside the hardware interfaces of joints, which are none of the robot's."""
    control = f"""<ros2_control name="arm" type="system"><hardware><plugin>a/B</plugin></hardware>
    <joint name="{joint}"><command_interface name="effort"/></joint>
    <transmission name="t"><plugin>transmission_interface/SimpleTransmission</plugin>
      <joint name="{joint}" role="joint1"><mechanical_reduction> 80.0 </mechanical_reduction></joint>
      <actuator name="m" role="actuator1"/></transmission></ros2_control>"""
    robot = import_robot(written(tmp_path, changed(URDF, TRANSMISSION, control)))
    number = robot.joint_names.index(joint)
    assert robot.gear_ratio[number] == pytest.approx(1 / 80)
    assert robot.gear_ratio[1 - number] == 1.0
    assert "left out" not in robot.toml


# Transmissions of which something is left out: what becomes of the file's, what is said, the shoulder's ratio.
TRANSMISSIONS = {
    "differential": (
        '<joint name="shoulder"/>',
        '<joint name="shoulder"/><joint name="elbow"/>',
        "transmission 't' drives several joints, 'shoulder', 'elbow': their reductions left out",
        1.0,
    ),
    "of the actuator": (
        "mechanicalReduction>50</mechanicalReduction",
        "mechanical_reduction>50</mechanical_reduction",
        "transmission 't': mechanical_reduction of its actuator left out, ros2_control takes that of the joint",
        1.0,
    ),
    "unknown joint": (
        '<joint name="shoulder"/>',
        '<joint name="sholder"/>',
        "transmission 't' is of a joint 'sholder' that is not there: left out",
        1.0,
    ),
    "two of one": (
        "  </transmission>",
        '</transmission><transmission name="u"><joint name="shoulder">'
        "<mechanical_reduction>60</mechanical_reduction></joint></transmission>",
        "transmission 'u': reduction 60 of 'shoulder' left out, another transmission says 50",
        1 / 50,
    ),
}


@pytest.mark.parametrize("what", TRANSMISSIONS)
def test_transmissions_that_are_no_gear_of_one_joint_are_said(tmp_path: Path, what: str):
    old, new, note, ratio = TRANSMISSIONS[what]
    robot = import_robot(written(tmp_path, changed(URDF, old, new)))
    assert f"# {note}" in robot.toml
    assert robot.gear_ratio[0] == pytest.approx(ratio)


def test_branches_are_cut_by_the_tip(tmp_path: Path):
    """A camera that nods beside the elbow: locked at zero, its mass stays where it is."""
    camera = """<link name="camera"><inertial><origin xyz="0 0.1 0"/><mass value="1"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
    <joint name="nod" type="prismatic"><parent link="upper"/><child link="camera"/>
    <origin xyz="0 0.2 0.1" rpy="0 0 0.5"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""
    path = written(tmp_path, changed(URDF, "</robot>", camera))
    with pytest.raises(RobotError, match=r"2 moving branches.*lower, camera and part at upper"):
        import_robot(path)
    whole = pinocchio.buildModelFromUrdf(str(path))
    robot = import_robot(path, tip="flange")
    assert robot.joint_names == ["shoulder", "elbow"]
    assert "locked at zero, masses carried along: nod" in robot.toml
    assert difference_to_pinocchio(robot, whole) < 1e-12
    other = import_robot(path, tip="camera")
    assert other.joint_names == ["shoulder", "nod"]
    assert other.axis_is_prismatic == [False, True]
    assert difference_to_pinocchio(other, whole) < 1e-12
    # Said in the drive data beside it, the file alone is enough.
    (tmp_path / "arm.drives.toml").write_text(
        'tip = "flange"\n[joint.elbow]\nmotor_inertia = 0.1\n'
    )
    beside = load_robot(path)
    assert beside.parameters()["elbow.motor_inertia"] == 0.1
    assert beside.joint_names == robot.joint_names
    assert beside.toml.startswith(f"# imported from {path.name}, drives from arm.drives.toml\n")


def test_the_base_may_be_a_link_on_the_way(tmp_path: Path):
    """What is before it stands still; gravity stays that of the file."""
    path = written(tmp_path, URDF)
    whole = import_robot(path)
    part = import_robot(path, base="upper")
    assert part.joint_names == ["elbow"]
    q, v, a = states(part, 20)
    still = np.zeros((20, 1))
    wanted = whole.inverse_dynamics(*(np.hstack([still, x]) for x in (q, v, a)))[:, 1:]
    np.testing.assert_allclose(part.inverse_dynamics(q, v, a), wanted, atol=1e-13)


def test_an_mjcf_moves_as_in_mujoco(tmp_path: Path):
    """Anchors beside the body, angles with a reference, two joints of one body."""
    path = written(tmp_path, MJCF, "arm.xml")
    robot = load_robot(path)
    assert robot.joint_names == ["shoulder", "elbow", "slide"]
    assert difference_to_mujoco(robot, mujoco.MjModel.from_xml_path(str(path))) < 1e-12


def test_an_mjcf_says_drives(tmp_path: Path):
    robot = import_robot(written(tmp_path, MJCF, "arm.xml"))
    drive = robot.joints[0].drive
    assert drive is not None
    assert (drive.gear_ratio, drive.motor_inertia) == pytest.approx((1 / 50, 0.2 / 50**2))
    assert drive.viscous_friction == pytest.approx(0.7 / 50**2)
    assert [e.label for e in robot.effects] == ["cable_stiffness@1", "coulomb_friction@1"]
    assert robot.effects[0].values() == [3.0, 0.0]
    elsewhere = changed(MJCF, 'stiffness="3"', 'stiffness="3" springref="0.2"')
    robot = import_robot(written(tmp_path, elsewhere, "elsewhere.xml"))
    assert [e.label for e in robot.effects] == ["cable_stiffness@1", "coulomb_friction@1"]
    assert robot.effects[0].values() == pytest.approx([3.0, 0.6])


def test_a_spring_of_a_slide_rests_where_mujoco_has_it(tmp_path: Path):
    """A spring counts in metres from its rest, where MuJoCo's own passive force is none."""
    text = changed(MJCF, 'name="slide"', 'name="slide" stiffness="40" springref="0.05"')
    path = written(tmp_path, text, "arm.xml")
    spring = next(e for e in import_robot(path).effects if e.label == "cable_stiffness@3")
    stiffness, at_zero = spring.values()
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    for place in (0.0, 0.05, 0.2):
        data.joint("slide").qpos = place
        mujoco.mj_forward(model, data)
        force = data.joint("slide").qfrc_passive
        assert at_zero - stiffness * place == pytest.approx(float(force[0]), abs=1e-12)


def test_what_an_mjcf_has_beyond_a_chain_is_listed(tmp_path: Path):
    more = """</actuator><equality><joint joint1="elbow"/></equality></mujoco>"""
    text = changed(MJCF, "</actuator>\n</mujoco>", more)
    text = changed(text, "<actuator>", '<actuator><position name="servo" joint="elbow" kp="9"/>')
    robot = import_robot(written(tmp_path, text, "arm.xml"))
    assert "1 equality constraints left out" in robot.toml
    assert "actuators of elbow are told positions, those of other joints are not" in robot.toml


def test_joints_that_mimic_others_are_locked_beyond_the_tip(tmp_path: Path):
    """As in a URDF; a constraint that is switched off couples nothing."""
    coupled = '<equality><joint joint1="slide" joint2="shoulder"{}/></equality>'
    text = changed(MJCF, "</actuator>", "</actuator>" + coupled.format(""))
    with pytest.raises(
        RobotError, match="<joint 'slide'>: expected joints with drives of their own"
    ):
        import_robot(written(tmp_path, text, "arm.xml"))
    robot = import_robot(written(tmp_path, text, "cut.xml"), tip="upper")
    assert robot.axis_names == ["shoulder"]
    assert "locked at zero, masses carried along: elbow, slide" in robot.toml
    off = changed(MJCF, "</actuator>", "</actuator>" + coupled.format(' active="false"'))
    assert import_robot(written(tmp_path, off, "off.xml")).n_axes == 3


# Principal moments of a link: whether a note says that no body has them.
MOMENTS = {
    "a sphere": ((0.02, 0.02, 0.02), False),
    "a plate": ((0.02, 0.03, 0.05), False),
    "a plate of three digits": ((0.0204, 0.0304, 0.0511), False),
    "no body": ((0.02, 0.03, 0.06), True),
}


@pytest.mark.parametrize("name", MOMENTS)
def test_an_inertia_that_no_body_has_is_listed(tmp_path: Path, name: str):
    """Moments of three digits are off by up to 0.5 % each, which makes a plate violate the rule by 1 %."""
    (xx, yy, zz), listed = MOMENTS[name]
    text = changed(
        URDF,
        'ixx="0.02" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.025"',
        f'ixx="{xx}" iyy="{yy}" izz="{zz}"',
    )
    robot = import_robot(written(tmp_path, text))
    said = "inertia of 'lower': principal moments 0.02, 0.03, 0.06 kg m^2, of which no body has one above the sum"
    assert (said in robot.toml) is listed
    assert ("of which no body has" in robot.toml) is listed
    file = changed(MJCF, 'diaginertia="0.02 0.03 0.025"', f'diaginertia="{xx} {yy} {zz}"')
    if listed or name == "a plate of three digits":  # MuJoCo refuses both itself
        with pytest.raises(RobotError, match=r"MuJoCo: .*A \+ B >= C"):
            import_robot(written(tmp_path, file, "arm.xml"))
    else:
        assert "of which no body has" not in import_robot(written(tmp_path, file, "arm.xml")).toml


MOTOR = '<motor joint="shoulder" gear="50"/>'


# What a chain has no number for: where it stands, and what is said of it.
def test_a_file_of_several_robots_asks_for_the_base_of_one(tmp_path: Path):
    """With a base, the robot that stands on it is imported, with its own joints only."""
    pytest.importorskip("mujoco", reason="MuJoCo comes with the extra `mujoco`")
    mass = '<inertial pos="0.1 0 0" mass="1" diaginertia="0.1 0.1 0.1"/>'
    arms = "".join(
        f'<body name="{side}"><geom size="0.1" mass="5"/><body name="{side}_link">'
        f'<joint name="{side}_joint" axis="0 1 0"/>{mass}</body></body>'
        for side in ("left", "right")
    )
    path = written(tmp_path, f"<mujoco><worldbody>{arms}</worldbody></mujoco>", "arm.xml")
    with pytest.raises(RobotError, match=r"2 that stand apart.*--base.*one of left, right$"):
        import_robot(path)
    assert import_robot(path, base="right").joint_names == ["right_joint"]
    # One that stands on no body of its own is told by its tip.
    bare = f'<body name="bare"><joint name="third" axis="0 1 0"/>{mass}</body></worldbody>'
    path = written(tmp_path, path.read_text().replace("</worldbody>", bare), "arm.xml")
    with pytest.raises(RobotError, match=r"3 moving branches.*--tip"):
        import_robot(path)


BEYOND = {
    "gravcomp": (
        'name="lower"',
        'name="lower" gravcomp="0.5"',
        "gravcomp of 'lower' left out: gravity acts on all of their masses",
    ),
    "force of a joint": (
        'name="elbow"',
        'name="elbow" actuatorfrcrange="-5 5"',
        "joint 'elbow': limits of the force of its actuators left out: no actuator acts on it",
    ),
    "second motor": (
        MOTOR,
        MOTOR + '<motor name="other" joint="shoulder" gear="3"/>',
        "joint 'shoulder' has 2 motors, 'actuator 0', 'other': their gears, gains, limits, delays and lags",
    ),
    "site": (
        MOTOR,
        MOTOR + '<motor name="jet" site="s" gear="0 0 1 0 0 0"/>',
        "actuator 'jet' acts on a site, not on one joint: left out",
    ),
    "tendon": (
        MOTOR + "</actuator>",
        '<motor name="rope" tendon="t"/></actuator><tendon><fixed name="t">'
        '<joint joint="elbow" coef="1"/></fixed></tendon>',
        "actuator 'rope' acts on a tendon, not on one joint: left out",
    ),
    "force of a motor": (
        MOTOR,
        '<motor joint="shoulder" name="m" forcerange="-1 2"/>',
        "actuator 'm': limits of its force left out: expected the same both ways",
    ),
    "force of a joint one way": (
        'name="shoulder"',
        'name="shoulder" actuatorfrcrange="-5 6"',
        "joint 'shoulder': limits of the force of its actuators left out: expected the same both ways",
    ),
    "force behind a lag": (
        MOTOR,
        '<general joint="shoulder" name="m" dyntype="filterexact" dynprm="0.01" forcerange="-1 1"/>',
        "actuator 'm': limits of its force left out: they act behind its lag",
    ),
    "one that is told speeds": (
        MOTOR,
        '<velocity joint="shoulder" name="m" kv="7"/>',
        "actuator 'm' is told speeds: its law, 7 Nm s/rad times the error of speed, is left out",
    ),
    "one that sums speeds up": (
        MOTOR,
        '<intvelocity joint="shoulder" name="m" kp="9" actrange="-1 1"/>',
        "actuator 'm' is told speeds, which it sums up to its target: position_ref of logs is its activation",
    ),
    "how far it sums up": (
        MOTOR,
        '<intvelocity joint="shoulder" name="m" kp="9" actrange="-1 1"/>',
        "actuator 'm': limits of its target left out",
    ),
    "stiffness": (
        'stiffness="3"',
        'stiffness="3 2"',
        "joint 'shoulder': stiffness beyond the linear left out",
    ),
    "damping": (
        'damping="0.7"',
        'damping="0.7 0 2"',
        "joint 'shoulder': cubic damping left out",
    ),
    "yielding": (
        'stiffness="3"',
        'stiffness="3" springyield="0.1"',
        "joint 'shoulder': yielding of its spring left out",
    ),
    "damping of a motor": (
        MOTOR,
        '<motor name="m" joint="shoulder" damping="1 0 2"/>',
        "actuator 'm': cubic damping left out",
    ),
}


@pytest.mark.parametrize("what", BEYOND)
def test_what_a_chain_has_no_number_for_is_said(tmp_path: Path, what: str):
    old, new, note = BEYOND[what]
    plain = changed(MJCF, '<inertial pos="0 0 0"', '<site name="s"/><inertial pos="0 0 0"')
    path = written(tmp_path, changed(plain, old, new), "arm.xml")
    if what in ("stiffness", "damping", "yielding", "damping of a motor"):
        since_mujoco_4(path)
    assert f"# {note}" in import_robot(path).toml
    assert note not in import_robot(written(tmp_path, plain, "plain.xml")).toml


def since_mujoco_4(path: Path) -> None:
    """Skip the test where the MuJoCo that is there does not know what the file says."""
    if int(mujoco.__version__.split(".")[0]) < 4:
        pytest.skip(f"{path.name} needs MuJoCo 4")


def test_a_motor_in_the_parent_is_one_of_the_joint(tmp_path: Path):
    """For one axis both frames have the same torque."""
    path = written(tmp_path, MJCF, "arm.xml")
    in_parent = changed(MJCF, "<motor joint=", "<motor jointinparent=")
    robot = import_robot(written(tmp_path, in_parent, "parent.xml"))
    assert robot.gear_ratio.tolist() == import_robot(path).gear_ratio.tolist()
    assert "left out" not in robot.toml


def test_armature_and_damping_of_motors_act_on_the_joint(tmp_path: Path):
    """By the gear twice, beside those of the joint: inertia and passive torque are MuJoCo's."""
    text = changed(MJCF, 'gear="50"', 'gear="50" armature="1e-4" damping="2e-3"')
    path = written(tmp_path, text, "arm.xml")
    since_mujoco_4(path)
    parameters = import_robot(path).parameters()
    assert parameters["shoulder.motor_inertia"] == pytest.approx(0.2 / 50**2 + 1e-4)
    assert parameters["shoulder.viscous_friction"] == pytest.approx(0.7 / 50**2 + 2e-3)
    bare = written(tmp_path, changed(MJCF, 'armature="0.2"', ""), "bare.xml")
    moving = np.array([1.0, 0.0, 0.0])
    torques = []
    for model in (mujoco.MjModel.from_xml_path(str(one)) for one in (path, bare)):
        data, inertia = mujoco.MjData(model), np.zeros(3)
        mujoco.mj_forward(model, data)
        mujoco.mj_mulM(model, data, inertia, moving)
        still = data.qfrc_passive[0]
        data.qvel[:] = moving
        mujoco.mj_forward(model, data)
        torques.append((inertia[0], still - data.qfrc_passive[0]))
    (inertia, damping), (of_links, _) = torques
    assert parameters["shoulder.motor_inertia"] * 50**2 == pytest.approx(inertia - of_links)
    assert parameters["shoulder.viscous_friction"] * 50**2 == pytest.approx(damping)


def test_mujoco_is_named_where_it_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def no(name: str):
        raise ImportError(name)

    monkeypatch.setattr("axisight.robot_import.mjcf.reader.import_module", no)
    with pytest.raises(MissingExtraError, match=r"axisight\[mujoco\]"):
        import_robot(written(tmp_path, MJCF, "arm.xml"))


def placed(axis: str, angle: float, offset: tuple[float, float, float]) -> pinocchio.SE3:
    turned = {
        "x": pinocchio.utils.rpyToMatrix(angle, 0, 0),
        "z": pinocchio.utils.rpyToMatrix(0, 0, angle),
    }
    return pinocchio.SE3(turned[axis], np.array(offset))


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_a_table_moves_as_pinocchio_with_its_transforms(tmp_path: Path, convention: str):
    """Rz(theta) Tz(d) Tx(a) Rx(alpha) behind the joint, or Rx(alpha) Tx(a) Rz(theta) Tz(d) before it."""
    text = DH.replace("standard", convention)
    robot = load_robot(written(tmp_path, text, "arm.csv"))
    model = pinocchio.Model()
    parent, before = 0, pinocchio.SE3.Identity()
    for line in text.splitlines()[1:]:
        name, _, *numbers = line.split(",")
        theta, d, a, alpha, mass, x, y, z, xx, yy, zz, xy = map(float, numbers)
        along_z, along_x = placed("z", theta, (0, 0, d)), placed("x", alpha, (a, 0, 0))
        modified = convention == "modified"
        placement = before * along_x * along_z if modified else before
        parent = model.addJoint(parent, pinocchio.JointModelRZ(), placement, name)
        before = pinocchio.SE3.Identity() if modified else along_z * along_x
        inertia = np.array([[xx, xy, 0], [xy, yy, 0], [0, 0, zz]])
        body = pinocchio.Inertia(mass, np.array([x, y, z]), inertia)
        model.appendBodyToJoint(parent, body, before)
    assert difference_to_pinocchio(robot, model) < 1e-12


@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize("motion", ["revolute", "prismatic"])
def test_a_table_is_the_same_robot_as_toml(tmp_path: Path, convention: str, motion: str):
    """Numbers are read as the same floats, down to the last bit."""
    table = DH.replace("convention,", "convention,motion,").replace(
        "standard,", f"{convention},{motion},"
    )
    csv = import_robot(written(tmp_path, table, "arm.csv"))
    toml = load_robot(written(tmp_path, dh_toml(table), "arm.toml"))
    assert toml.toml.replace("arm.toml", "arm.csv") == csv.toml
    q, v, a = states(csv, 20)
    np.testing.assert_array_equal(toml.inverse_dynamics(q, v, a), csv.inverse_dynamics(q, v, a))


def test_a_table_as_toml_has_drive_data_and_defaults(tmp_path: Path):
    """Products of inertia and the motion may be left out, whole numbers are numbers."""
    table = written(tmp_path, dh_toml(), "arm.toml")
    written(tmp_path, "[joint.two]\ngear_ratio = 0.02\n", "arm.drives.toml")
    robot = load_robot(table, sample_time_s=0.004)
    assert robot.gear_ratio.tolist() == [1.0, 0.02, 1.0]
    assert robot.sample_time_s == 0.004
    assert is_model_file(table) and not is_model_file(written(tmp_path, robot.toml, "robot.toml"))


def test_a_pinocchio_model_is_taken_as_it_is(tmp_path: Path):
    path = written(tmp_path, URDF)
    model = pinocchio.buildModelFromUrdf(str(path))
    model.armature[:] = [0.2, 0.0]
    robot, same = import_robot(model), import_robot(path)
    q, v, a = states(robot, 20)
    np.testing.assert_allclose(
        robot.inverse_dynamics(q, v, a), same.inverse_dynamics(q, v, a), atol=1e-12
    )
    assert robot.parameters()["shoulder.motor_inertia"] == pytest.approx(0.2)
    # Damping and friction of the joint; Pinocchio does not read transmissions.
    assert robot.parameters()["shoulder.viscous_friction"] == pytest.approx(0.7)
    assert [e.label for e in robot.effects] == ["coulomb_friction@1"]
    floating = pinocchio.buildModelFromUrdf(str(path), pinocchio.JointModelFreeFlyer())
    with pytest.raises(RobotError, match=r"one degree of freedom.*FreeFlyer"):
        import_robot(floating)
    assert import_robot(floating, base="root_joint").joint_names == robot.joint_names


def test_a_mirrored_frame_is_refused(tmp_path: Path):
    """URDF and MJCF cannot say one, a model in memory can."""
    model = pinocchio.buildModelFromUrdf(str(written(tmp_path, URDF)))
    mirror = np.diag([1.0, 1.0, -1.0])
    model.jointPlacements[2] = pinocchio.SE3(mirror, np.array([0.5, 0, 0]))
    with pytest.raises(
        RobotError, match=r"joint 'elbow': expected a placement that turns.*mirrors"
    ):
        import_robot(model)


def test_moments_that_a_rounding_made_negative_are_zero(tmp_path: Path):
    flange = '<inertia ixx="0.001" ixy'
    rounded = written(tmp_path, changed(URDF, flange, '<inertia ixx="-5e-20" ixy'), "rounded.urdf")
    zero = written(tmp_path, changed(URDF, flange, '<inertia ixx="0" ixy'), "zero.urdf")
    robot, same = import_robot(rounded), import_robot(zero)
    assert "# ixx of link 'flange' taken as zero: -5e-20 kg m^2 in line 21" in robot.toml
    assert "taken as zero" not in same.toml
    q, v, a = states(robot, 20)
    assert np.array_equal(robot.inverse_dynamics(q, v, a), same.inverse_dynamics(q, v, a))
    # Of a body that has none at all, too.
    nothing = changed(
        changed(
            URDF,
            'ixx="0.001" ixy="0" ixz="0" iyy="0.001"',
            'ixx="-5e-20" ixy="0" ixz="0" iyy="-5e-20"',
        ),
        'iyz="0" izz="0.001"',
        'iyz="0" izz="0"',
    )
    assert "# iyy of link 'flange' taken" in import_robot(written(tmp_path, nothing)).toml
    beyond = written(tmp_path, changed(URDF, flange, '<inertia ixx="-5e-9" ixy'), "beyond.urdf")
    with pytest.raises(RobotError, match="line 21, <inertia>: ixx"):
        import_robot(beyond)


def test_drive_data_stand_before_the_file(tmp_path: Path):
    drives = written(
        tmp_path,
        """sample_time = 0.004
position_noise_std = 1e-5
operating_point = [0.1, 0.2]
[joint.shoulder]
gear_ratio = 0.01
motor_inertia = 1e-4
viscous_friction = 2e-3
coulomb_friction = 0.3
stiffness = 1e4
damping = 20.0
[controller]
kind = "pi_velocity"
kp = [1.0, 2.0]
ki = [3.0, 4.0]
[tolerances]
mass = 0.2
[payload]
mass = 3.0
com = [0.0, 0.0, 0.2]
""",
        "my.toml",
    )
    path = written(tmp_path, URDF)
    robot = import_robot(path, drives=drives)
    shoulder = robot.joints[0]
    assert shoulder.spring is not None
    assert shoulder.drive is not None
    assert (shoulder.spring.stiffness, shoulder.spring.damping) == (1e4, 20.0)
    assert (shoulder.drive.gear_ratio, shoulder.drive.motor_inertia) == (0.01, 1e-4)
    assert shoulder.drive.viscous_friction == 2e-3
    assert robot.effects[0].values()[0] == 0.3
    assert robot.sample_time_s == 0.004
    assert robot.position_noise_std == 1e-5
    assert robot.operating_point.tolist() == [0.1, 0.2]
    assert robot.controller_kind == "pi_velocity"
    assert robot.tolerances == {"mass": 0.2}
    last = robot.joints[-1].link
    assert last is not None
    assert last.mass_kg == pytest.approx(2 + 0.5 + 3)


@pytest.mark.parametrize("tip", ["lower", "flange"])
def test_a_payload_hangs_on_the_last_link(tmp_path: Path, tip: str):
    """Three kilogrammes in the frame of the link that the file calls so."""
    path = written(tmp_path, URDF)
    load = DriveData.model_validate({"payload": {"mass": 3.0, "com": (0.1, 0.2, 0.3)}})
    robot = import_robot(path, tip=tip, drives=load)
    model = pinocchio.buildModelFromUrdf(str(path))
    place = model.frames[model.getFrameId(tip)]
    body = pinocchio.Inertia(3.0, np.array([0.1, 0.2, 0.3]), np.zeros((3, 3)))
    model.appendBodyToJoint(place.parentJoint, body, place.placement)
    assert difference_to_pinocchio(robot, model, 50) < 1e-12
    if tip == "lower":
        same = import_robot(path, drives=load)
        assert same.toml == robot.toml


def test_the_sample_time_may_come_from_elsewhere(tmp_path: Path):
    path = written(tmp_path, URDF)
    assert import_robot(path).sample_time_s == 1e-3
    assert load_robot(path, sample_time_s=0.02).sample_time_s == 0.02


def test_a_model_file_states_no_pose_unless_its_drive_data_do(tmp_path: Path):
    path = written(tmp_path, URDF)
    robot = import_robot(path)
    assert not robot.states_operating_point
    assert not Robot.from_toml(robot.toml).states_operating_point
    assert not robot.with_torque_constants([None, None]).states_operating_point
    stated = import_robot(path, drives=DriveData(operating_point=[0.0, 0.0]))
    assert stated.states_operating_point
    assert Robot.from_toml(stated.toml).states_operating_point


def test_joints_that_cannot_be_at_zero_rest_in_the_middle(tmp_path: Path):
    text = changed(URDF, 'lower="-2" upper="2"', 'lower="1" upper="2"')
    assert import_robot(written(tmp_path, text)).operating_point.tolist() == [1.5, 0.0]
