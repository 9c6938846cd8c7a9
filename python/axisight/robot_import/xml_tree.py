"""Read XML as plain elements with line numbers, without expanding entities or reading other files."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from axisight.arguments import shown
from axisight.errors import RobotError

# Robots of the largest public collections stay below a tenth of these.
_MOST_BYTES = 50_000_000
_DEEPEST = 200


@dataclass
class Element:
    """An element of a file, with its ``text`` and the ``line`` and byte (``offset``) at which it starts."""

    tag: str
    attributes: dict[str, str]
    file: str
    line: int
    children: list[Element] = field(default_factory=list)
    text: str = ""
    offset: int = 0

    @property
    def where(self) -> str:
        """File, line and element, for messages."""
        name = self.attributes.get("name")
        return f"{self.file}, line {self.line}, <{self.tag}{'' if name is None else f' {name!r}'}>"

    def all(self, tag: str) -> list[Element]:
        """Return the children with a tag."""
        return [child for child in self.children if child.tag == tag]

    def find(self, tag: str) -> Element | None:
        """Return the child with a tag, None without one; raise RobotError for several."""
        found = self.all(tag)
        if len(found) > 1:
            raise RobotError(
                f"{found[1].where}: expected at most one <{tag}> in <{self.tag}>, got {len(found)}"
            )
        return found[0] if found else None

    def walk(self) -> Iterator[Element]:
        """Yield the element and all its descendants, parents first."""
        yield self
        for child in self.children:
            yield from child.walk()

    def require(self, attribute: str, expected: str) -> str:
        """Return the text of an attribute; raise RobotError if it is missing or empty."""
        text = self.attributes.get(attribute, "").strip()
        if not text:
            raise RobotError(f"{self.where}: expected {attribute}, {expected}, got none")
        return text

    def numbers(
        self, attribute: str, count: int, default: tuple[float, ...] | None = None
    ) -> tuple[float, ...]:
        """Return the numbers of an attribute, or ``default`` if it is missing.

        Raises RobotError unless there are ``count`` finite numbers, and for a missing attribute without a
        default.
        """
        expected = "a number" if count == 1 else f"{count} numbers"
        if default is not None and attribute not in self.attributes:
            return default
        text = self.require(attribute, expected)
        try:
            found = tuple(float(part) for part in text.split())
        except ValueError:
            found = ()
        if len(found) != count or not all(map(math.isfinite, found)):
            raise RobotError(f"{self.where}: {attribute}: expected {expected}, got {shown(text)}")
        return found

    def number(self, attribute: str, default: float | None = None) -> float:
        """Return the number of an attribute; default and errors are those of `numbers`."""
        return self.numbers(attribute, 1, None if default is None else (default,))[0]


def read_xml(path: Path) -> Element:
    """Return the root element of an XML file.

    Raises RobotError, with the line, for a file that cannot be read or is not XML. Raises RobotError for a
    document type, because entities are never expanded and no other file is read.
    """
    try:
        with path.open("rb") as file:
            text = file.read(_MOST_BYTES + 1)
    except OSError as error:
        raise RobotError(f"{path}: expected a readable file: {error}") from error
    if len(text) > _MOST_BYTES:
        raise RobotError(f"{path}: expected at most {_MOST_BYTES // 1_000_000} MB")
    return parse_xml(text, str(path))


def parse_xml(text: bytes, name: str) -> Element:
    """Return the root element of an XML text; ``name`` is the file in messages; errors as in `read_xml`."""
    builder = _Builder(name)
    try:
        builder.parser.Parse(text, True)
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        raise RobotError(
            f"{name}, line {error.lineno}{builder.within}: expected XML, got {reason}"
        ) from None
    assert builder.root is not None  # expat refuses a text without a root
    return builder.root


class _Builder:
    def __init__(self, name: str) -> None:
        self.name = name
        self.root: Element | None = None
        self._open: list[Element] = []
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = lambda _: self._open.pop()
        self.parser.CharacterDataHandler = self._text
        self.parser.StartDoctypeDeclHandler = self._document_type

    @property
    def within(self) -> str:
        """The open element, as text for messages; empty at the root."""
        if not self._open:
            return ""
        name = self._open[-1].attributes.get("name")
        return f", within <{self._open[-1].tag}{'' if name is None else f' {name!r}'}>"

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        one = Element(tag, attributes, self.name, self.parser.CurrentLineNumber)
        one.offset = self.parser.CurrentByteIndex
        if len(self._open) >= _DEEPEST:
            raise RobotError(f"{one.where}: expected at most {_DEEPEST} elements in one another")
        if self._open:
            self._open[-1].children.append(one)
        else:
            self.root = one
        self._open.append(one)

    def _text(self, piece: str) -> None:
        self._open[-1].text += piece

    def _document_type(self, *_: object) -> None:
        raise RobotError(
            f"{self.name}, line {self.parser.CurrentLineNumber}: expected no document type (<!DOCTYPE ...>): "
            f"its entities are not expanded; write out what they stand for"
        )
