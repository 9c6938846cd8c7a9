"""The explorer in its own process with Chromium as its client, for tests and benches."""

import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from playwright.sync_api import expect, sync_playwright

# Test machines are busy.
expect.set_options(timeout=30_000)

BROWSER = shutil.which("chromium") or shutil.which("google-chrome")
# A shell that started the tests in the background ignores interrupts, and so would the command.
_LISTEN = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
_RUN = _LISTEN + "from axisight.cli import main; main()"
_COMMAND = [sys.executable, "-u", "-c", _RUN, "explore"]


@dataclass
class Running:
    """A running explorer: ``url`` with its token; ``status``: exit status after the end."""

    url: str
    status: int | None = None

    @property
    def origin(self) -> str:
        """Return scheme, address and port."""
        parts = urlsplit(self.url)
        return f"{parts.scheme}://{parts.netloc}"


@contextmanager
def explorer(*arguments: str | Path) -> Iterator[Running]:
    """Run the command until the block ends, then interrupt it."""
    environment = os.environ | {"COLUMNS": "200"}
    with subprocess.Popen(
        [*_COMMAND, *map(str, arguments), "--no-open"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
    ) as process:
        assert process.stdout is not None and process.stderr is not None
        line = ""
        for line in process.stdout:
            if line.startswith("explorer: "):
                break
        found = re.fullmatch(r"explorer: (http://127\.0\.0\.1:\d+/explore\?token=\S{20,})\n", line)
        if found is None:
            process.kill()
            raise AssertionError(process.stderr.read())
        running = Running(found.group(1))
        try:
            yield running
        finally:
            process.send_signal(signal.SIGINT)
            try:
                # Running work ends its step first, which is slow on a busy machine.
                process.communicate(timeout=90)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            running.status = process.returncode


@dataclass
class Visit:
    """A visited page with its failures: console errors, and requests to other machines."""

    page: Any
    origin: str
    wrong: list[str] = field(default_factory=list)

    def _request(self, request: Any) -> None:
        own = (self.origin, f"blob:{self.origin}", "data:", self.origin.replace("http", "ws"))
        if not request.url.startswith(own):
            self.wrong.append(f"asked for {request.url[:200]}")

    def _console(self, message: Any) -> None:
        if message.type == "error":
            self.wrong.append(f"console: {message.text[:300]}")

    def watch(self) -> None:
        """Start to record failures."""
        self.page.on("request", self._request)
        self.page.on("console", self._console)
        self.page.on("pageerror", lambda error: self.wrong.append(f"error: {error}"))
        self.page.on("dialog", lambda dialog: self.wrong.append(f"dialog: {dialog.message}"))

    def cell(self, table: str, row: int, column: str) -> Any:
        """Return a cell of a table by its row (from 1) and column title."""
        heads = self.page.locator(f"#{table} th").all_inner_texts()
        return self.page.locator(f"#{table} tbody tr:nth-child({row}) > *").nth(heads.index(column))

    def share(self, table: str, row: int, column: str) -> float:
        """Return a percentage in a cell as a number."""
        return float(self.cell(table, row, column).inner_text().removesuffix("%"))

    def click(self, name: str) -> None:
        """Click the first button with a name."""
        self.page.get_by_role("button", name=name, exact=True).first.click()

    def choose(self, label: str, option: str) -> None:
        """Choose an option in the list with a label."""
        self.page.get_by_label(label, exact=True).select_option(label=option)


@contextmanager
def visit(url: str, width: int = 1400) -> Iterator[Visit]:
    """Open a page in Chromium and wait until it shows its gaps."""
    flags = ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=BROWSER, args=flags)
        page = browser.new_page(viewport={"width": width, "height": 1000}, accept_downloads=True)
        page.set_default_timeout(60_000)
        parts = urlsplit(url)
        seen = Visit(page, f"{parts.scheme}://{parts.netloc}")
        seen.watch()
        page.goto(url)
        page.wait_for_selector("#gaps")
        yield seen
        browser.close()
