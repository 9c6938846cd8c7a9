"""Import a model file of any kind as a robot."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight.errors import RobotError
from axisight.robot.robot import Robot
from axisight.robot.sources import USD_SUFFIXES
from axisight.robot_import.bodies import Tree
from axisight.robot_import.chain import Chain, chain_of
from axisight.robot_import.description import description, torque_constants
from axisight.robot_import.dh import read_dh
from axisight.robot_import.drives import DriveData, read_drives
from axisight.robot_import.mjcf import read_mjcf
from axisight.robot_import.pinocchio_model import tree_of
from axisight.robot_import.urdf import read_urdf
from axisight.robot_import.usd import read_usd
from axisight.robot_import.xml_tree import read_xml


def drives_path(source: Path | str) -> Path:
    """Return the default path of the drive data of a model file: ``arm.drives.toml`` beside ``arm.urdf``."""
    path = Path(source)
    return path.with_name(f"{path.stem}.drives.toml")


def drive_data(source: Path | str | Any, given: Path | str | None = None) -> DriveData:
    """Return the drive data of a model from the file ``given``, else from that beside the model, if any."""
    file = drives_file(source, given)
    return DriveData() if file is None else read_drives(file)


def drives_file(source: Path | str | Any, given: Path | str | None) -> Path | None:
    """Return the file of a model's drive data: ``given``, else the one beside the model, else None."""
    if given is not None:
        return Path(given)
    beside = isinstance(source, str | Path) and drives_path(source).is_file()
    return drives_path(source) if beside else None


def import_robot(
    source: Path | str | Any,
    *,
    base: str | None = None,
    tip: str | Sequence[str] | None = None,
    whole_tree: bool = False,
    floating: bool = False,
    drives: DriveData | Path | str | None = None,
    sample_time_s: float | None = None,
) -> Robot:
    """Return the robot of a model file; its attribute `toml` is the equivalent robot file.

    Parameters
    ----------
    source : URDF (``.urdf``, or ``.xml`` with <robot>), MJCF (``.xml``, ``.mjcf``), USD (``.usd``, ``.usda``,
        ``.usdc``, ``.usdz``), a table of Denavit and Hartenberg (``.csv``, ``.toml``), or a
        ``pinocchio.Model``.
    base, tip : first and last link of the chain (bodies in MJCF and USD, joints of a ``pinocchio.Model``). If neither
        they nor the drive data state them, these are the root and the end of the only moving branch. Several
        tips, as a list, give a robot with branches.
    whole_tree : take all moving branches; joints that follow other joints are locked at zero, with a note in
        the robot file. By default, a file with several branches needs a ``tip``.
    floating : give the robot a floating base. It is ``base``, else the body on the free joint of the file, else
        the root, and its frame is that of the body.
    drives : drive data, or their TOML file; by default ``arm.drives.toml`` beside ``arm.urdf``, if there is
        one. Without drive data, gears are rigid with the ratio of the file or 1, and rotors and friction are
        those of the file. There is then a controller only if every joint of an MJCF or USD has position targets.
    sample_time_s : sample time [s] if the drive data state none; by default 1 ms.

    Links on fixed joints are merged with their parents. As in every robot file, frames are parallel to the
    base frame at zero angle. Joint angles are those of the file.

    Raises RobotError, with file, line and element, for everything that is no chain or tree of such joints. Raises
    MissingExtraError for MJCF without MuJoCo, and for USD without usd-core.

    """
    named = Path(source).name if isinstance(source, str | Path) else "a pinocchio.Model"
    if not isinstance(drives, DriveData):
        if (file := drives_file(source, drives)) is not None:
            named += f", drives from {file.name}"
        drives = drive_data(source, drives)
    # Drive data change what the file says.
    unchanged = isinstance(source, str | Path) and drives == DriveData()
    alone = Path(source).resolve() if unchanged else None
    tree, chain = bodies_and_chain(
        source, drives, base=base, tip=tip, whole_tree=whole_tree, floating=floating
    )

    def built(step_s: float | None) -> Robot:
        stated = drives if step_s is None else drives.model_copy(update={"sample_time": step_s})
        try:
            robot = Robot.from_toml(description(chain, stated, named))
            robot = robot.with_torque_constants(torque_constants(chain, stated))
            return robot.as_imported(alone, states_pose=drives.operating_point is not None)
        except RobotError as error:
            raise RobotError(f"{tree.file}: what was made of it is no robot: {error}") from None

    if drives.sample_time is not None:
        return built(None)
    robot = built(sample_time_s)
    return robot if drives.controller is not None else built(step_of_servos(robot))


# Longest step [s] of a controller that holds its command between the samples of a log, and the largest share
# of its speed that a joint may lose by damping in one step; at twice this share it would oscillate.
_SERVO_STEP_S = 2e-3
_SLOWED = 0.4


def step_of_servos(robot: Robot) -> float:
    """Return the sample time [s] of a robot's controller, for position servos divided by a whole number."""
    time = robot.sample_time_s
    if robot.controller_kind != "pd_position":
        return time
    felt = felt_inertia(robot)
    slowing_s = float(np.min(felt / np.maximum(robot.controller_gains["kd"], 1e-300)))
    return float(time / np.ceil(time / min(_SERVO_STEP_S, _SLOWED * slowing_s)))


def felt_inertia(robot: Robot) -> NDArray[np.float64]:
    """Return the inertia (n_axes,) [kg m^2] that each motor accelerates if all other joints are free to move.

    Motor side, at the operating point.
    """
    rest = np.zeros(robot.n_joints)
    rest[robot.axis_joints] = robot.operating_point
    inertia = robot.inertia_matrix(rest)
    for joint in robot.axis_joints:
        drive = robot.joints[joint].drive
        assert drive is not None  # every axis has a drive
        inertia[joint, joint] += drive.motor_inertia / drive.gear_ratio**2
    felt = np.diag(np.linalg.inv(inertia))[robot.axis_joints]
    return np.asarray(robot.gear_ratio**2 / felt)


def bodies_and_chain(
    source: Path | str | Any,
    drives: DriveData,
    *,
    base: str | None = None,
    tip: str | Sequence[str] | None = None,
    whole_tree: bool = False,
    floating: bool = False,
) -> tuple[Tree, Chain]:
    """Return the bodies of a model, and its chain or tree; arguments and errors as in `import_robot`."""
    tree = _tree(Path(source)) if isinstance(source, str | Path) else tree_of(source)
    tip = tip or (None if whole_tree else drives.tip)
    whole_tree = whole_tree or (drives.whole_tree and not tip)
    base = base or drives.base
    return tree, chain_of(tree, base, tip, whole_tree=whole_tree, floating=floating)


def _tree(path: Path) -> Tree:
    """Return the bodies of a file, in the format of its suffix or its root element."""
    if path.suffix.lower() in (".csv", ".toml"):
        return read_dh(path)
    if path.suffix.lower() in USD_SUFFIXES:
        return read_usd(path)
    root = read_xml(path)
    if root.tag == "robot":
        return read_urdf(root, path)
    if root.tag == "mujoco":
        return read_mjcf(root, path)
    raise RobotError(f"{root.where}: expected <robot> (URDF) or <mujoco> (MJCF) as the root")
