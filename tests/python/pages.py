"""Contents of a page as a browser reads them: elements, styles and scripts, the content policy."""

import base64
import hashlib
import re
from html.parser import HTMLParser

# Everything that makes a browser fetch, navigate or run something.
_REACHING = {
    "src",
    "srcset",
    "href",
    "xlink:href",
    "action",
    "formaction",
    "data",
    "poster",
    "style",
}


class Page(HTMLParser):
    """A parsed page. ``elements``: name and attributes in order; ``own``: text of each style and script."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.own: dict[str, list[str]] = {"style": [], "script": []}
        self._inside: str | None = None
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        self._inside = tag if tag in self.own else None
        if self._inside:
            self.own[tag].append("")

    def handle_endtag(self, tag):
        self._inside = None

    def handle_data(self, data):
        if self._inside:
            self.own[self._inside][-1] += data

    @property
    def structure(self) -> list[tuple[str, tuple[str, ...]]]:
        """Return elements and attribute names: no text may change these."""
        return [(tag, tuple(attributes)) for tag, attributes in self.elements]

    @property
    def policy(self) -> dict[str, str]:
        """Return the content policy by directive; it must come right after the page's encoding."""
        metas = [a for tag, a in self.elements if tag == "meta" and "http-equiv" in a]
        assert [a["http-equiv"] for a in metas] == ["Content-Security-Policy"]
        rules = (metas[0]["content"] or "").split("; ")
        return dict(rule.split(" ", 1) for rule in rules)


def digest(text: str) -> str:
    """Return the hash of a style or script in the form of a policy."""
    return "'sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() + "'"


def assert_strict(text: str) -> None:
    """Assert that a page fetches nothing and runs only its one style and at most one script."""
    assert "://" not in text
    page = Page(text)
    policy = page.policy
    assert (
        policy.pop("default-src") == policy.pop("base-uri") == policy.pop("form-action") == "'none'"
    )
    (style,) = page.own["style"]
    assert policy.pop("style-src") == digest(style)
    assert len(page.own["script"]) <= 1
    assert list(policy.items()) == [("script-src", digest(code)) for code in page.own["script"]]
    assert not re.search(r"url\(|@import|expression\(", style)
    for tag, attributes in page.elements:
        assert tag not in ("link", "iframe", "object", "embed", "base", "img", "image", "use")
        assert not [a for a in attributes if a in _REACHING or a.startswith("on")]
