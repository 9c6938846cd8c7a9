"""The site: its navigation has every page and module, and docstrings and links become what it shows."""

import re
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest
from test_docs import MODULES, load_script


@pytest.fixture
def hooks(repository: Path) -> ModuleType:
    pytest.importorskip("mkdocs", reason="mkdocs comes with the extra `docs`")
    return load_script(repository / "docs" / "site" / "hooks.py")


def test_every_page_and_module_is_in_the_navigation(repository: Path) -> None:
    text = (repository / "mkdocs.yml").read_text(encoding="utf-8")
    nav = text.split("\nnav:\n")[1].split("\ntheme:")[0]
    named = re.findall(r"([\w./]+\.md)$", nav, flags=re.MULTILINE)
    assert len(named) == len(set(named))
    pages = {p.name for p in (repository / "docs").glob("*.md")}
    assert {n for n in named if "/" not in n} == pages
    modules = {f"python/{m.__name__}.md" for m in MODULES}
    assert {n for n in named if n.startswith("python/")} == modules


def test_questions_of_a_reader_are_one_click_away(repository: Path) -> None:
    index = (repository / "docs" / "index.md").read_text(encoding="utf-8")
    for question, place in (
        ("How do I diagnose my bag?", "recordings.md#recordings-of-ros"),
        ("What does *undecidable* mean?", "undecidable.md"),
        ("Which keys does a robot file have?", "robot_files.md#keys"),
        ("How do I add an effect of my own?", "../CONTRIBUTING.md#adding-an-effect"),
    ):
        (row,) = (line for line in index.splitlines() if question in line)
        assert f"]({place})" in row
        page, _, anchor = place.partition("#")
        text = (repository / "docs" / page).read_text(encoding="utf-8")
        headings = re.findall(r"^#+ (.*)$", text, flags=re.MULTILINE)
        assert not anchor or anchor in {h.lower().replace(" ", "-") for h in headings}


def test_nothing_is_fetched(repository: Path) -> None:
    text = (repository / "mkdocs.yml").read_text(encoding="utf-8")
    assert re.search(r"^  font: false$", text, flags=re.MULTILINE)
    assert "  - offline\n" in text
    assert "://" not in text
    script = repository / "docs" / "assets" / "iframe-worker.js"
    assert "iframe-worker" in text
    assert "https" not in script.read_text(encoding="utf-8")


def test_links_that_leave_docs_lead_to_copies(hooks: ModuleType) -> None:
    assert hooks.in_site(hooks.target_of("story.md", "../benches/story.py")) == (
        "repository/benches/story.py.txt"
    )
    assert hooks.in_site(hooks.target_of("reproduce.md", "../thesis")) == (
        "repository/thesis/README.md"
    )
    readme = "repository/README.md"
    assert hooks.in_site(hooks.target_of(readme, "docs/logs.md")) == "logs.md"
    text = "[a](../CONTRIBUTING.md#rules) `b`\n```sh\n[c](../d.md)\n```\n[`e`](../thesis)"
    assert list(hooks.links(text)) == ["../CONTRIBUTING.md", "../thesis"]


def test_what_answers_questions_is_found_before_what_changed(
    hooks: ModuleType, repository: Path
) -> None:
    def found(page: str) -> dict[str, object]:
        asked = SimpleNamespace(file=SimpleNamespace(src_uri=page), meta={})
        hooks.on_page_markdown("text", page=asked)
        return asked.meta["search"]

    assert (
        found("index.md")["boost"] > found("undecidable.md")["boost"] > found("gallery.md")["boost"]
    )
    assert found("repository/CHANGELOG.md")["exclude"] is True
    assert found("index.md")["exclude"] is False
    for page in (*hooks.FIRST, *hooks.NOT_SEARCHED):
        assert (repository / hooks.in_repository(page)).is_file()


def test_docstrings_become_lists(repository: Path) -> None:
    pytest.importorskip("griffe", reason="griffe comes with the extra `docs`")
    script = load_script(repository / "docs" / "site" / "docstrings.py")
    text = (
        "Do it.\n\nParameters\n----------\nrobot, log : which ones,\n    and why.\nn : how often.\n"
    )
    assert script.as_markdown(text) == (
        "Do it.\n\n**Parameters**\n\n- `robot, log`: which ones,\n    and why.\n- `n`: how often."
    )
    assert script.as_markdown("See :class:`axisight.Effect`.") == "See `axisight.Effect`."
