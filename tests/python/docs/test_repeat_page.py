"""The page "the machine or the day?": its snippet and its command run as they stand and say what it says."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

from axisight.cli import app

BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)


def test_the_page(repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    page = (repository / "docs" / "repeat.md").read_text("utf-8")
    blocks = dict(BLOCK.findall(page))
    exec(blocks["python"], {})
    program, *words = shlex.split(blocks["sh"])
    assert program == "axisight"
    arguments = [
        name
        for word in words
        for name in (sorted(map(str, Path().glob(word))) if "*" in word else [word])
    ]
    out = CliRunner(env={"COLUMNS": "100"}).invoke(app, arguments)
    assert out.exit_code == 1, out.output
    for line in blocks["text"].splitlines():
        assert line in out.output
    # The true change of the example.
    change, half = map(float, re.findall(r"friction, \+([\d.]+) ± ([\d.]+) %", out.output)[0])
    assert abs(change - 5) < half
    assert {"days.json", "days.png"} <= {path.name for path in Path().iterdir()}
