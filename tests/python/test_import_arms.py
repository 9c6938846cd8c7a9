"""Arms of two public packages: inverse dynamics as in Pinocchio and MuJoCo, at a thousand states each.

The packages are only read: example-robot-data (URDF), robosuite (MJCF).
"""

from __future__ import annotations

from importlib.metadata import distribution
from pathlib import Path

import mujoco
import pinocchio
import pytest

from axisight.robot_import import import_robot
from imported_arms import difference_to_mujoco, difference_to_pinocchio

URDFS = Path(
    str(
        distribution("example-robot-data").locate_file(
            "cmeel.prefix/share/example-robot-data/robots"
        )
    )
)
MJCFS = Path(str(distribution("robosuite").locate_file("robosuite/models/assets/robots")))

# File, last link (None: the only moving branch), axes.
URDF_ARMS = [
    ("kinova_description/robots/kinova.urdf", None, 6),
    ("panda_description/urdf/panda.urdf", "panda_hand", 7),
    ("so_arm_description/urdf/so100.urdf", None, 6),
    ("so_arm_description/urdf/so101.urdf", None, 6),
    ("ur_description/urdf/ur3_robot.urdf", None, 6),
    ("ur_description/urdf/ur5_robot.urdf", None, 6),
    ("ur_description/urdf/ur5_gripper.urdf", None, 6),
    ("ur_description/urdf/ur10_robot.urdf", None, 6),
    ("xarm_description/urdf/xarm7.urdf", None, 7),
    ("z1_description/urdf/z1.urdf", None, 7),
    ("talos_data/robots/talos_left_arm.urdf", None, 7),
    ("borinot_description/urdf/borinot_flying_arm_2.urdf", None, 2),
    ("hextilt_description/urdf/hextilt_flying_arm_5.urdf", None, 5),
    ("tiago_description/robots/tiago_no_hand.urdf", "arm_7_link", 8),
    ("tiago_pro_description/robots/tiago_pro.urdf", "arm_left_7_link", 8),
    ("baxter_description/urdf/baxter.urdf", "left_gripper", 7),
    ("pr2_description/urdf/pr2.urdf", "r_gripper_palm_link", 8),
    ("centauro_description/urdf/centauro.urdf", "arm1_6", 7),
    ("alex_description/urdf/alex_nub_hands.urdf", "LeftGripperYawLink", 10),
    ("romeo_description/urdf/romeo_small.urdf", "l_wrist", 8),
    ("g1_description/urdf/g1_29dof_rev_1_0.urdf", "left_wrist_yaw_link", 10),
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
# Of the largest force. Rounding of a few hundred operations at 1e-16 each is a thousandth of it.
CLOSE = 1e-9


@pytest.mark.parametrize(("file", "tip", "axes"), URDF_ARMS, ids=[f for f, *_ in URDF_ARMS])
def test_a_urdf_arm_moves_as_in_pinocchio(file: str, tip: str | None, axes: int):
    robot = import_robot(URDFS / file, tip=tip)
    assert robot.n_axes == axes
    model = pinocchio.buildModelFromUrdf(str(URDFS / file))
    assert difference_to_pinocchio(robot, model) < CLOSE


@pytest.mark.parametrize(("name", "tip", "axes"), MJCF_ARMS, ids=[n for n, *_ in MJCF_ARMS])
def test_an_mjcf_arm_moves_as_in_mujoco(name: str, tip: str | None, axes: int):
    file = MJCFS / name / "robot.xml"
    robot = import_robot(file, tip=tip)
    assert robot.n_axes == axes
    model = mujoco.MjModel.from_xml_path(str(file))
    assert difference_to_mujoco(robot, model) < CLOSE


def main() -> None:
    """Print the table of docs/models.md."""
    print("| file | to | axes | largest difference, of the largest force |\n|---|---|---|---|")
    for file, tip, axes in URDF_ARMS:
        robot = import_robot(URDFS / file, tip=tip)
        found = difference_to_pinocchio(robot, pinocchio.buildModelFromUrdf(str(URDFS / file)))
        print(f"| `{Path(file).name}` | {tip or 'end'} | {axes} | {found:.1e} |")
    for name, tip, axes in MJCF_ARMS:
        robot = import_robot(MJCFS / name / "robot.xml", tip=tip)
        model = mujoco.MjModel.from_xml_path(str(MJCFS / name / "robot.xml"))
        found = difference_to_mujoco(robot, model)
        print(f"| `{name}/robot.xml` | {tip or 'end'} | {axes} | {found:.1e} |")


if __name__ == "__main__":
    main()
