"""Recognize the format of a file with a robot, by its suffix and, for TOML, by its content."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from axisight.arguments import shown
from axisight.documents import parse_toml, read_text
from axisight.errors import RobotError

USD_SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
"""Suffixes of USD files."""
MODEL_SUFFIXES = (".urdf", ".xml", ".mjcf", ".xacro", ".csv", *USD_SUFFIXES)
"""Suffixes of model files: robots in another format than that of robot files."""
# Keys of a joint that occur only in tables of Denavit and Hartenberg.
_GEOMETRY = ("theta_rad", "d_m", "a_m", "alpha_rad")


def is_model_file(source: Path | str) -> bool:
    """Whether a file is a model file: a robot in another format than that of robot files."""
    path = Path(source)
    suffix = path.suffix.lower()
    if suffix != ".toml":
        return suffix in MODEL_SUFFIXES
    try:
        return is_table(read_text(path))
    except (OSError, ValueError):  # the reader of the file reports the reason
        return False


def is_table(text: str) -> bool:
    """Whether a TOML text is, or was meant as, a table of Denavit and Hartenberg.

    Such a table has no schema, but a convention, or joints with theta, d, a or alpha.
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
    """Raise RobotError for a TOML text that is neither a robot file of any version nor a DH table."""
    content = _content(text)
    if content is None or "schema" in content or is_table(text):
        return
    keys = ", ".join(map(shown, list(content)[:5])) or "an empty file"
    raise RobotError(
        f'{where}: expected a robot file (schema = "axisight.robot/2") or a table of Denavit and Hartenberg '
        f'(convention = "standard" or "modified"), got neither, but {keys}'
    )


def _content(text: str) -> Mapping[str, Any] | None:
    """Return the content of a TOML text; None if it is not TOML, which its reader reports."""
    try:
        return parse_toml(text)
    except ValueError:
        return None
