"""The page "from a multisine to an elastic model": its commands run as they stand and say what it says."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

import axisight
from axisight.cli import app
from axisight.robot_file import load_identified

BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)


def said(line: str) -> str:
    """Run a command as a shell would, with its wildcards, and return what it prints."""
    program, *words = shlex.split(line)
    assert program == "axisight"
    arguments = []
    for word in words:
        quoted = f"'{word}'" in line
        files = [] if quoted or not set("?*") & set(word) else sorted(Path().glob(word))
        arguments += [str(file) for file in files] or [word]
    out = CliRunner().invoke(app, arguments)
    assert out.exit_code == 0, out.output
    return out.output


def rows(page: str, title: str) -> list[list[str]]:
    """Return the cells of the table that begins with a title."""
    table = page[page.index(f"| {title} |") :].split("\n\n", maxsplit=1)[0]
    return [[cell.strip() for cell in row.split("|")[1:-1]] for row in table.splitlines()[2:]]


def test_the_page(repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    page = (repository / "docs" / "responses_cli.md").read_text("utf-8")
    blocks = BLOCK.findall(page)
    commands = "".join(code for kind, code in blocks if kind == "sh").replace("\\\n", " ")
    told = [said(line) for line in commands.splitlines()]
    assert Path("pose1.png").is_file()
    first = next(text for text in told if "operating point" in text)
    choices, quality = (code for kind, code in blocks if kind == "text")
    for line in choices.splitlines():
        # Machines round differently in the last digit of an operating point.
        assert line in first or line.startswith("operating point: 0.0439, 0.34")
    shown = re.sub(r"[│┃━─┏┓┗┛┡┩└┘┴┬╇┳┻]", " ", first)
    for line in quality.splitlines()[1:]:
        band, lines = line.split()[0:3], line.split()[3]
        assert " ".join([*band, lines]) in " ".join(shown.split())
    assert "distortion dominates" in first
    assert "operating points moved by up to 2.3 mrad" in told[-1]

    robot, found = axisight.load_robot("irb6600_like"), load_identified(Path("fitted.toml"))
    truth = axisight.robot_parameters(robot)
    fitted = axisight.robot_parameters(axisight.load_robot("fitted.toml"))
    for name, true, value, off, _ in rows(page, "stiffness"):
        key = f"{name}.stiffness"
        assert float(true) == pytest.approx(truth[key], rel=1e-4)
        # Machines round differently, and the fit stops within a tenth of its standard errors.
        assert float(value) == pytest.approx(fitted[key], rel=1e-3)
        assert float(off.removesuffix(" %")) == pytest.approx(
            100 * (fitted[key] / truth[key] - 1), abs=0.1
        )
    errors = {name: abs(fitted[name] / truth[name] - 1) for name in found.names}
    assert max(e for name, e in errors.items() if name.endswith("stiffness")) < 0.006
    assert max(e for name, e in errors.items() if name.endswith("damping")) < 0.15
    (code,) = (code for kind, code in blocks if kind == "python")
    exec(code, {})
