"""The report in Chromium: nothing is refused, fetched or run, nothing overlaps, and it needs no script."""

import re
import shutil
import subprocess
import threading
from dataclasses import replace
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from axisight import palette
from axisight.report import render_report
from diagnosis_data import explained, named_everywhere
from pages import digest

BROWSER = shutil.which("chromium") or shutil.which("google-chrome")
pytestmark = pytest.mark.skipif(BROWSER is None, reason="needs chromium")


def opened(path: Path, *flags: str, width: int = 1200) -> tuple[str, list[str]]:
    """What Chromium prints of a page, and what the page left on the console."""
    command = [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"]
    # Containers have little shared memory.
    command += ["--disable-dev-shm-usage"]
    command += ["--enable-logging=stderr", f"--window-size={width},5000"]
    command += ["--allow-file-access-from-files", "--virtual-time-budget=3000"]
    command += [f"--user-data-dir={path.parent / 'profile'}", *flags, path.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    return done.stdout, [line for line in done.stderr.splitlines() if "CONSOLE" in line]


def framed(path: Path, page: str, width: int, rights: str = "") -> Path:
    """A file that shows a page ``width`` wide, which a window cannot be for phones, and hears it."""
    path.write_text(page, "utf-8")
    frame = path.with_name("frame.html")
    hear = "<script>onmessage = function (e) { document.title = e.data; };</script>"
    shown = f'<iframe {rights} src="{path.name}" width="{width}" height="4000"></iframe>'
    frame.write_text(hear + shown, "utf-8")
    return frame


def told(page: str, path: Path, script: str, width: int = 1200) -> str:
    """What ``script``, let into the page and its policy, posts to its parent."""
    assert "script-src " in page
    page = page.replace("script-src ", f"script-src {digest(script)} ", 1)
    page = page.replace("</body>", f"<script>{script}</script></body>")
    dom, console = opened(framed(path, page, width), "--dump-dom")
    assert console == []
    return re.search(r"<title>(.*)</title>", dom).group(1)


def test_nothing_is_refused_or_goes_wrong(tmp_path):
    path = tmp_path / "report.html"
    path.write_text(render_report(explained()), "utf-8")
    dom, console = opened(path, "--dump-dom")
    assert console == []
    # The script ran: it offers what it adds.
    assert "for values" in dom


@pytest.fixture
def server():
    """A server that any page may ask, and what it was asked for."""
    asked: list[str] = []

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            asked.append(self.path)
            self.send_error(404)

        def log_message(self, *_: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as running:
        thread = threading.Thread(target=running.serve_forever)
        thread.start()
        yield f"127.0.0.1:{running.server_port}", asked
        running.shutdown()
        thread.join()


@pytest.mark.parametrize("policy", [True, False])
def test_names_run_and_fetch_nothing(tmp_path, server, policy):
    """With the content policy and, were a browser to ignore it, by escaping alone."""
    address, asked = server
    bad = f"\"'></title></style></script></svg><script src=http://{address}/s></script>"
    bad += f"<img src=http://{address}/i onerror=console.log(1)><svg onload=console.log(2)>"
    page = render_report(named_everywhere(bad))
    if not policy:
        page = re.sub(r"<meta http-equiv=[^>]*>", "", page)
    path = tmp_path / "report.html"
    path.write_text(page, "utf-8")
    dom, console = opened(path, "--dump-dom")
    assert (console, asked) == ([], [])
    assert "for values" in dom


def test_figures_are_there_without_scripts(tmp_path):
    shot = tmp_path / "shot.png"
    rights = 'sandbox="allow-same-origin"'
    frame = framed(tmp_path / "report.html", render_report(explained()), 1100, rights)
    _, (refused,) = opened(frame, f"--screenshot={shot}")
    assert "Blocked script execution" in refused
    picture = np.rint(255 * imread(shot)[..., :3]).astype(int)

    def rows(color: str) -> int:
        wanted = [int(color[i : i + 2], 16) for i in (1, 3, 5)]
        return int(np.any(np.all(abs(picture - wanted) < 12, axis=2), axis=1).sum())

    # Curves of a figure of 450 pixels; of the bars the first is long and 18 pixels high.
    assert rows(palette.BEFORE) > 200
    assert rows(palette.AFTER) > 200
    assert rows(palette.MEASURED) > 200
    assert rows(palette.cell_colors(1.0, 1.0)[0]) > 0


LAYOUT = """
function boxes(query) {
  return Array.prototype.map.call(document.querySelectorAll(query), function (e) {
    var b = e.getBoundingClientRect();
    return { left: b.left, right: b.right, top: b.top, bottom: b.bottom, text: e.textContent }; })
    .filter(function (b) { return b.right > b.left && b.bottom > b.top; });
}
function meet(a, b) {
  return a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 1 && b.top < a.bottom - 1;
}
document.querySelectorAll("details.log").forEach(function (e) { e.open = true; });
var wide = document.documentElement.clientWidth;
var texts = boxes(".plot text, .candidate text, .candidate .name, .legend label, .readout, summary, h3");
var curves = boxes(".panel");
var wrong = [];
texts.forEach(function (a, i) {
  texts.slice(i + 1).forEach(function (b) { if (meet(a, b)) { wrong.push(a.text + " on " + b.text); } });
  curves.forEach(function (b) { if (meet(a, b)) { wrong.push(a.text + " on curves"); } });
  if (a.left < 0 || a.right > wide) { wrong.push(a.text + " cut"); }
});
if (document.documentElement.scrollWidth > wide) { wrong.push("page wider than " + wide); }
parent.postMessage(wide + " " + texts.length + " " + curves.length + " " + wrong.join("; "), "*");
"""


@pytest.mark.parametrize("width", [1100, 700, 390])
def test_nothing_overlaps_or_is_cut(tmp_path, width):
    base = explained()
    log = "validation_multisine_with_a_name_as_long_as_they_get"
    overlays = tuple(
        replace(o, log=f"{log}_{o.log}", measured_nm=scale * o.measured_nm)
        for o, scale in zip(base.overlays, (1, 1e-6, 1e6, -3, 40, 700), strict=True)
    )
    # The unit at its longest: axes whose kind nobody said.
    page = render_report(replace(base, overlays=overlays, provenance={}))
    found = told(page, tmp_path / "report.html", LAYOUT, width)
    wide, texts, curves, wrong = found.split(" ", 3)
    assert wrong == ""
    assert int(wide) == width and int(texts) > 100 and int(curves) == 12


POINTING = """
var plot = document.querySelector("details[open] .plot");
var frame = plot.querySelector(".frame").getBoundingClientRect();
function point(kind, share, type) {
  plot.dispatchEvent(new PointerEvent(kind, { clientX: frame.left + share * frame.width,
    clientY: frame.top + 20, pointerType: type || "mouse", button: 0, pointerId: 1 }));
}
function ticks() {
  var texts = plot.querySelectorAll(".times text");
  return Array.prototype.map.call(texts, function (e) { return e.textContent; }).join(" ");
}
// There is no pointer to hold.
plot.setPointerCapture = function () {};
var told = [ticks()];
point("pointermove", 0.5);
told.push(plot.parentNode.querySelector(".readout").textContent);
point("pointerdown", 0.5);
point("pointermove", 0.75);
point("pointerup", 0.75);
told.push(ticks());
point("pointermove", 0);
told.push(plot.parentNode.querySelector(".readout").textContent);
plot.dispatchEvent(new MouseEvent("dblclick"));
told.push(ticks());
point("pointerdown", 0.5, "touch");
point("pointerleave", 0.5, "touch");
told.push(plot.parentNode.querySelector(".readout").textContent);
var box = plot.parentNode.querySelector(".show-before");
box.click();
told.push(getComputedStyle(plot.querySelector("path.before")).display);
told.push(getComputedStyle(plot.querySelector("path.after")).display);
parent.postMessage(told.join("|"), "*");
"""


def test_values_under_the_pointer_and_a_closer_look(tmp_path):
    diagnosis = explained()
    page = render_report(diagnosis)
    found = told(page, tmp_path / "report.html", POINTING).split("|")
    all_ticks, middle, near_ticks, at_start, again, touched, before, after = found
    assert all_ticks == again == "0 2 4 6 8 10"
    assert near_ticks == "6.0 6.5 7.0 7.5 8.0 8.5"
    overlay = diagnosis.overlays[1]
    near = abs(overlay.time_s - 6.0) < 0.02
    measured, error = (
        x[near] for x in (overlay.measured_nm, overlay.before_nm - overlay.measured_nm)
    )
    for text in (middle, at_start, touched):
        words = r"At (.*) s: measured (.*) Nm, before .* Nm; error before (.*) Nm, after .* Nm"
        at, value, off = (float(x.replace("−", "-")) for x in re.fullmatch(words, text).groups())
        assert at == pytest.approx(6.0, abs=0.01)
        assert measured.min() - 0.01 <= value <= measured.max() + 0.01
        assert error.min() - 0.01 <= off <= error.max() + 0.01
    assert (before, after) == ("none", "inline")
