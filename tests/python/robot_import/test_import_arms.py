"""Arms of two public packages: inverse dynamics as in Pinocchio and MuJoCo, at a thousand states each.

The packages are only read: example-robot-data (URDF), robosuite (MJCF). `make setup` installs both; without
one its arms are skipped, since what stands in these files can be had nowhere else.
"""

from __future__ import annotations

import re
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import mujoco
import pinocchio
import pytest

from axisight.robot_import import import_robot
from imported_arms import difference_to_mujoco, difference_to_pinocchio


def folder(package: str, files: str) -> Path | None:
    """Return the folder of model files in a package; None where it is not installed."""
    try:
        return Path(str(distribution(package).locate_file(files)))
    except PackageNotFoundError:
        return None


URDFS = folder("example-robot-data", "cmeel.prefix/share/example-robot-data/robots")
MJCFS = folder("robosuite", "robosuite/models/assets/robots")

# File, last link (None: the only moving branch), axes.
URDF_ARMS = [
    ("kinova_description/robots/kinova.urdf", None, 6),
    ("panda_description/urdf/panda.urdf", "panda_hand", 7),
    ("panda_description/urdf/panda_collision.urdf", "panda_hand", 7),
    ("so_arm_description/urdf/so100.urdf", None, 6),
    ("so_arm_description/urdf/so101.urdf", None, 6),
    ("ur_description/urdf/ur3_robot.urdf", None, 6),
    ("ur_description/urdf/ur3_gripper.urdf", None, 6),
    ("ur_description/urdf/ur3_joint_limited_robot.urdf", None, 6),
    ("ur_description/urdf/ur5_robot.urdf", None, 6),
    ("ur_description/urdf/ur5_gripper.urdf", None, 6),
    ("ur_description/urdf/ur5_joint_limited_robot.urdf", None, 6),
    ("ur_description/urdf/ur10_robot.urdf", None, 6),
    ("ur_description/urdf/ur10_joint_limited_robot.urdf", None, 6),
    ("xarm_description/urdf/xarm7.urdf", None, 7),
    ("z1_description/urdf/z1.urdf", None, 7),
    ("asr_twodof_description/urdf/TwoDofs.urdf", None, 2),
    ("double_pendulum_description/urdf/double_pendulum.urdf", None, 2),
    ("double_pendulum_description/urdf/double_pendulum_continuous.urdf", None, 2),
    ("double_pendulum_description/urdf/double_pendulum_simple.urdf", None, 2),
    ("finger_edu_description/robots/finger_edu.urdf", None, 3),
    ("allegro_hand_description/urdf/allegro_left_hand.urdf", "link_15.0", 4),
    ("allegro_hand_description/urdf/allegro_right_hand.urdf", "link_15.0", 4),
    ("talos_data/robots/talos_left_arm.urdf", None, 7),
    ("talos_data/robots/talos_full_v2.urdf", "arm_left_7_link", 9),
    ("talos_data/robots/talos_full_v2_box.urdf", "arm_right_7_link", 9),
    ("talos_data/robots/talos_reduced.urdf", "arm_left_7_link", 9),
    ("talos_data/robots/talos_reduced_box.urdf", "arm_right_7_link", 9),
    ("talos_data/robots/talos_reduced_corrected.urdf", "arm_left_7_link", 9),
    ("borinot_description/urdf/borinot_flying_arm_2.urdf", None, 2),
    ("hextilt_description/urdf/hextilt_flying_arm_5.urdf", None, 5),
    ("tiago_description/robots/tiago.urdf", "arm_7_link", 8),
    ("tiago_description/robots/tiago_no_hand.urdf", "arm_7_link", 8),
    ("tiago_description/robots/tiago_dual.urdf", "arm_left_7_link", 8),
    ("tiago_description/robots/tiago_dual.urdf", "arm_right_7_link", 8),
    ("tiago_pro_description/robots/tiago_pro.urdf", "arm_left_7_link", 8),
    ("baxter_description/urdf/baxter.urdf", "left_gripper", 7),
    ("pr2_description/urdf/pr2.urdf", "r_gripper_palm_link", 8),
    ("centauro_description/urdf/centauro.urdf", "arm1_6", 7),
    ("alex_description/urdf/alex_nub_hands.urdf", "LeftGripperYawLink", 10),
    ("alex_description/urdf/alex_psyonic_hands.urdf", "LeftGripperYawLink", 10),
    ("alex_description/urdf/alex_sake_hands.urdf", "LeftGripperYawLink", 10),
    ("romeo_description/urdf/romeo.urdf", "l_wrist", 8),
    ("romeo_description/urdf/romeo_laas_small.urdf", "l_wrist", 8),
    ("romeo_description/urdf/romeo_small.urdf", "l_wrist", 8),
    ("g1_description/urdf/g1_29dof_rev_1_0.urdf", "left_wrist_yaw_link", 10),
    ("g1_description/urdf/g1_29dof_with_hand_rev_1_0.urdf", "left_wrist_yaw_link", 10),
    ("simple_humanoid_description/urdf/simple_humanoid.urdf", "l_wrist", 10),
    ("simple_humanoid_description/urdf/simple_humanoid_classical.urdf", "l_wrist", 10),
    ("b1_description/urdf/b1-z1.urdf", "gripperMover", 7),
    ("anymal_b_simple_description/robots/anymal-kinova.urdf", "j2s6s200_link_6", 6),
]
MJCF_ARMS = [
    ("iiwa", None, 7),
    ("jaco", None, 7),
    ("kinova3", None, 7),
    ("panda", None, 7),
    ("sawyer", None, 7),
    ("spot_arm", None, 6),
    ("ur5e", None, 6),
    ("xarm7", None, 7),
    ("baxter", "left_wrist", 7),
    ("tiago", "arm_right_6_link", 7),
]
# Of the files, these hold no arm that could be compared.
OTHER_URDFS = {
    "legs": (
        "a1.urdf",
        "alexander_v1.lowerBodyOnly.urdf",
        "anymal.urdf",
        "b1.urdf",
        "bolt.urdf",
        "go1.urdf",
        "go2.urdf",
        "hyq_no_sensors.urdf",
        "laikago.urdf",
        "quadruped.urdf",
        "solo.urdf",
        "solo12.urdf",
    ),
    "no joint, or propellers": ("iris.urdf", "iris_simple.urdf", "quadrotor_base.urdf"),
    "links of an arm without mass or inertia": ("human.urdf", "icub.urdf", "icub_reduced.urdf"),
    "no link: xacro that nobody expanded": ("ur3.urdf",),
}
# Of the largest force. Rounding of a few hundred operations at 1e-16 each is a thousandth of it.
CLOSE = 1e-9


NO_URDFS = "example-robot-data is not installed: it comes with the extra `test`"
NO_MJCFS = "robosuite is not installed: make setup does so, without what it depends on"


def ids(arms: list[tuple[str, str | None, int]]) -> list[str]:
    return [f"{file} to {tip or 'end'}" for file, tip, _ in arms]


def found_in_urdf(file: str, tip: str | None, axes: int) -> float:
    """Return the largest difference to Pinocchio, of the largest force."""
    assert URDFS is not None
    robot = import_robot(URDFS / file, tip=tip)
    assert robot.n_axes == axes
    return difference_to_pinocchio(robot, pinocchio.buildModelFromUrdf(str(URDFS / file)))


def found_in_mjcf(name: str, tip: str | None, axes: int) -> float:
    """Return the largest difference to MuJoCo, of the largest force."""
    assert MJCFS is not None
    file = MJCFS / name / "robot.xml"
    robot = import_robot(file, tip=tip)
    assert robot.n_axes == axes
    return difference_to_mujoco(robot, mujoco.MjModel.from_xml_path(str(file)))


@pytest.mark.skipif(URDFS is None, reason=NO_URDFS)
@pytest.mark.parametrize(("file", "tip", "axes"), URDF_ARMS, ids=ids(URDF_ARMS))
def test_a_urdf_arm_moves_as_in_pinocchio(file: str, tip: str | None, axes: int):
    assert found_in_urdf(file, tip, axes) < CLOSE


@pytest.mark.skipif(MJCFS is None, reason=NO_MJCFS)
@pytest.mark.parametrize(("name", "tip", "axes"), MJCF_ARMS, ids=ids(MJCF_ARMS))
def test_an_mjcf_arm_moves_as_in_mujoco(name: str, tip: str | None, axes: int):
    assert found_in_mjcf(name, tip, axes) < CLOSE


@pytest.mark.skipif(URDFS is None, reason=NO_URDFS)
def test_every_urdf_of_the_package_is_compared_or_said_to_hold_no_arm():
    assert URDFS is not None
    there = {path.name for path in URDFS.rglob("*.urdf")}
    others = {name for names in OTHER_URDFS.values() for name in names}
    assert there == {Path(file).name for file, *_ in URDF_ARMS} | others


def test_the_page_tells_every_arm(repository: Path):
    page = (repository / "docs" / "model_checks.md").read_text(encoding="utf-8")
    table = page.split("| largest difference, of the largest force |\n")[1].split("\n\n")[0]
    rows = re.findall(r"^\| `(.*)` \| (.*) \| (\d+) \| (.*) \|$", table, flags=re.MULTILINE)
    arms = [(Path(file).name, tip or "end", axes) for file, tip, axes in URDF_ARMS]
    arms += [(f"{name}/robot.xml", tip or "end", axes) for name, tip, axes in MJCF_ARMS]
    assert [(file, tip, int(axes)) for file, tip, axes, _ in rows] == arms
    assert all(float(difference) < CLOSE for *_, difference in rows)


def main() -> None:
    """Print the table of docs/model_checks.md."""
    print("| file | to | axes | largest difference, of the largest force |\n|---|---|---|---|")
    for file, tip, axes in URDF_ARMS:
        found = found_in_urdf(file, tip, axes)
        print(f"| `{Path(file).name}` | {tip or 'end'} | {axes} | {found:.1e} |")
    for name, tip, axes in MJCF_ARMS:
        found = found_in_mjcf(name, tip, axes)
        print(f"| `{name}/robot.xml` | {tip or 'end'} | {axes} | {found:.1e} |")


if __name__ == "__main__":
    main()
