"""Read column maps from files, or by name from the maps shipped with the package."""

from __future__ import annotations

from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path

from pydantic import ValidationError

from axisight.arguments import did_you_mean, shown, usable_path
from axisight.documents import parse_toml, read_text
from axisight.errors import LogError
from axisight.logs.columns import ColumnMap, describe_validation
from axisight.logs.maps import MAPS
from axisight.logs.patterns import ColumnPattern

AnyMap = ColumnMap | ColumnPattern
"""A map for a fixed number of axes, or for any number."""


def parse_column_map(text: str, where: str = "column map") -> AnyMap:
    """Return the column map of the TOML `text`; raise LogError naming `where` and each bad field."""
    try:
        content = parse_toml(text)
        kind = ColumnPattern if "every_axis" in content else ColumnMap
        return kind.model_validate(content)
    except ValidationError as error:
        raise LogError(f"{where}: {describe_validation(error, ColumnMap)}") from error
    except ValueError as error:
        raise LogError(f"{where}: expected TOML, got: {error}") from error


def needs_robot(columns: AnyMap) -> bool:
    """Whether reading needs the robot: for joint-side signals, or for currents without a scale."""
    if isinstance(columns, ColumnPattern):
        torques = columns.every_axis.torque
    else:
        torques = tuple(axis.torque for axis in columns.axis if axis.torque is not None)
    return columns.side == "joint" or any(torque.is_current for torque in torques)


def named_map_text(name: str) -> str:
    """Return the TOML of the shipped map `name`; raise LogError, listing the names, for an unknown one."""
    if name not in MAPS:
        meant = did_you_mean(name, MAPS)
        raise LogError(f"column map: expected one of {', '.join(MAPS)}, got {shown(name)}{meant}")
    return _shipped(name).read_text("utf-8")


def load_column_map(path: Path | str) -> AnyMap:
    """Return the column map in a file, or the shipped map of that name (`ur-rtde`, `franka`, ...).

    Raises LogError when the file cannot be read or is not valid. If the file is missing, the message lists
    the shipped maps.
    """
    if str(path) in MAPS:
        return parse_column_map(named_map_text(str(path)), where=str(path))
    path = usable_path(path, LogError)
    try:
        text = read_text(path)
    except (OSError, UnicodeDecodeError) as error:
        raise LogError(
            f"{path}: column map cannot be read: expected a file or one of {', '.join(MAPS)}: {error}"
            f"{did_you_mean(str(path), MAPS)}"
        ) from error
    return parse_column_map(text, where=str(path))


def column_file(path: Path) -> Path:
    """Return the file that `load_column_map` reads for a path or the name of a shipped map."""
    return Path(str(_shipped(str(path)))) if str(path) in MAPS else path


def _shipped(name: str) -> Traversable:
    return resources.files("axisight.logs.maps") / f"{name}.toml"
