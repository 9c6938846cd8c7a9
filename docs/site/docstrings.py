"""Docstrings as Markdown: sections, lists of arguments and references to other names."""

from __future__ import annotations

import re
from typing import Any

import griffe

SECTION = re.compile(r"^(\w[\w ]*)\n-{3,}\n", re.MULTILINE)
ENTRY = re.compile(r"^([*\w][\w, *.]*?) : ", re.MULTILINE)
ROLE = re.compile(r":(?:class|func|meth|mod|attr|data|exc|doc):`~?\.?([^`]+)`")


def as_markdown(text: str) -> str:
    """Return a docstring in which sections are bold words and entries a list."""
    text = ROLE.sub(r"`\1`", text).replace("``", "`")
    head, *parts = SECTION.split(text)
    out = [literal_blocks(head)]
    for title, body in zip(parts[::2], parts[1::2], strict=True):
        out.append(f"**{title}**\n\n{entries(body)}")
    return "\n\n".join(part.strip("\n") for part in out)


def entries(body: str) -> str:
    """Return lines ``name : meaning`` as a list, lines below them as their continuation."""
    lines = []
    for line in body.strip("\n").splitlines():
        match = ENTRY.match(line)
        lines.append(f"- `{match[1]}`: {line[match.end() :]}" if match else line)
    return "\n".join(lines)


def literal_blocks(text: str) -> str:
    """Return a text in which ``::`` before an indented block is a colon."""
    return re.sub(r"::(?=\n\n {4})", ":", text)


class Markdown(griffe.Extension):
    """Rewrites every docstring that is read."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Rewrite one."""
        if obj.docstring is not None:
            obj.docstring.value = as_markdown(obj.docstring.value)
