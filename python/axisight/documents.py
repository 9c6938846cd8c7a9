"""Read TOML and JSON from strangers, and refuse documents that are too long or too deeply nested."""

from __future__ import annotations

import errno
import json
import math
import re
import tomllib
from pathlib import Path
from typing import Any

from axisight.arguments import short

_LONGEST = 32 * 2**20
_MOST_PARTS = 32
# Parsing a dotted key takes time that grows at least with the square of its number of parts.
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+"""
_DOTTED = re.compile(rf"(?<![\w-])(?:{_PART}){{{_MOST_PARTS}}}")


def read_text(path: Path) -> str:
    """Return the text of a document; raise OSError if it is too long, as a device may never end."""
    with path.open(encoding="utf-8") as file:
        text = file.read(_LONGEST + 1)
    if len(text) > _LONGEST:
        raise OSError(errno.EFBIG, f"expected at most {_LONGEST} characters")
    return text


def parse_toml(text: str) -> dict[str, Any]:
    """Return the content of a TOML document; raise ValueError with a short message for any other text."""
    if len(text) > _LONGEST:
        raise ValueError(f"expected at most {_LONGEST} characters, got {len(text)}")
    if found := _DOTTED.search(text):
        raise ValueError(
            f"expected keys of fewer than {_MOST_PARTS} parts, got {short(found.group())}"
        )
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("expected values in fewer brackets, got some nested too deep") from None
    except ValueError as error:  # from tomllib, and from int() for thousands of digits
        raise ValueError(_cut(str(error))) from None


def parse_json(text: str) -> Any:
    """Return the content of a JSON document; raise ValueError with a short message for any other text."""
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("expected values in fewer brackets, got some nested too deep") from None
    except ValueError as error:
        raise ValueError(_cut(str(error))) from None


def _cut(said: str) -> str:
    """Return a parser's message with its middle cut out, because the place of the fault is at the end."""
    return said if len(said) <= 200 else f"{said[:80]} ... {said[-60:]}"


def finite(value: Any) -> Any:
    """Return a document with None in place of NaN and infinities, which JSON cannot express."""
    if isinstance(value, dict):
        return {key: finite(v) for key, v in value.items()}
    if isinstance(value, list | tuple):
        return [finite(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
