"""The report: one file, no network, every text escaped, never half written."""

import re
import shutil
import subprocess
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from axisight.gap import Interval, result
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


def test_no_tool_offers_to_send_a_chart_away():
    assert "showSendToCloud: false" in render_report(explained())


def test_one_prismatic_axis_is_in_newtons():
    assert "(N)" in render_report(one_prismatic())


def test_text_from_outside_cannot_become_markup():
    page = render_report(hostile())
    plain = len([t for t in parsed(render_report(explained())).tags if t == "script"])
    assert len([t for t in parsed(page).tags if t == "script"]) == plain
    assert "<script>alert" not in page


def test_values_stand_beside_the_headline():
    diagnosis = explained()
    page = render_report(diagnosis)
    header = page[page.index("<header>") : page.index("</header>")]
    for words in ("Coulomb friction", "axis 2", "coulomb_nm", "0.612 Nm", "0.583 to 0.641"):
        assert words in header
    # The width of a sign is no size of it; it stands with the rest below.
    assert "smoothing_rad_s" not in header and "smoothing_rad_s" in page
    assert '<aside class="values"' not in render_report(of("none"))


def test_many_values_are_grouped_and_counted():
    base = explained(6)
    causes = [
        replace(base.causes[0], effect=effect, axis=axis, parameters={name: Interval(1, 0.9, 1.1)})
        for axis in (2, 1, 3, 6, 5, 4, 7)
        for effect, name in (("coulomb_friction", "coulomb_nm"), ("quadratic_drag", "drag"))
    ]
    page = render_report(replace(base, causes=tuple(causes)))
    header = page[page.index("<aside") : page.index("</aside>")]
    assert header.count("Coulomb friction") == header.count("Quadratic drag") == 1
    places = re.findall(r"<td>axis (\d)</td>", header)
    assert places == [*"1234567", *"12345"]
    assert "2 more values below" in header


def test_pooled_remainder_and_findings_are_on_the_page():
    page = " ".join(render_report(explained()).split())
    assert '<td class="word">pooled</td><td class="word">–</td><td class="num">22 %</td>' in page
    assert "√(Σ e² / Σ u²)" in page
    assert "3.7 % of the torque on the held-out logs remain above the floor" in page
    assert "that varies with speed" in page
    assert "parameter_at_edge: axis2.damping: ended +32 % off, at the bound" in page
    clean = " ".join(render_report(of("none")).split())
    assert "Nothing stands out of the floor" in clean
    assert "To know before believing" not in clean
    plain = replace(explained(), gap=replace(explained().gap, pooled=None), remainder=None)
    assert "√(Σ e² / Σ u²)" not in render_report(plain)


# Says whether any tool of a figure covers something of a figure or what stands above it, and
# whether there are tools of the ranking (units) or to share a chart (tens).
PROBE = """<script>setTimeout(function () {
  function boxes(query) {
    return Array.prototype.map.call(document.querySelectorAll(query), function (e) {
      return e.getBoundingClientRect(); }).filter(function (b) { return b.width * b.height > 0; });
  }
  var tools = boxes(".modebar");
  var others = boxes(".main-svg .nsewdrag, .main-svg .legend, .choose label");
  var covered = others.filter(function (o) { return tools.some(function (t) {
    return t.left < o.right && o.left < t.right && t.top < o.bottom && o.top < t.bottom; }); });
  var unwanted = document.querySelectorAll("#ranking-figure .modebar").length;
  var shares = document.querySelectorAll('.modebar-btn[data-title*="hare"]').length;
  unwanted += 10 * shares;
  document.title = "probe " + tools.length + " " + others.length + " " + covered.length + " " + unwanted;
}, 1500);</script></body>"""
BROWSER = shutil.which("chromium") or shutil.which("google-chrome")


@pytest.mark.skipif(BROWSER is None, reason="needs chromium")
@pytest.mark.parametrize("width", [1200, 700, 420])
def test_tools_cover_no_figure(tmp_path, width):
    path = tmp_path / "report.html"
    log = "validation_multisine_with_a_name_as_long_as_they_get"
    base = explained()
    overlays = tuple(replace(o, log=f"{log}_{o.log}") for o in base.overlays)
    page = render_report(replace(base, overlays=overlays))
    path.write_text(page.replace("</body>", PROBE), encoding="utf-8")
    command = [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom"]
    command += [f"--window-size={width},3000", "--virtual-time-budget=5000", path.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    found = re.search(r"<title>probe (\d+) (\d+) (\d+) (\d+)</title>", done.stdout)
    assert found is not None
    tools, others, covered, unwanted = map(int, found.groups())
    assert (tools, covered, unwanted) == (1, 0, 0)
    assert others >= 5


def test_a_failed_write_leaves_nothing(tmp_path, monkeypatch):
    def broken(self: Path, target: Path) -> Path:
        raise OSError("disk full")

    monkeypatch.setattr(result.Path, "replace", broken)
    with pytest.raises(OSError, match="disk full"):
        save_report(explained(), tmp_path / "report.html")
    assert list(tmp_path.iterdir()) == []
