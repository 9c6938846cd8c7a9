"""Every number that the diagnosis has as a constant, with what it rests on: ``python -m axisight.gap.constants``."""

from __future__ import annotations

import ast
import io
import tokenize
from collections.abc import Iterator
from dataclasses import dataclass, fields
from pathlib import Path

from axisight.gap.facts.settings import Settings

_ROOT = Path(__file__).parent


@dataclass(frozen=True)
class Constant:
    """A constant, a name in capitals at the level of a module.

    Where it stands, its name, its value as written, and the words beside it.
    """

    place: str
    name: str
    value: str
    words: str


def constants(root: Path = _ROOT) -> list[Constant]:
    """Return the constants of all files below ``root``, file by file."""
    paths = sorted(p for p in root.rglob("*.py") if p.name != "__init__.py")
    return [c for path in paths for c in _of_file(path, path.relative_to(root).as_posix())]


def settings() -> list[Constant]:
    """Return the numbers that a user may set, with their defaults."""
    return [
        Constant(
            "facts/settings.py",
            f"Settings.{f.name}",
            repr(f.default),
            "May be set: see `Settings`.",
        )
        for f in fields(Settings)
        if isinstance(f.default, int | float)
    ]


def _of_file(path: Path, place: str) -> Iterator[Constant]:
    text = path.read_text("utf-8")
    comments = _comments(text)
    body = ast.parse(text).body
    for node, after in zip(body, [*body[1:], None], strict=True):
        target = _target(node)
        value = getattr(node, "value", None)
        if target is None or value is None:
            continue
        if any(map(_is_number, ast.walk(value))):
            words = _docstring(after) or _above(comments, node.lineno)
            yield Constant(place, target, ast.unparse(value), words)


def _target(node: ast.stmt) -> str | None:
    """Return the names in capitals that a statement binds, as written; None where there are none."""
    if isinstance(node, ast.Assign):
        target = node.targets[0]
    elif isinstance(node, ast.AnnAssign):
        target = node.target
    else:
        return None
    names = [n.id for n in ast.walk(target) if isinstance(n, ast.Name)]
    return ", ".join(names) if names and all(n.strip("_").isupper() for n in names) else None


def _is_number(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)


def _docstring(node: ast.stmt | None) -> str:
    """Return the text that stands as a statement of its own; empty where it is none."""
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        return " ".join(str(node.value.value).split())
    return ""


def _comments(text: str) -> dict[int, str]:
    """Return comments by line."""
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    return {t.start[0]: t.string.lstrip("# ") for t in tokens if t.type == tokenize.COMMENT}


def _above(comments: dict[int, str], line: int) -> str:
    """Return the comment beside a line, or else above it or above the constants that it follows."""
    if line in comments:
        return comments[line]
    while line > 1 and line - 1 not in comments:
        line -= 1
        if _ends(line, comments):
            return ""
    words = []
    while line - 1 in comments:
        line -= 1
        words.append(comments[line])
    return " ".join(reversed(words))


def _ends(line: int, comments: dict[int, str]) -> bool:
    """Whether no comment stands within ten lines above."""
    return all(line - k not in comments for k in range(10))


def main() -> None:
    """Print each constant on a line, and what it rests on below."""
    for one in [*settings(), *constants()]:
        print(f"{one.place}: {one.name} = {one.value}\n    {one.words}")


if __name__ == "__main__":
    main()
