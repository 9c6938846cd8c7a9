"""Edits of an XML text that set attributes and add elements; every other byte stays."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from xml.sax.saxutils import escape

from axisight.errors import RobotError
from axisight.robot_import.xml_tree import Element

# Of attribute values beside those of any text.
_ENTITIES = {'"': "&quot;"}

Numbers = float | Sequence[float] | str

# A start tag, or an element without content.
_TAG = re.compile(rb"<[^\s/>]+(?:\s+[^\s=/>]+\s*=\s*(?:\"[^\"]*\"|'[^']*'))*\s*/?>")


@dataclass
class _Tag:
    """Changes of one start tag: attributes, comments above it, its name."""

    element: Element
    attributes: dict[str, Numbers] = field(default_factory=dict)
    comments: list[str] = field(default_factory=list)
    without: set[str] = field(default_factory=set)
    name: str = ""


@dataclass
class Edits:
    """Changes of one text; positions refer to the original text."""

    text: bytes
    name: str
    _changes: list[tuple[int, int, bytes]] = field(default_factory=list)
    _tags: dict[int, _Tag] = field(default_factory=dict)

    def set(
        self,
        element: Element,
        attributes: Mapping[str, Numbers],
        comment: str = "",
        *,
        without: Collection[str] = (),
        tag: str = "",
    ) -> None:
        """Set attributes of an element, with a comment on the line above; several calls add up.

        ``without``: attributes to remove. ``tag``: new name, for an element without content.
        """
        self._tag(element)
        new = self._tags.setdefault(element.offset, _Tag(element))
        new.attributes |= attributes
        new.without |= set(without)
        new.comments += [comment] if comment else []
        new.name = tag or new.name

    def add(
        self, element: Element, child: str, attributes: Mapping[str, Numbers], comment: str = ""
    ) -> None:
        """Insert a child with attributes as the first of an element, with a comment above it."""
        start, tag = self._tag(element)
        inner = self._indent(start) + b"  "
        made = f"<{child}/>".encode()
        for name, value in attributes.items():
            made = _with(made, name, value)
        more = (inner + _comment(comment) if comment else b"") + inner + made
        end = start + len(tag)
        if not tag.endswith(b"/>"):
            self._replace(end, end, more)
            return
        closed = b"</" + element.tag.encode() + b">"
        self._replace(start, end, tag[:-2].rstrip() + b">" + more + self._indent(start) + closed)

    def add_after(
        self, element: Element, attributes: Mapping[str, Numbers], comment: str = ""
    ) -> None:
        """Insert an element with the same tag and other attributes after one, with a comment above it."""
        start, tag = self._tag(element)
        end = start + len(tag)
        if not tag.endswith(b"/>"):
            closing = self._end(element, start)
            end = self.text.index(b">", closing) + 1
        made = f"<{element.tag}/>".encode()
        for name, value in attributes.items():
            made = _with(made, name, value)
        indent = self._indent(start)
        self._replace(end, end, (indent + _comment(comment) if comment else b"") + indent + made)

    def append(
        self,
        element: Element,
        children: Sequence[tuple[str, Mapping[str, Numbers]]],
        comment: str = "",
        *,
        within: str = "",
    ) -> None:
        """Insert children with attributes as the last of an element, with a comment above the first.

        ``within``: a new element around them.
        """
        start, tag = self._tag(element)
        outer = self._indent(start)
        inner = outer + (b"    " if within else b"  ")
        more = inner + _comment(comment) if comment else b""
        for child, attributes in children:
            made = f"<{child}/>".encode()
            for name, value in attributes.items():
                made = _with(made, name, value)
            more += inner + made
        if within:
            around = within.encode()
            more = outer + b"  <" + around + b">" + more + outer + b"  </" + around + b">"
        if tag.endswith(b"/>"):
            closed = b"</" + element.tag.encode() + b">"
            self._replace(start, start + len(tag), tag[:-2].rstrip() + b">" + more + outer + closed)
            return
        end = self._end(element, start)
        # Blanks before the closing tag stay its indentation.
        end -= len(self.text[start:end]) - len(self.text[start:end].rstrip())
        self._replace(end, end, more)

    def result(self) -> bytes:
        """Return the text with all changes. Raises RobotError for two changes at one place."""
        out, at = [], 0
        for start, end, new in sorted([*self._changes, *map(self._made, self._tags.values())]):
            if start < at:
                raise RobotError(f"{self.name}: expected one change of each element, got two")
            out += [self.text[at:start], new]
            at = end
        return b"".join([*out, self.text[at:]])

    def _made(self, new: _Tag) -> tuple[int, int, bytes]:
        """Return start and end of an element's start tag, and its replacement."""
        start, old = self._tag(new.element)
        made = old
        for name in sorted(new.without):
            made = _attribute(name).sub(b"", made, count=1)
        for name, value in new.attributes.items():
            made = _with(made, name, value)
        end = start + len(old)
        if new.name:
            made = b"<" + new.name.encode() + made[1 + len(new.element.tag.encode()) :]
            if not old.endswith(b"/>"):
                blanks, end = self._closed(new.element, end)
                made += blanks + b"</" + new.name.encode() + b">"
        lead = b"".join(_comment(comment) + self._indent(start) for comment in new.comments)
        return start, end, lead + made

    def _replace(self, start: int, end: int, new: bytes) -> None:
        self._changes.append((start, end, new))

    def _tag(self, element: Element) -> tuple[int, bytes]:
        found = _TAG.match(self.text, element.offset)
        if found is None:
            raise RobotError(f"{element.where}: its text cannot be edited")
        return found.start(), found.group()

    def _closed(self, element: Element, start: int) -> tuple[bytes, int]:
        """Return the text of an element without content that begins at ``start``, and its end."""
        found = re.compile(rb"([^<]*)</[^>]*>").match(self.text, start)
        if found is None:
            raise RobotError(f"{element.where}: expected no content, its text cannot be edited")
        return found.group(1), found.end()

    def _end(self, element: Element, start: int) -> int:
        """Return the place of the closing tag of an element that starts at ``start``, comments skipped."""
        tag = re.escape(element.tag.encode())
        pattern = re.compile(
            rb"<!--.*?-->|<" + tag + rb"(?=[\s/>])[^>]*>|</" + tag + rb"\s*>", re.S
        )
        depth = 0
        for found in pattern.finditer(self.text, start):
            text = found.group()
            if text.startswith(b"<!--"):
                continue
            depth += -1 if text.startswith(b"</") else not text.endswith(b"/>")
            if depth == 0:
                return found.start()
        raise RobotError(f"{element.where}: its text cannot be edited")

    def _indent(self, start: int) -> bytes:
        """Return the line break and indentation before an element; empty if another comes first there."""
        line = self.text.rfind(b"\n", 0, start) + 1
        lead = self.text[line:start]
        return b"\n" + lead if line and not lead.strip() else b"\n"


def _attribute(name: str) -> re.Pattern[bytes]:
    """Return a pattern for an attribute with the blanks before it: name with sign, and value."""
    return re.compile(rb"(\s+" + re.escape(name.encode()) + rb"\s*=\s*)(?:\"[^\"]*\"|'[^']*')")


def _with(tag: bytes, name: str, value: Numbers) -> bytes:
    """Return a start tag with an attribute set."""
    numbers = [value] if isinstance(value, int | float) else value
    text = value if isinstance(value, str) else " ".join(f"{x:.10g}" for x in numbers)
    said = f'"{escape(text, _ENTITIES)}"'.encode()
    known = _attribute(name)
    if known.search(tag):
        return known.sub(lambda m: m.group(1) + said, tag, count=1)
    end = b"/>" if tag.endswith(b"/>") else b">"
    return tag[: -len(end)].rstrip() + b" " + name.encode() + b"=" + said + end


def _comment(text: str) -> bytes:
    # Two hyphens would end the comment.
    return f"<!-- {text.replace('--', '- -')} -->".encode()
