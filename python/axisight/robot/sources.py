"""In which format a file says a robot: by its name, and of a TOML by what is in it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from axisight.arguments import shown
from axisight.documents import parse_toml, read_text
from axisight.errors import RobotError

MODEL_SUFFIXES = (".urdf", ".xml", ".mjcf", ".xacro", ".csv")
"""How the names of files end that say a robot in another format."""
# What only tables of Denavit and Hartenberg say of a joint.
_GEOMETRY = ("theta_rad", "d_m", "a_m", "alpha_rad")


def is_model_file(source: Path | str) -> bool:
    """Whether a file says a robot in another format than that of robot files."""
    path = Path(source)
    suffix = path.suffix.lower()
    if suffix != ".toml":
        return suffix in MODEL_SUFFIXES
    try:
        return is_table(read_text(path))
    except (OSError, ValueError):  # those who read it say why
        return False


def is_table(text: str) -> bool:
    """Whether a TOML is a table of Denavit and Hartenberg, or was meant as one.

    It states no schema, but a convention, or joints by theta, d, a or alpha.
    """
    content = _content(text)
    if content is None or "schema" in content:
        return False
    rows = content.get("joint")
    rows = rows if isinstance(rows, list) else []
    return "convention" in content or any(
        isinstance(row, dict) and any(name in row for name in _GEOMETRY) for row in rows
    )


def refuse_neither(text: str, where: str) -> None:
    """Raise RobotError for a TOML that is neither a robot file, in whatever version, nor a table."""
    content = _content(text)
    if content is None or "schema" in content or is_table(text):
        return
    keys = ", ".join(map(shown, list(content)[:5])) or "an empty file"
    raise RobotError(
        f'{where}: expected a robot file (schema = "axisight.robot/2") or a table of Denavit and Hartenberg '
        f'(convention = "standard" or "modified"), got neither, but {keys}'
    )


def _content(text: str) -> Mapping[str, Any] | None:
    """Return what stands in a TOML, None where it is none: its reader says why."""
    try:
        return parse_toml(text)
    except ValueError:
        return None
