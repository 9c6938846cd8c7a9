"""The report for every reader: contrast, names of rows and columns, captions, unbroken numbers, phones, print."""

import re
import shutil
from html.parser import HTMLParser

import numpy as np
import pytest

from accessible import grave_findings
from axisight import palette
from axisight.report import render_report
from axisight.report.wording import unbroken
from diagnosis_data import VERDICTS, explained, of

BROWSER = shutil.which("chromium") or shutil.which("google-chrome")


def test_text_of_cells_stands_out_on_every_colour():
    """4.5:1 is what WCAG 2 AA asks of small text."""
    for share in [*np.linspace(0.0, 1.0, 1001), float("nan")]:
        background, ink = palette.cell_colors(float(share), 1.0)
        assert palette.contrast(background, ink) >= 4.5, share


def test_contrast_is_that_of_the_rule():
    assert palette.contrast("#000000", "#ffffff") == pytest.approx(21.0)
    assert palette.contrast("#767676", "#ffffff") == pytest.approx(4.54, abs=0.01)


class Tables(HTMLParser):
    """Heads without scope, and tables without a caption."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tables, self.captions, self.heads, self.bare = 0, 0, 0, 0
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tables += tag == "table"
        self.captions += tag == "caption"
        self.heads += tag == "th"
        self.bare += tag == "th" and "scope" not in dict(attrs)


@pytest.mark.parametrize("verdict", VERDICTS)
def test_tables_have_captions_and_heads_have_scope(verdict):
    found = Tables(render_report(of(verdict)))
    assert found.tables == found.captions > 2
    assert found.heads > 15 and found.bare == 0


def test_numbers_and_their_units_are_not_torn_apart():
    page = re.sub(r"<(style|script)>.*?</\1>", "", render_report(explained()), flags=re.S)
    # Heads of narrow columns are.
    page = re.sub(r'<th scope="col">.*?</th>', "", page).replace("&nbsp;", "\xa0")
    assert re.findall(r".{30}\d (?:%|Nm|Hz)(?!\w)", page.replace("95 %", "")) == []
    assert unbroken("13.1 % of 5 Nm, 3 nights") == "13.1\xa0% of 5\xa0Nm, 3 nights"


def test_the_title_is_robot_and_verdict():
    page = render_report(explained())
    (title,) = re.findall("<title>(.*)</title>", page)
    assert title == "practice: Explained (gap report)"


@pytest.mark.filterwarnings("default")
@pytest.mark.skipif(BROWSER is None, reason="needs chromium")
def test_nothing_serious_is_found(tmp_path):
    driver = pytest.importorskip("playwright.sync_api")
    pytest.importorskip("axe_playwright_python", reason="axe-core comes with the extra `test`")
    flags = ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]
    with driver.sync_playwright() as running:
        browser = running.chromium.launch(executable_path=BROWSER, args=flags)
        page = browser.new_context(bypass_csp=True).new_page()
        for verdict in VERDICTS:
            path = tmp_path / f"{verdict}.html"
            path.write_text(render_report(of(verdict)), "utf-8")
            for width in (1280, 400):
                page.set_viewport_size({"width": width, "height": 900})
                page.goto(path.as_uri())
                page.evaluate(
                    "document.querySelectorAll('details').forEach(e => { e.open = true; })"
                )
                assert grave_findings(page) == []
                assert page.evaluate("document.documentElement.scrollWidth") <= width
        browser.close()
