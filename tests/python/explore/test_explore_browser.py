"""The explorer in Chromium: load, choose, try causes, see the gap fall, export, reload."""

import http.client
import json
import re
import shutil
from contextlib import closing
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pyarrow.parquet as pq
import pytest
import tomlkit

from axisight import diagnose, load_robot
from axisight.cli.demo import write_demo_case

pytest.importorskip("panel", reason="Panel comes with the extra `explore`")
pytest.importorskip("playwright", reason="Playwright comes with the extra `test`")

from playwright.sync_api import expect

from accessible import grave_findings
from explorer import BROWSER, explorer, visit

pytestmark = [
    pytest.mark.skipif(BROWSER is None, reason="needs chromium"),
    # Those of the libraries of the browser's driver.
    pytest.mark.filterwarnings("default"),
]


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Path:
    return write_demo_case(tmp_path_factory.mktemp("demo") / "case")


@pytest.fixture(scope="module")
def found(case):
    return diagnose(case)


@pytest.fixture(scope="module")
def running(case, found):
    verdict = case.parent / "verdict.json"
    found.save_verdict(verdict)
    with explorer(case, "--verdict", verdict) as served:
        yield served


def test_causes_by_hand(running):
    with visit(running.url) as seen:
        page = seen.page
        # It opens where the gap is largest, and says whose it is.
        assert page.title() == "irb6600-like, 250 kg payload, 20 states: explained"
        chosen = "e => e.selectedOptions[0].text"
        assert page.get_by_label("axis", exact=True).evaluate(chosen) == "axis 2"
        # The token has served: it stays in no history.
        assert page.url == f"{running.origin}/explore"
        seen.choose("log", "4. multisine_fresh (validation)")
        seen.choose("axis", "axis 2")
        seen.choose("cause", "Coulomb friction")
        seen.choose("where", "axis 2")
        page.wait_for_selector("h2:has-text('Gap on multisine_fresh')")
        given = seen.cell("gaps", 2, "as given").inner_text()
        expect(seen.cell("gaps", 2, "as chosen")).to_have_text(given)
        seen.click("add")
        expect(seen.cell("gaps", 2, "as chosen")).not_to_have_text(given)
        put_in = seen.share("gaps", 2, "as chosen")
        assert put_in < 0.5 * seen.share("gaps", 2, "as given")
        # To nothing, by the keys of the slider: the simulator as given.
        handle = page.locator(".noUi-handle").first
        handle.focus()
        handle.press("Home")
        expect(seen.cell("gaps", 2, "as chosen")).to_have_text(given)
        handle.press("End")
        expect(seen.cell("gaps", 2, "as chosen")).not_to_have_text(given)
        assert seen.share("gaps", 2, "as chosen") > 2 * put_in
        seen.click("take it out")
        expect(seen.cell("gaps", 2, "as chosen")).to_have_text(given)
        assert seen.wrong == []


def test_what_the_diagnosis_said(running, found, tmp_path):
    """Its causes and re-fitted values give its gap; they leave in a robot file and outlive a reload."""
    with visit(running.url) as seen:
        page = seen.page
        assert found.headline in page.locator("p.said").inner_text().replace("\xa0", " ")
        seen.click("add the cause")
        seen.choose("own parameters", "re-fitted")
        for axis in (1, 2, 3):
            after = seen.cell("said-gaps", axis, "after").inner_text()
            expect(seen.cell("held", axis, "as chosen")).to_have_text(after)
        robot = downloaded(page, "robot file", tmp_path)
        (effect,) = load_robot(robot).effects
        assert effect.label == found.causes[0].label
        assert effect.values() == pytest.approx(found.causes[0].as_effect().values())
        verdict = downloaded(page, "verdict", tmp_path)
        assert json.loads(verdict.read_text()) == json.loads(json.dumps(found.to_verdict()))
        assert downloaded(page, "figure", tmp_path).read_bytes().startswith(b"\x89PNG")
        page.reload()
        page.wait_for_selector("#gaps")
        expect(page.get_by_role("button", name="take it out")).to_have_count(1)
        after = seen.cell("said-gaps", 2, "after").inner_text()
        expect(seen.cell("held", 2, "as chosen")).to_have_text(after)
        seen.choose("own parameters", "as given")
        seen.click("take it out")
        # Choices outlive a visit: one that ends before the server has heard leaves them to the next.
        expect(page.get_by_role("button", name="take it out")).to_have_count(0)
        assert seen.wrong == []


def test_it_fits_a_phone_and_every_reader(running):
    """Nothing wider than 400 px and nothing serious by axe-core, on any tab."""
    pytest.importorskip("axe_playwright_python", reason="axe-core comes with the extra `test`")
    with visit(running.url, width=400) as seen:
        page = seen.page
        for tab in ("time", "residual against", "orders", "bands", "response"):
            page.locator(".bk-tab", has_text=re.compile(f"^{tab}$")).click()
            page.wait_for_timeout(1000)
            assert page.evaluate("document.documentElement.scrollWidth") <= 400, tab
            assert page.evaluate(WIDEST) <= 400, tab
            # By the driver: the page's policy would refuse a script of others.
            assert grave_findings(page) == [], tab
        assert seen.wrong == []


# The right end of whatever is shown, within the parts of widgets too; a canvas clips the frames of its glyphs.
WIDEST = """() => {
  let right = 0;
  const look = root => root.querySelectorAll("*").forEach(element => {
    if (element.shadowRoot) { look(element.shadowRoot); }
    const box = element.getBoundingClientRect();
    if (element.classList.contains("bk-GlyphRenderer")) { return; }
    if (box.width > 1 && element.checkVisibility()) { right = Math.max(right, box.right); }
  });
  look(document);
  return right;
}"""


def downloaded(page, name: str, folder: Path) -> Path:
    with page.expect_download() as waited:
        page.get_by_role("button", name=name, exact=True).click()
    path = folder / waited.value.suggested_filename
    waited.value.save_as(path)
    return path


DATA = """name => {
  const model = Bokeh.documents[0].get_model_by_name(name);
  const data = model.data;
  const get = k => data instanceof Map ? data.get(k) : data[k];
  return [Array.from(get("x")), Array.from(get("y"))];
}"""


MEAN = f"(name => ({DATA})(name)[1].reduce((a, b) => a + b, 0))"


def test_figures_hold_what_was_simulated(running):
    """Two versions beside one another, the residual below, and a closer look at the zoom."""
    with visit(running.url) as seen:
        page = seen.page
        # What was chosen before on this server is kept: here all is chosen anew.
        seen.choose("axis", "axis 2")
        seen.choose("cause", "Torque offset")
        seen.choose("where", "axis 2")
        seen.click("add")
        expect(page.get_by_role("button", name="take it out")).to_have_count(1)
        page.wait_for_function(
            f"() => Math.abs({MEAN}('residual-now') - {MEAN}('residual-given')) > 1"
        )
        seen.click("pin as A")
        page.wait_for_selector("#gaps th:has-text('pin A')")
        seen.click("take it out")
        expect(page.get_by_role("button", name="take it out")).to_have_count(0)
        page.wait_for_function(f"() => {MEAN}('residual-now') == {MEAN}('residual-given')")
        pinned, now, given = (
            np.mean(page.evaluate(DATA, f"residual-{key}")[1]) for key in ("A", "now", "given")
        )
        assert now == given and abs(pinned - now) > 0.2
        t = np.array(page.evaluate(DATA, "torque-measured")[0])
        assert 1000 < len(t) <= 2400 and t.max() > 4.9
        page.evaluate("""() => {
            const range = Bokeh.documents[0].get_model_by_name("figure-torque").x_range;
            range.start = 1.0; range.end = 1.2; }""")
        # Wherever the page was scrolled to meanwhile.
        page.locator(".bk-Figure").first.hover()
        page.mouse.wheel(0, -10)
        page.wait_for_function(
            f"() => {{ const x = ({DATA})('position-measured')[0]; return x[x.length - 1] < 2; }}"
        )
        for tab in ("residual against", "orders", "bands", "response"):
            page.locator(".bk-tab", has_text=re.compile(f"^{tab}$")).click()
        assert page.locator("#bands-3 tbody tr").count() == 7
        seen.click("clear pins")
        expect(page.locator("#gaps thead th")).to_have_text(["axis", "as given", "as chosen"])
        assert seen.wrong == []


def test_without_references_the_torque_is_predicted_from_the_motion(case, tmp_path):
    """Inverse dynamics: a cause takes its gap away, there is no simulated position, nothing is measured."""
    bare = Path(shutil.copytree(case, tmp_path / "case"))
    robot = tomlkit.parse((bare / "robot.toml").read_text())
    del robot["controller"]
    (bare / "robot.toml").write_text(tomlkit.dumps(robot))
    for path in (bare / "logs").glob("*.parquet"):
        table = pq.read_table(path)
        kept = [name for name in table.column_names if not name.startswith("velocity_ref")]
        pq.write_table(table.select(kept), path)
    with explorer(bare) as served, visit(served.url) as seen:
        page = seen.page
        expect(page.get_by_text(re.compile(r"^Inverse dynamics: "))).to_be_visible()
        seen.choose("axis", "axis 2")
        seen.choose("cause", "Coulomb friction")
        seen.choose("where", "axis 2")
        given = seen.share("gaps", 2, "as given")
        seen.click("add")
        expect(seen.cell("gaps", 2, "as chosen")).not_to_have_text(f"{given:g} %")
        assert seen.share("gaps", 2, "as chosen") < 0.6 * given
        assert len(page.evaluate(DATA, "position-now")[0]) == 0
        page.locator(".bk-tab", has_text=re.compile("^response$")).click()
        page.wait_for_function(f"() => ({DATA})('response-now-2')[0].length == 300")
        # What changes no torque computed from the measured motion is not offered.
        offered = page.get_by_label("cause", exact=True).locator("option").all_inner_texts()
        assert "Sensor delay" not in offered and "Viscous friction" in offered
        assert len(page.evaluate(DATA, "response-measured-2")[0]) == 0
        assert seen.wrong == []


def test_diagnosis_beside_the_page_can_be_stopped_and_run(case, found):
    with explorer(case) as served, visit(served.url) as seen:
        page = seen.page
        assert page.get_by_text("Not run yet.").is_visible()
        seen.click("run the diagnosis")
        expect(page.get_by_text(re.compile(r"^running: .*: \d+ of \d+"))).to_be_visible()
        seen.click("stop")
        # A fit ends its step first, which takes long where others have the processors.
        stopped = page.get_by_text("stopped: nothing was kept")
        expect(stopped).to_be_visible(timeout=120_000)
        seen.click("run the diagnosis")
        expect(page.locator("p.said")).to_contain_text(found.headline, timeout=400_000)
        assert seen.wrong == []
    assert served.status == 130


def asked(running, path: str, **headers: str) -> int:
    place = urlsplit(running.url).netloc
    with closing(http.client.HTTPConnection(place, timeout=10)) as connection:
        connection.request("GET", path, headers=headers)
        with connection.getresponse() as answer:
            return answer.status


SOCKET = {
    "Connection": "Upgrade",
    "Upgrade": "websocket",
    "Sec-WebSocket-Version": "13",
    "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
}


def test_nothing_without_the_token(running):
    token = running.url.partition("token=")[2]
    port = urlsplit(running.url).port
    cookie = f"axisight_{port}={token}"
    paths = ["/", "/explore", "/explore?token=", "/explore?token=x", f"/?token={token}"]
    paths += ["/static/js/bokeh.min.js", "/explore/autoload.js", "/explore/metadata"]
    for path in paths:
        assert asked(running, path) == 403, path
    assert asked(running, f"/explore?token={token}") == 302
    assert asked(running, "/static/js/bokeh.min.js", Cookie=cookie) == 200
    assert asked(running, "/explore", Cookie=cookie + "x") == 403
    # A page elsewhere that made its name lead here.
    assert asked(running, "/explore", Cookie=cookie, Host=f"evil.example:{port}") == 403


def test_socket_is_for_this_page_only(running):
    token = running.url.partition("token=")[2]
    port = urlsplit(running.url).port
    own = SOCKET | {"Origin": running.origin}
    assert asked(running, "/explore/ws", **own) == 403
    cookie = {"Cookie": f"axisight_{port}={token}"}
    assert asked(running, "/explore/ws", **own, **cookie) == 101
    foreign = SOCKET | cookie | {"Origin": "http://evil.example"}
    assert asked(running, "/explore/ws", **foreign) == 403


def test_names_are_shown_and_not_run(case, found, tmp_path):
    bad = "<img src=x onerror=alert(1)>$$x$$<script>alert(2)<!script>"
    other = Path(shutil.copytree(case, tmp_path / "case"))
    log = other / "logs" / "multisine.parquet"
    log.rename(log.with_name(f"{bad}.parquet"))
    toml = other / "case.toml"
    text = toml.read_text().replace("logs/multisine.parquet", f"logs/{bad}.parquet")
    toml.write_text(text.replace('name = "demo"', f'name = "{bad}"'))
    verdict = found.to_verdict() | {"headline": bad, "verdict": bad}
    (tmp_path / "verdict.json").write_text(json.dumps(verdict))
    with (
        explorer(other, "--verdict", tmp_path / "verdict.json") as served,
        visit(served.url) as seen,
    ):
        assert seen.page.get_by_text(f"Case {bad}", exact=True).is_visible()
        assert seen.page.locator("h1.ax").inner_text().endswith(f": {bad}")
        assert bad in seen.page.locator("p.said").inner_text()
        assert bad in seen.page.get_by_label("log", exact=True).inner_text()
        assert seen.page.locator("img[src=x]").count() == 0
        downloaded(seen.page, "figure", tmp_path)
        assert seen.wrong == []
