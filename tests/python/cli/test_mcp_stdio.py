"""The command ``axisight mcp`` as a process of its own, and the skill file that it prints."""

from __future__ import annotations

import os
import re
import sys
import time
from pathlib import Path
from typing import Any

import anyio
import pytest
from typer.main import get_command
from typer.testing import CliRunner

from axisight.cli import app
from axisight.cli.application import load_command
from axisight.cli.demo import write_demo_case


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("served")
    write_demo_case(made / "case")
    return made


def test_a_client_over_stdio_is_served_and_can_cancel(folder: Path) -> None:
    mcp = pytest.importorskip("mcp", reason="extra mcp")
    started = mcp.StdioServerParameters(
        command=sys.executable, args=["-m", "axisight", "mcp", str(folder)], env=dict(os.environ)
    )

    async def session() -> Any:
        async with mcp.Client(mcp.stdio_client(started)) as client:
            # Reading says that the case's simulator has no effects; nothing of it may reach the wire.
            log = {"log": "case/logs/moves.parquet", "model": "case/robot.toml"}
            checked = await client.call_tool("check_log", log)
            begun = anyio.Event()

            async def progress(*_: Any) -> None:
                begun.set()

            async def diagnosed() -> None:
                await client.call_tool("diagnose", {"case": "case"}, progress_callback=progress)

            async with anyio.create_task_group() as group:
                group.start_soon(diagnosed)
                await begun.wait()
                group.cancel_scope.cancel()
            since = time.monotonic()
            unknown = await client.call_tool("explain", {"diagnosis": "d1"})
            return checked, unknown, time.monotonic() - since

    checked, unknown, seconds = anyio.run(session)
    assert checked.structured_content["fits"] is True
    # The cancelled diagnosis left no result, and the server answers while its last step ends.
    assert unknown.is_error and "none yet" in unknown.content[0].text
    assert seconds < 5


def test_the_snippet_of_the_page_runs(
    folder: Path, repository: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("mcp", reason="extra mcp")
    page = (repository / "docs" / "mcp.md").read_text("utf-8")
    (code,) = re.findall(r"^```python\n(.*?)^```$", page, re.DOTALL | re.MULTILINE)
    command = 'command="axisight", args=["mcp", "demo"]'
    here = f"command={sys.executable!r}, args=['-m', 'axisight', 'mcp', {str(folder)!r}]"
    assert command in code
    exec(code.replace(command, f"{here}, env={dict(os.environ)!r}"), {})
    said = capsys.readouterr().out
    assert said.startswith("diagnosis d1\nexplained: ") and "'effect': 'coulomb_friction'" in said


def test_the_command_says_what_it_needs(monkeypatch: pytest.MonkeyPatch) -> None:
    done = CliRunner().invoke(app, ["mcp"])
    assert done.exit_code == 2
    monkeypatch.setattr("axisight.cli.assistants.command.find_spec", lambda _: None)
    done = CliRunner().invoke(app, ["mcp", "."])
    assert done.exit_code == 2


# Words of the skill file that look like options of the command named before them.
COMMAND = re.compile(r"`axisight ([a-z]+)(?: ([a-z]+))?([^`]*)`")


def test_the_skill_names_commands_and_options_that_exist() -> None:
    done = CliRunner().invoke(app, ["mcp", "--skill"])
    assert done.exit_code == 0 and done.output.startswith("---\nname: axisight\n")
    known = get_command(app).commands  # type: ignore[attr-defined]
    named = [m for m in COMMAND.finditer(done.output) if m[1] != "COMMAND"]
    assert len(named) >= 8
    for match in named:
        assert match[1] in known, match[0]
        command = load_command(match[1])
        command = getattr(command, "commands", {}).get(match[2], command)
        options = {name for p in command.params for name in p.opts}
        assert set(re.findall(r"(?<![\w-])--?[a-z][a-z-]*", match[3])) <= options, match[0]
    diagnose = {name for p in load_command("diagnose").params for name in p.opts}
    everywhere = set(re.findall(r"`(--[a-z-]+)", done.output))
    assert everywhere <= diagnose | {"--help", "--columns", "--untrusted"}
