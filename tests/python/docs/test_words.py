"""What the style page asks for and can be counted: sentences, paragraphs, pages, diaries, readability."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from prose import (
    LONGEST_PARAGRAPH,
    LONGEST_SENTENCE,
    blocks,
    cells,
    long_sentences,
    reading_ease,
    sentences,
    texts,
    words,
)

LONGEST_PAGE = 2500
# Tables of everything there is, written by scripts: readers look things up there.
GENERATED = {
    "cli.md",
    "constants.md",
    "effects.md",
    "gallery.md",
    "mujoco_homes.md",
    "plots.md",
    "verdict.md",
}
# What a newcomer reads first.
BEGINNERS = ("index", "start_diagnose", "start_identify", "start_simulate", "ten_minutes", "floor")
# Flesch calls 60 to 70 plain English, 50 to 60 fairly difficult; field terms have many syllables.
PLAIN = 55.0
# Where single cases of the benchmark may be told.
DIARY = re.compile(r"\b(seed|case)s? \d{2,}|\bsince then\b|\bused to be\b", re.IGNORECASE)


def pages(repository: Path) -> list[Path]:
    return [*sorted((repository / "docs").glob("*.md")), *sorted(repository.glob("*.md"))]


def share_of_long(paths: list[Path]) -> tuple[float, list[str]]:
    """Return the share of sentences that are too long [1], and these."""
    told = sum(len(sentences(text)) for path in paths for text in texts(path))
    long = [f"{p.name}: {n} words: {s}" for p in paths for n, s in long_sentences(p)]
    return len(long) / told, long


def test_long_sentences_are_rare_in_pages(repository: Path) -> None:
    share, long = share_of_long(pages(repository))
    assert share <= 0.01, "\n".join(long)


@pytest.mark.parametrize("package", ["python", "thesis"])
def test_long_sentences_are_rare_in_docstrings_and_messages(package: str, repository: Path) -> None:
    share, long = share_of_long(sorted((repository / package).rglob("*.py")))
    assert share <= 0.01, "\n".join(long)


def test_long_sentences_are_rare_in_the_documentation_of_the_core(repository: Path) -> None:
    share, long = share_of_long(sorted((repository / "crates").rglob("*.rs")))
    assert share <= 0.01, "\n".join(long)


def test_paragraphs_are_short(repository: Path) -> None:
    long = [
        f"{path.name}: {words(text)} words: {text[:80]}"
        for path in pages(repository)
        for text in blocks(path.read_text("utf-8"))
        if words(text) > LONGEST_PARAGRAPH
    ]
    assert not long, "\n".join(long)


def test_pages_are_short(repository: Path) -> None:
    long = {
        path.name: n
        for path in pages(repository)
        if path.name not in GENERATED
        and (n := sum(map(words, [*texts(path), *cells(path.read_text("utf-8"))]))) > LONGEST_PAGE
    }
    assert not long


def test_generated_pages_are_made_by_scripts(repository: Path) -> None:
    """No page is long by being called generated."""
    made = {
        f"{path.stem.removeprefix('make_')}.md" for path in (repository / "docs").glob("make_*.py")
    }
    assert made >= GENERATED


@pytest.mark.parametrize("name", BEGINNERS)
def test_pages_of_beginners_are_easy_to_read(name: str, repository: Path) -> None:
    page = (repository / "docs" / f"{name}.md").read_text("utf-8")
    assert reading_ease(page) > PLAIN


def test_pages_tell_no_diary(repository: Path) -> None:
    told = [
        f"{path.name}: {found[0]}: {text[:80]}"
        for path in pages(repository)
        if path.name not in {"truth.md", "CHANGELOG.md", "style.md"}
        for text in [*texts(path), *cells(path.read_text("utf-8"))]
        if (found := DIARY.search(text))
    ]
    assert not told, "\n".join(told)


def test_prose_is_counted_as_a_reader_would() -> None:
    page = (
        "# A title that is no sentence\n\nOne [link](page.md#there) here. Two, e.g. `a b c`, as 1.5 mm.\n"
        "- an item\n\n```sh\ncode is none\n```\n\n| a | b and c |\n|---|---|\n"
    )
    first, item = blocks(page)
    assert sentences(first) == ["One link here.", "Two, e.g. code, as 1.5 mm."]
    assert [words(s) for s in sentences(first)] == [3, 5]
    assert item == "an item"
    assert [c for c in cells(page) if c] == ["a", "b and c", "---", "---"]


def test_a_long_sentence_is_seen(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(f"Short. {'word ' * (LONGEST_SENTENCE + 1)}.\n\n| {'cell ' * 50}. | b |\n")
    assert [n for n, _ in long_sentences(page)] == [LONGEST_SENTENCE + 1, 50]
    source = tmp_path / "source.py"
    source.write_text(f'raise ValueError(f"{"word " * 45}{{1}}")\n')
    assert [n for n, _ in long_sentences(source)] == [46]


def test_easy_words_in_short_sentences_read_easily() -> None:
    easy = reading_ease("The cat sat on the mat. It was warm.")
    hard = reading_ease(
        "Identification necessitates multidimensional parametrization considerations."
    )
    assert easy > 100 > 0 > hard
