"""The site in Chromium, from a folder and from a server: nothing is fetched, refused or wrong, and it is searched."""

import shutil
import subprocess
import sys
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from accessible import grave_findings

pytest.importorskip("mkdocs", reason="mkdocs comes with the extra `docs`")
driver = pytest.importorskip("playwright.sync_api", reason="playwright comes with the extra `test`")

BROWSER = shutil.which("chromium") or shutil.which("google-chrome")
pytestmark = pytest.mark.skipif(BROWSER is None, reason="needs chromium")

# Typed, and the page that must be among the first three found.
QUESTIONS = {
    "How do I diagnose my bag?": "start_diagnose.html",
    "What does undecidable mean?": "undecidable.html",
    "Which keys does a robot file have?": "robot_files.html",
    "How do I add an effect?": "CONTRIBUTING.html",
}


@pytest.fixture(scope="module")
def site(repository: Path, tmp_path_factory) -> Path:
    """The site, built anew."""
    folder = tmp_path_factory.mktemp("built") / "site"
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "-d", str(folder)]
    done = subprocess.run(command, cwd=repository, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture
def page():
    """A page of a browser, with what it asked for and what it complained of."""
    flags = ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]
    flags.append("--allow-file-access-from-files")
    with driver.sync_playwright() as running:
        browser = running.chromium.launch(executable_path=BROWSER, args=flags)
        page = browser.new_page()
        page.set_default_timeout(30_000)
        page.asked, page.wrong = [], []
        page.on("request", lambda request: page.asked.append(request.url))
        page.on("console", lambda message: page.wrong.append(message.text))
        page.on("pageerror", lambda error: page.wrong.append(str(error)))
        yield page
        browser.close()


@pytest.fixture(params=["folder", "server"])
def address(request, site):
    """Where the site is."""
    if request.param == "folder":
        yield site.as_uri()
        return

    class Quiet(SimpleHTTPRequestHandler):
        def log_message(self, *_: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=site)) as running:
        thread = threading.Thread(target=running.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{running.server_port}"
        running.shutdown()
        thread.join()


def test_no_page_fetches_or_runs_what_is_not_its_own(site, page):
    pages = sorted(site.rglob("*.html"))
    assert len(pages) > 50
    for path in pages:
        # Its addresses begin at the root of a server.
        if path.name == "404.html":
            continue
        page.goto(path.as_uri())
        # The theme's own scripts ran.
        page.wait_for_selector("html.js", state="attached")
        assert page.wrong == [], path
    assert {url.split(":")[0] for url in page.asked} <= {"file", "data"}
    # What is no part of the page does not run: the policy is there, and is obeyed.
    page.evaluate(
        "document.body.append(Object.assign(document.createElement('script'), {text: 'x = 1'}))"
    )
    page.evaluate("document.body.append(Object.assign(new Image(), {src: 'http://127.0.0.1:9/'}))")
    page.wait_for_timeout(300)
    assert len(page.wrong) == 2
    assert all("Content Security Policy" in text for text in page.wrong)


# A beginner's way, and the two kinds of generated reference.
READ = ("index", "start_diagnose", "cli", "effects", "python/axisight")


@pytest.mark.parametrize("name", READ)
def test_nothing_serious_is_found(site, name):
    """By axe-core, on a screen and on a phone."""
    pytest.importorskip("axe_playwright_python", reason="axe-core comes with the extra `test`")
    with driver.sync_playwright() as running:
        flags = ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]
        browser = running.chromium.launch(executable_path=BROWSER, args=flags)
        page = browser.new_context(bypass_csp=True).new_page()
        for width in (1280, 400):
            page.set_viewport_size({"width": width, "height": 900})
            page.goto((site / f"{name}.html").as_uri())
            page.wait_for_selector("html.js", state="attached")
            page.wait_for_timeout(500)
            assert grave_findings(page) == []
        browser.close()


def test_questions_are_answered_by_the_search(address, page):
    page.goto(f"{address}/index.html")
    for question, answer in QUESTIONS.items():
        field = page.locator(".md-search__input").first
        field.click()
        field.fill("")
        field.type(question)
        found = page.locator(f".md-search-result__item:nth-child(-n+3) a[href*='{answer}']")
        found.first.wait_for(state="attached")
    assert page.wrong == []
    assert all(url.startswith((address, "data:", "blob:")) for url in page.asked)
