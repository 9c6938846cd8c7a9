"""Model files by their kind."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from axisight.errors import RobotError
from axisight.robot.robot import Robot
from axisight.robot_import.bodies import Tree
from axisight.robot_import.chain import Chain, chain_of
from axisight.robot_import.description import description, torque_constants
from axisight.robot_import.dh import read_dh
from axisight.robot_import.drives import DriveData, read_drives
from axisight.robot_import.mjcf import read_mjcf
from axisight.robot_import.pinocchio_model import tree_of
from axisight.robot_import.urdf import read_urdf
from axisight.robot_import.xml_tree import read_xml


def drives_path(source: Path | str) -> Path:
    """Return where drive data of a model file stand: ``arm.drives.toml`` beside ``arm.urdf``."""
    path = Path(source)
    return path.with_name(f"{path.stem}.drives.toml")


def drive_data(source: Path | str | Any, given: Path | str | None = None) -> DriveData:
    """Return the drive data of a model: those ``given``, else those beside its file, if there are any."""
    file = drives_file(source, given)
    return DriveData() if file is None else read_drives(file)


def drives_file(source: Path | str | Any, given: Path | str | None) -> Path | None:
    """Return the file of a model's drive data: that ``given``, else that beside it, None without."""
    if given is not None:
        return Path(given)
    beside = isinstance(source, str | Path) and drives_path(source).is_file()
    return drives_path(source) if beside else None


def import_robot(
    source: Path | str | Any,
    *,
    base: str | None = None,
    tip: str | None = None,
    drives: DriveData | Path | str | None = None,
    sample_time_s: float | None = None,
) -> Robot:
    """Return the robot of a model file; ``robot.toml`` is the robot file that says the same.

    Parameters
    ----------
    source : URDF (``.urdf``, or ``.xml`` with <robot>), MJCF (``.xml``, ``.mjcf``), a table of Denavit
        and Hartenberg (``.csv``, ``.toml``), or a ``pinocchio.Model``.
    base, tip : links (bodies; joints of a ``pinocchio.Model``) between which the chain runs: the root, and
        the end of the only moving branch, unless given here or in the drive data.
    drives : what the file lacks of drives: data or their TOML file; of a file ``arm.urdf`` it is
        ``arm.drives.toml`` beside it, if there is one. Left out, gears are rigid with the
        ratio of the file or 1, rotors and friction as the file has them, and there is no controller.
    sample_time_s : where the drive data state none, instead of 1 ms.

    Links on fixed joints join what they hang on; frames are turned parallel to the base's at zero angle,
    as robot files have them; angles are those of the file. Raises RobotError, with file, line and element, for
    what cannot be one serial chain, MissingExtraError for MJCF without MuJoCo.

    """
    named = Path(source).name if isinstance(source, str | Path) else "a pinocchio.Model"
    if not isinstance(drives, DriveData):
        if (file := drives_file(source, drives)) is not None:
            named += f", drives from {file.name}"
        drives = drive_data(source, drives)
    tree, chain = bodies_and_chain(source, drives, base=base, tip=tip)

    def built(step_s: float | None) -> Robot:
        stated = drives if step_s is None else drives.model_copy(update={"sample_time": step_s})
        try:
            robot = Robot.from_toml(description(chain, stated, named))
            return robot.with_torque_constants(torque_constants(chain, stated))
        except RobotError as error:
            raise RobotError(f"{tree.file}: what was made of it is no robot: {error}") from None

    if drives.sample_time is not None:
        return built(None)
    robot = built(sample_time_s)
    return robot if drives.controller is not None else built(step_of_servos(robot))


# Longest step of actuators that hold positions between samples of logs [s], and how far damping may slow a
# joint in one: beyond twice as far it would swing.
_SERVO_STEP_S = 2e-3
_SLOWED = 0.4


def step_of_servos(robot: Robot) -> float:
    """Return the sample time [s] for a robot's controller: its own, or a whole share of it for servos."""
    time = robot.sample_time_s
    if robot.controller_kind != "pd_position":
        return time
    rest = np.zeros(robot.n_joints)
    rest[robot.axis_joints] = robot.operating_point
    inertia = robot.inertia_matrix(rest)
    for joint in robot.axis_joints:
        drive = robot.joints[joint].drive
        assert drive is not None  # an axis has one
        inertia[joint, joint] += drive.motor_inertia / drive.gear_ratio**2
    # Of a motor with all that gives way behind it.
    felt = robot.gear_ratio**2 / np.diag(np.linalg.inv(inertia))[robot.axis_joints]
    slowing_s = float(np.min(felt / np.maximum(robot.controller_gains["kd"], 1e-300)))
    return float(time / np.ceil(time / min(_SERVO_STEP_S, _SLOWED * slowing_s)))


def bodies_and_chain(
    source: Path | str | Any, drives: DriveData, *, base: str | None = None, tip: str | None = None
) -> tuple[Tree, Chain]:
    """Return what a model has, and the chain that is made of it; arguments as for `import_robot`."""
    tree = _tree(Path(source)) if isinstance(source, str | Path) else tree_of(source)
    return tree, chain_of(tree, base or drives.base, tip or drives.tip)


def _tree(path: Path) -> Tree:
    """Return the bodies of a file, read as what it says it is."""
    if path.suffix.lower() in (".csv", ".toml"):
        return read_dh(path)
    root = read_xml(path)
    if root.tag == "robot":
        return read_urdf(root, path)
    if root.tag == "mujoco":
        return read_mjcf(root, path)
    raise RobotError(f"{root.where}: expected <robot> (URDF) or <mujoco> (MJCF) as the root")
