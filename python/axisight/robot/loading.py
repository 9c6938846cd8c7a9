"""Loads robots from files and presets."""

from __future__ import annotations

from importlib import import_module, resources
from pathlib import Path

from axisight.arguments import did_you_mean, usable_path
from axisight.documents import read_text
from axisight.errors import RobotError
from axisight.robot.presets import PRESETS
from axisight.robot.robot import Robot
from axisight.robot.sources import is_model_file, refuse_neither


def load_robot(source: Path | str, *, sample_time_s: float | None = None) -> Robot:
    """Return the robot of a ``source``: a TOML file, a model file (URDF, MJCF, USD, DH table) or a preset.

    Presets: ``irb6600_like`` (20 states) and ``two_mass_axis`` (thesis Table 9.1,
    model m3, with its cubic spring and Coulomb friction). `axisight.robot_import.import_robot` reads model
    files. ``sample_time_s`` [s] is for a model file whose drive data state no sample time; robot files
    state their own. Raises RobotError naming file, line, key and expectation.
    """
    if isinstance(source, str) and source in PRESETS:
        text = (resources.files("axisight.robot.presets") / f"{source}.toml").read_text("utf-8")
        return Robot.from_toml(text)
    path = usable_path(source, RobotError)
    # Imported here, as `robot_import` itself imports this package, and its readers load slowly.
    if is_model_file(path):
        found: Robot = import_module("axisight.robot_import").import_robot(
            path, sample_time_s=sample_time_s
        )
        return found
    try:
        text = read_text(path)
    except (OSError, UnicodeDecodeError) as error:
        known = ", ".join(PRESETS)
        meant = did_you_mean(source, PRESETS)
        raise RobotError(
            f"{path}: expected a robot description or a preset ({known}): {error}{meant}"
        ) from error
    refuse_neither(text, str(path))
    try:
        return Robot.from_toml(text)
    except RobotError as error:
        raise RobotError(f"{path}: {error}") from None
