"""README: its snippets run as a reader would run them, and commands on all pages exist."""

from __future__ import annotations

import re
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer
from test_start_pages import BLOCK, Reader

import axisight
from axisight import Effect, load_robot, simulate
from axisight.blind.case_files import CaseFolder
from axisight.cli import app

MAX_LINES = 120
REPOSITORY = Path(__file__).resolve().parents[3]
PAGES = [REPOSITORY / "README.md", *sorted((REPOSITORY / "docs").glob("*.md"))]


def commands(page: Path) -> Iterator[list[str]]:
    """Yield the arguments of every `axisight` command in the shell snippets of a page."""
    for kind, block in BLOCK.findall(page.read_text(encoding="utf-8")):
        if kind == "sh":
            for line in block.replace("\\\n", " ").splitlines():
                # A pipe or the end of a loop ends a command.
                words = re.split(r" [|;&]", line)[0]
                if words.lstrip().startswith("axisight "):
                    yield shlex.split(words, comments=True)[1:]


def parse(arguments: list[str]) -> None:
    """Parse a command without running it; raises the parser's error where it does not exist."""
    # Typer brings a click of its own in some versions: what is used of it is the same in all.
    command: Any = typer.main.get_command(app)
    while hasattr(command, "commands") and arguments:
        # Options before the command, as in `axisight -q diagnose`.
        context = command.context_class(command)
        _, rest, _ = command.make_parser(context).parse_args(list(arguments))
        _, command, arguments = command.resolve_command(context, rest)
    context = command.context_class(command)
    command.make_parser(context).parse_args(list(arguments))


def small_case(folder: Path) -> None:
    """Write a case of one axis that lacks dry friction: as that of the demo, diagnosed in seconds."""
    robot = load_robot("lever_like")
    friction = Effect("coulomb_friction", 1, {"coulomb_nm": 0.4})
    time_s = np.arange(4000) * robot.sample_time_s
    case = CaseFolder(folder, "demo")
    for run, role in enumerate(("estimation", "estimation", "validation")):
        speed = 40 * np.sin(2 * np.pi * (0.5 + 0.4 * run) * time_s)[:, None]
        out = simulate(robot, speed, effects=[friction], noise_seed=run)
        signals = out["torque_cmd_nm"].values, out["position_rad"].values
        case.add(f"run{run}", role, out["time"].values, speed, *signals)
    case.finish("lever_like")


def test_readme_is_short() -> None:
    assert len((REPOSITORY / "README.md").read_text(encoding="utf-8").splitlines()) <= MAX_LINES


def test_python_of_the_readme_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    small_case(Path("demo/case"))
    text = (REPOSITORY / "README.md").read_text(encoding="utf-8")
    snippets = [block for kind, block in BLOCK.findall(text) if kind == "python"]
    assert len(snippets) == 2
    names: dict[str, Any] = {}
    for snippet in snippets:
        exec(snippet, names)
    assert "Coulomb friction" in capsys.readouterr().out
    assert Path("gap.png").exists()
    assert names["run"].attrs["status"] == "completed"
    assert names["runs"].sizes["run"] == 16


def test_the_real_example_of_the_readme(
    shared_data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for path in (shared_data / "emps").glob("*.mat"):
        shutil.copy(path, path.name)
    shutil.copytree(REPOSITORY / "examples" / "emps", "examples/emps")
    reader = Reader()
    reader.follow(REPOSITORY / "README.md", "A real example")
    assert reader.shown == 1
    assert Path("emps.html").exists()


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.stem)
def test_commands_exist(page: Path) -> None:
    for arguments in commands(page):
        try:
            parse(arguments)
        except Exception as error:
            pytest.fail(f"{page.name}: axisight {' '.join(arguments)}: {error!r}")


def test_a_command_that_does_not_exist_is_found() -> None:
    assert len(list(commands(REPOSITORY / "README.md"))) >= 4
    for wrong in (["diagnos", "a"], ["diagnose", "a", "--reprot", "b"], ["identify", "rigid"]):
        with pytest.raises(Exception, match=r"rigid|diagnos|reprot"):
            parse(wrong)
    assert axisight.__version__
