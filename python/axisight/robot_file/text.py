"""Replace numbers and add comments in a TOML document, and keep every other character."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import tomlkit
from tomlkit import items
from tomlkit.exceptions import TOMLKitError

from axisight.errors import RobotError

Key = tuple[str | int, ...]


def edited(text: str, numbers: Mapping[Key, float], comments: Mapping[Key, Sequence[str]]) -> str:
    """Return ``text`` with new numbers at some places, and comments above some statements.

    numbers
        Numbers by place: names of tables and keys, and numbers from 0 for items and tables of an array.
        A number equal to the old one keeps its text; 0.0 and -0.0 are not equal here.
    comments
        Whole lines, beginning with ``#``, by place. They go above the statement of that place, with the same
        indentation.

    Raises RobotError for a text that is not TOML, or that tomlkit cannot reproduce exactly.
    """
    try:
        document = tomlkit.parse(text)
    except TOMLKitError as error:
        raise RobotError(f"source: expected TOML, got {error}") from error
    if document.as_string() != text:
        raise RobotError("source: its text cannot be kept; write it in plain TOML tables")
    for place, number in numbers.items():
        owner = at(document, place[:-1])
        if not same(float(owner[place[-1]]), number):
            owner[place[-1]] = items.Float(number, items.Trivia(), repr(number))
    above: dict[int, tuple[Any, list[str]]] = {}
    for place, lines in comments.items():
        statement = _statement(document, place)
        above.setdefault(id(statement), (statement, []))[1].extend(lines)
    for statement, lines in above.values():
        lead = statement.trivia.indent
        statement.trivia.indent = "".join(f"{lead}{line}\n" for line in lines) + lead
    return document.as_string()


def same(a: float, b: float) -> bool:
    """Whether two numbers are equal, including the sign of zero."""
    return a == b and math.copysign(1, a) == math.copysign(1, b)


def at(document: Any, place: Key) -> Any:
    """Return the value at a place of a document."""
    for part in place:
        document = document[part]
    return document


def _statement(document: Any, place: Key) -> Any:
    """Return the value of the statement ``key = value`` that contains a place."""
    node = document
    for part in place:
        node = node[part]
        if not isinstance(node, (items.Table, items.AoT, tomlkit.container.OutOfOrderTableProxy)):
            break
    return node
