"""What pages hold, as a browser reads it: elements, texts of styles and scripts, the content policy."""

import base64
import hashlib
import re
from html.parser import HTMLParser

# Whatever makes a browser fetch, go or run something.
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
    """``elements``: name and attributes, in order; ``own``: texts of each style and script."""

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
        """Elements and names of attributes: what no text may change."""
        return [(tag, tuple(attributes)) for tag, attributes in self.elements]

    @property
    def policy(self) -> dict[str, str]:
        """The content policy, by directive; the page must state one, first thing after its encoding."""
        metas = [a for tag, a in self.elements if tag == "meta" and "http-equiv" in a]
        assert [a["http-equiv"] for a in metas] == ["Content-Security-Policy"]
        rules = (metas[0]["content"] or "").split("; ")
        return dict(rule.split(" ", 1) for rule in rules)


def digest(text: str) -> str:
    """The hash of a style or script as a policy names it."""
    return "'sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() + "'"


def assert_strict(text: str) -> None:
    """Nothing is fetched, and nothing is run but the page's one style and at most one script."""
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
