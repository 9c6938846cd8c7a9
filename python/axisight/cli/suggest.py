"""One suggestion for a name that is not there: the nearest of those that an error lists, or of the files beside."""

from __future__ import annotations

import re
from itertools import islice
from pathlib import Path

from axisight.arguments import nearest

# As errors say it: names in quotes, those that there are with commas between.
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
# Longer texts are no list of names, and names longer than this nobody types.
_LONGEST = 20_000
_MOST_FILES = 10_000


def suggestion(message: str) -> str | None:
    """Return the name that was meant where an error says that one is not there; None where none is near.

    None too where the message makes a suggestion itself.
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
    """Return the path of what is in the same folder under a name like it."""
    try:
        if path.exists():
            return None
        names = [entry.name for entry in islice(path.parent.iterdir(), _MOST_FILES)]
    except (OSError, ValueError):
        return None
    near = nearest(path.name, [name for name in names if not name.startswith(".")])
    return None if near is None else str(path.with_name(near))
