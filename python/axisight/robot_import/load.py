"""Model files by their kind."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from axisight.errors import RobotError
from axisight.robot.robot import MODEL_SUFFIXES, Robot
from axisight.robot_import.bodies import Tree
from axisight.robot_import.chain import Chain, chain_of
from axisight.robot_import.description import description
from axisight.robot_import.dh import read_dh
from axisight.robot_import.drives import DriveData, read_drives
from axisight.robot_import.mjcf import read_mjcf
from axisight.robot_import.pinocchio_model import tree_of
from axisight.robot_import.urdf import read_urdf
from axisight.robot_import.xml_tree import read_xml


def is_model_file(source: Path | str) -> bool:
    """Whether a file is one of those that `import_robot` reads, by its name."""
    return Path(source).suffix.lower() in MODEL_SUFFIXES


def drives_path(source: Path | str) -> Path:
    """Return where drive data of a model file stand: ``arm.drives.toml`` beside ``arm.urdf``."""
    path = Path(source)
    return path.with_name(f"{path.stem}.drives.toml")


def drive_data(source: Path | str | Any, given: Path | str | None = None) -> DriveData:
    """Return the drive data of a model: those ``given``, else those beside its file, if there are any."""
    if given is not None:
        return read_drives(Path(given))
    if isinstance(source, str | Path) and drives_path(source).is_file():
        return read_drives(drives_path(source))
    return DriveData()


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
        and Hartenberg (``.csv``), or a ``pinocchio.Model``.
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
    is_file = isinstance(source, str | Path)
    if not isinstance(drives, DriveData):
        drives = drive_data(source, drives)
    tree, chain = bodies_and_chain(source, drives, base=base, tip=tip)
    if drives.sample_time is None:
        drives = drives.model_copy(update={"sample_time": sample_time_s})
    text = description(chain, drives, Path(source).name if is_file else "a pinocchio.Model")
    try:
        return Robot.from_toml(text)
    except RobotError as error:
        raise RobotError(f"{tree.file}: what was made of it is no robot: {error}") from None


def bodies_and_chain(
    source: Path | str | Any, drives: DriveData, *, base: str | None = None, tip: str | None = None
) -> tuple[Tree, Chain]:
    """Return what a model has, and the chain that is made of it; arguments as for `import_robot`."""
    tree = _tree(Path(source)) if isinstance(source, str | Path) else tree_of(source)
    return tree, chain_of(tree, base or drives.base, tip or drives.tip)


def _tree(path: Path) -> Tree:
    """Return the bodies of a file, read as what it says it is."""
    if path.suffix.lower() == ".csv":
        return read_dh(path)
    root = read_xml(path)
    if root.tag == "robot":
        return read_urdf(root, path)
    if root.tag == "mujoco":
        return read_mjcf(root, path)
    raise RobotError(f"{root.where}: expected <robot> (URDF) or <mujoco> (MJCF) as the root")
