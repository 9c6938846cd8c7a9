"""What the site needs beside the pages in docs/.

Pages link to files of the repository outside docs/, as a code host shows them. Those files are part
of the site too, under ``repository/``: Markdown as pages, the rest as it is. Links to folders lead to
their README. The Python reference has a page a module, under ``python/``.
"""

from __future__ import annotations

import base64
import hashlib
import os
import posixpath
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parents[2]
OUTSIDE = "repository/"
# Of these only what pages link to; text that a browser shows keeps its name with ``.txt`` behind it.
SHOWN_AS_TEXT = {".py", ".toml", ".yml"}
# What the search puts first of equals: the page of questions, then what answers them. What changed is
# no answer.
FIRST = {
    "index.md": 12,
    "start_diagnose.md": 2,
    "ten_minutes.md": 2,
    "undecidable.md": 10,
    "robot_files.md": 2,
    OUTSIDE + "CONTRIBUTING.md": 2,
}
NOT_SEARCHED = {OUTSIDE + "CHANGELOG.md"}
LINK = re.compile(r"(!?\[(?:[^\[\]]|\[[^\[\]]*\])*\]\()([^)#\s]+)([^)]*\))")
SCRIPT = re.compile(r"<script>(.*?)</script>", re.DOTALL)
# What a page may load: what the site has, from a server or from a folder.
OWN = "'self' file:"
CODE = re.compile(r"(^```.*?^```)", re.DOTALL | re.MULTILINE)


def links(text: str) -> Iterator[str]:
    """Targets of the links of a page that are no addresses."""
    for part in CODE.split(text)[::2]:
        for _, target, _ in LINK.findall(part):
            if "://" not in target and not target.startswith("mailto:"):
                yield target


def in_repository(page: str) -> str:
    """Where a page of the site is in the repository."""
    return page.removeprefix(OUTSIDE) if page.startswith(OUTSIDE) else f"docs/{page}"


def in_site(path: str) -> str:
    """Where a file or folder of the repository is in the site."""
    if path.startswith("docs/"):
        return path.removeprefix("docs/")
    if (ROOT / path).is_dir():
        path = posixpath.join(path, "README.md")
    return OUTSIDE + path + (".txt" if Path(path).suffix in SHOWN_AS_TEXT else "")


def target_of(page: str, target: str) -> str:
    """The path in the repository that a link of a page means."""
    return posixpath.normpath(posixpath.join(posixpath.dirname(in_repository(page)), target))


def outside(pages: dict[str, str]) -> dict[str, str]:
    """Files outside docs/ that pages link to, and those that these link to: place in the site, path."""
    found: dict[str, str] = {}
    to_read = list(pages.items())
    while to_read:
        page, text = to_read.pop()
        for target in links(text):
            path = target_of(page, target)
            place = in_site(path)
            if not place.startswith(OUTSIDE) or place in found or place in pages:
                continue
            source = ROOT / path
            if source.is_dir():
                path, source = posixpath.join(path, "README.md"), source / "README.md"
            if source.is_file():  # what is not there is a warning of the build
                found[place] = path
                if place.endswith(".md"):
                    to_read.append((place, source.read_text(encoding="utf-8")))
    return found


def on_files(files: Files, config: Any) -> Files:
    """Add the files outside docs/ and the pages of the reference."""
    pages = {f.src_uri: f.content_string for f in files.documentation_pages()}
    named = (OUTSIDE + n for n in ("CONTRIBUTING.md", "SECURITY.md", "CHANGELOG.md", "README.md"))
    pages |= {n: (ROOT / in_repository(n)).read_text(encoding="utf-8") for n in named}
    places = {n: in_repository(n) for n in pages if n.startswith(OUTSIDE)} | outside(pages)
    for place, path in places.items():
        files.append(File.generated(config, place, abs_src_path=os.fspath(ROOT / path)))
    for module in modules(config["nav"]):
        text = f"# {module}\n\n::: {module}\n    options:\n      show_root_heading: false\n"
        files.append(File.generated(config, f"python/{module}.md", content=text))
    return files


def modules(nav: Any) -> list[str]:
    """Modules whose reference the navigation names."""
    if isinstance(nav, str):
        return [Path(nav).name.removesuffix(".md")] if nav.startswith("python/") else []
    parts = nav.values() if isinstance(nav, dict) else nav
    return [module for part in parts for module in modules(part)]


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Turn links that leave docs/, or begin outside of it, into links of the site."""
    here = page.file.src_uri
    page.meta["search"] = {"boost": FIRST.get(here, 1), "exclude": here in NOT_SEARCHED}

    def moved(match: re.Match[str]) -> str:
        before, target, rest = match.groups()
        if "://" in target or target.startswith("mailto:"):
            return match[0]
        place = in_site(target_of(here, target))
        if not place.startswith(OUTSIDE) and not here.startswith(OUTSIDE):
            return match[0]
        return before + posixpath.relpath(place, posixpath.dirname(here) or ".") + rest

    parts = CODE.split(markdown)
    parts[::2] = [LINK.sub(moved, part) for part in parts[::2]]
    return "".join(parts)


def policy(page: str) -> str:
    """The content policy of a page: the site's own files, and scripts within the page by their hash."""
    digests = (hashlib.sha256(text.encode()).digest() for text in SCRIPT.findall(page))
    scripts = dict.fromkeys(f"'sha256-{base64.b64encode(d).decode()}'" for d in digests)
    rules = [f"{kind}-src {OWN}" for kind in ("style", "font", "connect", "worker")]
    rules += [f"img-src {OWN} data:", " ".join([f"script-src {OWN}", *scripts])]
    return "; ".join(["default-src 'none'", "base-uri 'none'", "form-action 'none'", *rules])


# The theme's field for questions, which has no name for those who hear the page.
UNNAMED = 'data-md-component="search" role="dialog"'


def on_post_page(output: str, **_: Any) -> str:
    """Give a page its content policy, first thing after its encoding, and its search a name."""
    output = output.replace(f"{UNNAMED}>", f'{UNNAMED} aria-label="Search">')
    meta = f'<meta http-equiv="Content-Security-Policy" content="{policy(output)}">'
    before, encoding, after = output.partition('<meta charset="utf-8">')
    if not encoding:
        raise ValueError("expected a page that states its encoding")
    return before + encoding + meta + after


def on_post_template(output_content: str, template_name: str, **_: Any) -> str:
    """Give the page of what is not there its content policy."""
    return on_post_page(output_content) if template_name.endswith(".html") else output_content
