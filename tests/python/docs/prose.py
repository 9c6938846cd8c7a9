"""Counts what the style page asks for: words of sentences, paragraphs and pages.

``python tests/python/docs/prose.py PATH...`` lists the long sentences and paragraphs of pages and sources.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

LONGEST_SENTENCE = 40
LONGEST_PARAGRAPH = 120

_FENCE = re.compile(r"^(\s*)(```|~~~).*?^\1\2\s*$", flags=re.MULTILINE | re.DOTALL)
_COMMENT = re.compile(r"<!--.*?-->", flags=re.DOTALL)
# What ends a sentence: not the point of "e.g.", of a number or of a file's name.
_END = re.compile(
    r"(?<!\be\.g)(?<!\bi\.e)(?<!\bcf)(?<!\bvs)(?<!\bal)(?<!\bno)[.!?](?=[)*_`\"']*\s)"
)
_ITEM = re.compile(r"^\s*([-*+]|\d+[.)])\s+")


def blocks(page: str) -> Iterator[str]:
    """Yield paragraphs and items of lists of a Markdown page; no code, tables, headings, pictures."""
    text = _COMMENT.sub("", _FENCE.sub("\n", page))
    block: list[str] = []
    for line in [*text.splitlines(), ""]:
        bare = line.strip()
        other = not bare or bare.startswith(("|", "#", "![", "<", "!!!"))
        if other or _ITEM.match(line):
            if block:
                yield " ".join(block)
            block = []
        if not other:
            block.append(_ITEM.sub("", bare))


def cells(page: str) -> Iterator[str]:
    """Yield the cells of the tables of a page."""
    for row in re.findall(r"^\s*\|(.*)\|\s*$", _FENCE.sub("\n", page), flags=re.MULTILINE):
        yield from (cell.strip() for cell in re.split(r"(?<!\\)\|", row))


def plain(text: str) -> str:
    """Return text without marks: links are their words, code is one word."""
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text)
    return re.sub(r"`[^`]*`", "code", text).replace("*", "")


def sentences(text: str) -> list[str]:
    """Return the sentences of a paragraph."""
    return [
        s.strip() for s in _END.sub(lambda m: m[0] + "\0", plain(text)).split("\0") if s.strip()
    ]


def words(text: str) -> int:
    """Return how many words a text has; numbers and symbols alone are none."""
    return len(re.findall(r"[A-Za-zÀ-ÿ][\w'’./-]*", plain(text)))


def strings(source: str) -> Iterator[str]:
    """Yield what Python code says: docstrings by paragraph, and texts of messages with "x" for what they are given."""
    parts: set[int] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.JoinedStr):
            parts |= {id(v) for v in node.values}
            yield "".join(v.value if isinstance(v, ast.Constant) else "x" for v in node.values)
        elif (
            isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in parts
        ):
            yield from (" ".join(p.split()) for p in re.split(r"\n\s*\n|\n\s*[-|] ", node.value))


def comments(source: str) -> Iterator[str]:
    """Yield documentation of Rust code by paragraph."""
    lines = [
        re.sub(r"^\s*//[/!]? ?", "", x) if re.match(r"\s*//", x) else ""
        for x in source.splitlines()
    ]
    yield from blocks("\n".join(lines))


def texts(path: Path) -> list[str]:
    """Return the texts of a file by its kind."""
    source = path.read_text(encoding="utf-8")
    by = {".md": blocks, ".py": strings, ".rs": comments}
    return list(by[path.suffix](source))


def long_sentences(path: Path) -> list[tuple[int, str]]:
    """Return the sentences of a file that are too long, with their words."""
    inside = cells(path.read_text(encoding="utf-8")) if path.suffix == ".md" else ()
    each = ((words(s), s) for text in [*texts(path), *inside] for s in sentences(text))
    return [(n, s) for n, s in each if n > LONGEST_SENTENCE]


def reading_ease(page: str) -> float:
    """Return Flesch's reading ease of a page: 206.835 - 1.015 words a sentence - 84.6 syllables a word [1].

    [1] R. Flesch, A new readability yardstick, Journal of Applied Psychology 32, 1948. Syllables are counted as
    groups of vowels, one less for a silent e.
    """
    told = [s for text in blocks(page) for s in sentences(text)]
    found = re.findall(r"[a-z]+", " ".join(told).lower())
    syllables = sum(max(1, len(re.findall(r"[aeiouy]+", re.sub(r"e$", "", w)))) for w in found)
    return 206.835 - 1.015 * len(found) / len(told) - 84.6 * syllables / len(found)


def _tell(path: Path) -> None:
    for n, sentence in long_sentences(path):
        print(f"{path}: {n} words: {sentence}")
    for text in texts(path) if path.suffix == ".md" else []:
        if words(text) > LONGEST_PARAGRAPH:
            print(f"{path}: paragraph of {words(text)} words: {text[:80]}...")


if __name__ == "__main__":
    for name in sys.argv[1:]:
        _tell(Path(name))
