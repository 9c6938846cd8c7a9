"""Suggest a name for an unknown one: the nearest of those in the error message, or of the files beside."""

from __future__ import annotations

import re
from itertools import islice
from pathlib import Path

from axisight.arguments import nearest

# In error messages the unknown name is quoted, and the known names are separated by commas.
_QUOTED = r"['\"`](?P<got>[^'\"`]+)['\"`]"
_KNOWN = r"(?P<known>[^:;'\"`()]+?)"
_CHOICES = (
    re.compile(rf"expected one of {_KNOWN}(?: or a matrix|, or one of [^']*)?, got {_QUOTED}"),
    re.compile(rf"expected (?:a file or )?one of {_KNOWN}: [^:]*: {_QUOTED}"),
    re.compile(rf"{_QUOTED}[:;] expected one of {_KNOWN}(?:$|[;(])"),
    re.compile(rf"expected a column named {_QUOTED}, got {_KNOWN}(?:$|[;:(])"),
    re.compile(rf"nput should be (?P<known>'[^;]+?'), got {_QUOTED}"),
    re.compile(r"^(?P<got>[^:]+): expected a robot description or a preset \((?P<known>[^)]+)\)"),
)
_FILES = (
    re.compile(r"No such file or directory: '(?P<path>[^']+)'"),
    re.compile(r"(?:^|file: )(?P<path>[^:]+): expected [^:]*, got nothing"),
)
# Longer messages are cut, and larger folders searched in part only.
_LONGEST = 20_000
_MOST_FILES = 10_000


def suggestion(message: str) -> str | None:
    """Return the name that was probably meant, from an error message about an unknown name.

    The result is None if no name is near, or if the message already has a suggestion.
    """
    message = message[:_LONGEST]
    if "did you mean" in message.lower():
        return None
    for pattern in _CHOICES:
        if found := pattern.search(message):
            known = re.split(r",\s*|\s+or\s+", found["known"])
            near = nearest(found["got"], [name.strip("'\"` ") for name in known])
            if near is not None:
                return near
    for pattern in _FILES:
        if found := pattern.search(message):
            return _file_beside(Path(found["path"]))
    return None


def _file_beside(path: Path) -> str | None:
    """Return the path with the nearest name in the same folder; None without one."""
    try:
        if path.exists():
            return None
        names = [entry.name for entry in islice(path.parent.iterdir(), _MOST_FILES)]
    except (OSError, ValueError):
        return None
    near = nearest(path.name, [name for name in names if not name.startswith(".")])
    return None if near is None else str(path.with_name(near))
