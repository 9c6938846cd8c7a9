"""Where the values of a TOML document stand in its text, so that one can be replaced alone.

The scanner trusts that ``tomllib`` has accepted the text, and its result is checked against
``tomllib`` by whoever edits with it.
"""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass

Path = tuple[str | int, ...]

_SPACE = re.compile(r"[ \t]*")
_BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_BARE = re.compile(r"[A-Za-z0-9_-]+")
_STRINGS = (
    re.compile(r'"""(?:[^\\]|\\.)*?"""(?:"{0,2})', re.DOTALL),
    re.compile(r"'''.*?'''(?:'{0,2})", re.DOTALL),
    re.compile(r'"(?:[^"\\\n]|\\.)*"'),
    re.compile(r"'[^'\n]*'"),
)
_PLAIN = re.compile(r"[^,\]}#\r\n]+")


@dataclass(frozen=True)
class Span:
    """Text from ``start`` to ``end`` is the value; ``line`` is where its statement starts."""

    start: int
    end: int
    line: int


class _Scanner:
    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0
        self.line = 0
        self.spans: dict[Path, Span] = {}
        self.counts: dict[Path, int] = {}

    def document(self) -> dict[Path, Span]:
        table: Path = ()
        while True:
            self._skip(_BLANK)
            if self.at >= len(self.text):
                return self.spans
            self.line = self.text.rfind("\n", 0, self.at) + 1
            if self.text.startswith("[[", self.at):
                self.at += 2
                table = self._entered(self._key())
                self.counts[table] = self.counts.get(table, -1) + 1
                table = (*table, self.counts[table])
                self._past("]]")
            elif self.text[self.at] == "[":
                self.at += 1
                table = self._entered(self._key())
                self._past("]")
            else:
                self._pair(table)

    def _entered(self, key: list[str]) -> Path:
        """Return the path of a header, going into the last table of every array on the way."""
        path: Path = ()
        for i, part in enumerate(key):
            path = (*path, part)
            if i + 1 < len(key) and path in self.counts:
                path = (*path, self.counts[path])
        return path

    def _pair(self, table: Path) -> None:
        path = (*table, *self._key())
        self._past("=")
        self._skip(_SPACE)
        self._value(path)

    def _value(self, path: Path) -> None:
        start = self.at
        opening = self.text[self.at]
        if opening == "[":
            self._items(path)
        elif opening == "{":
            self._members(path)
        elif opening in "\"'":
            self._skip_string()
        else:
            self._skip(_PLAIN)
            while self.text[self.at - 1] in " \t":
                self.at -= 1
        self.spans[path] = Span(start, self.at, self.line)

    def _items(self, path: Path) -> None:
        self.at += 1
        for index in range(len(self.text)):
            self._skip(_BLANK)
            if self.text[self.at] != "]":
                self._value((*path, index))
                self._skip(_BLANK)
            if self.text[self.at] == ",":
                self.at += 1
            elif self.text[self.at] == "]":
                self.at += 1
                return

    def _members(self, path: Path) -> None:
        self.at += 1
        while True:
            self._skip(_BLANK)
            if self.text[self.at] == "}":
                self.at += 1
                return
            if self.text[self.at] == ",":
                self.at += 1
                continue
            self._pair(path)

    def _key(self) -> list[str]:
        parts = []
        while True:
            self._skip(_SPACE)
            start = self.at
            if self.text[self.at] in "\"'":
                self._skip_string()
                parts.append(str(tomllib.loads(f"x = {self.text[start : self.at]}")["x"]))
            else:
                self._skip(_BARE)
                parts.append(self.text[start : self.at])
            self._skip(_SPACE)
            if self.text[self.at] != ".":
                return parts
            self.at += 1

    def _skip(self, pattern: re.Pattern[str]) -> None:
        found = pattern.match(self.text, self.at)
        if found is not None:
            self.at = found.end()

    def _skip_string(self) -> None:
        for pattern in _STRINGS:
            found = pattern.match(self.text, self.at)
            if found is not None:
                self.at = found.end()
                return

    def _past(self, mark: str) -> None:
        self._skip(_SPACE)
        self.at = self.text.index(mark, self.at) + len(mark)


def value_spans(text: str) -> dict[Path, Span]:
    """Return the span of every value, arrays and inline tables included, by its path.

    ``text`` must be valid TOML. Tables of an array and items of an array are counted from 0.
    """
    return _Scanner(text).document()
