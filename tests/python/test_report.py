"""The report: one file, no network, every text escaped, never half written."""

from html.parser import HTMLParser
from pathlib import Path

import pytest

from axisight.gap import result
from axisight.report import render_report, save_report
from diagnosis_data import VERDICTS, explained, hostile, of, one_prismatic


class Collector(HTMLParser):
    """Everything a browser would fetch, and all element names."""

    def __init__(self) -> None:
        super().__init__()
        self.fetched: list[str] = []
        self.tags: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        for name, value in attrs:
            if name in ("src", "href") and value and not value.startswith(("#", "data:")):
                self.fetched.append(value)


def parsed(page: str) -> Collector:
    collector = Collector()
    collector.feed(page)
    return collector


@pytest.mark.parametrize("verdict", VERDICTS)
def test_every_verdict_gives_a_page_that_needs_no_network(verdict):
    diagnosis = of(verdict)
    page = render_report(diagnosis)
    assert parsed(page).fetched == []
    assert diagnosis.headline[:40] in page
    # Plotly's code is in the page once.
    assert 3_000_000 < len(page) < 8_000_000


def test_one_prismatic_axis_is_in_newtons():
    assert "(N)" in render_report(one_prismatic())


def test_text_from_outside_cannot_become_markup():
    page = render_report(hostile())
    plain = len([t for t in parsed(render_report(explained())).tags if t == "script"])
    assert len([t for t in parsed(page).tags if t == "script"]) == plain
    assert "<script>alert" not in page


def test_a_failed_write_leaves_nothing(tmp_path, monkeypatch):
    def broken(self: Path, target: Path) -> Path:
        raise OSError("disk full")

    monkeypatch.setattr(result.Path, "replace", broken)
    with pytest.raises(OSError, match="disk full"):
        save_report(explained(), tmp_path / "report.html")
    assert list(tmp_path.iterdir()) == []
