"""The modelled remainder of a robot file: its table ``[remainder]``."""

from __future__ import annotations

from functools import lru_cache

import tomlkit

from axisight.arguments import instance
from axisight.documents import parse_toml
from axisight.errors import InputError, RobotError
from axisight.remainder import Remainder
from axisight.remainder.table_file import remainder_of, remainder_table

_KEY = "remainder"


@lru_cache(maxsize=16)
def stated_remainder(text: str, n_axes: int) -> Remainder | None:
    """Return the remainder in the text of a robot file; None without.

    Raises RobotError that names the key, also for a remainder of another number of axes.
    """
    # A text without this word needs no second parsing.
    given = parse_toml(text).get(_KEY) if _KEY in text else None
    if given is None:
        return None
    if not isinstance(given, dict):
        raise RobotError(f"{_KEY}: expected a table, got {type(given).__name__}")
    try:
        found = remainder_of(given, _KEY)
    except InputError as error:
        raise RobotError(str(error)) from None
    if found.n_axes != n_axes:
        raise RobotError(
            f"{_KEY}: limits_nm: expected {n_axes} numbers, one for each driven joint, got {found.n_axes}"
        )
    return found


def refuse_remainder(remainder: Remainder | None, what: str) -> None:
    """Raise InputError for a robot with a remainder, which ``what`` cannot take into account."""
    if remainder is not None:
        raise InputError(
            f"robot: expected one without a remainder for {what}, got one of {len(remainder.terms)} terms; "
            "robot.with_remainder(None) is without it"
        )


def described_with_remainder(text: str, remainder: Remainder | None, n_axes: int) -> str:
    """Return the text of a robot file with a remainder in place of its own; None removes it.

    A file with a remainder is of version 2. Comments and all other text stay. Raises InputError for a remainder of
    another number of axes.
    """
    if remainder is None and stated_remainder(text, n_axes) is None:
        return text
    document = tomlkit.parse(text)
    document.pop(_KEY, None)
    if remainder is not None:
        if instance("remainder", remainder, Remainder).n_axes != n_axes:
            raise InputError(f"remainder: expected one of {n_axes} axes, got {remainder.n_axes}")
        document["schema"] = "axisight.robot/2"
        document[_KEY] = remainder_table(remainder)
    return tomlkit.dumps(document)
