"""Paths that an operating system can be asked about at all."""

from __future__ import annotations

from pathlib import Path

from axisight.arguments import short
from axisight.errors import InputError, LogError

_LONGEST_NAME = 255
_LONGEST_PATH = 4000


def usable_path(path: Path | str, kind: type[InputError] = LogError, field: str = "") -> Path:
    """Return a path; raises an error of ``kind`` for one that no file can have.

    Asked about such names, the system raises instead of saying that there is no such file.
    """
    path = Path(path)
    where = f"{field}: " if field else ""
    if "\0" in str(path):
        raise kind(f"{where}expected the name of a file, got {short(repr(str(path)[:100]))}")
    too_long = any(_bytes(part) > _LONGEST_NAME for part in path.parts)
    if too_long or _bytes(str(path)) > _LONGEST_PATH:
        raise kind(f"{where}expected a shorter name of a file, got {short(str(path))}")
    return path


def _bytes(text: str) -> int:
    return len(text.encode("utf-8", "replace"))
