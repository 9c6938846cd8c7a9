"""The server: which tools there are, and what they promise."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from mcp.server.mcpserver import MCPServer
from mcp.types import ToolAnnotations

from axisight._core import __version__
from axisight.cli.assistants.diagnosis_tools import DiagnosisTools
from axisight.cli.assistants.folder import Folder
from axisight.cli.assistants.log_tools import LogTools
from axisight.cli.assistants.running import Diagnoses
from axisight.cli.assistants.words import INSTRUCTIONS, skill
from axisight.gap import diagnose


def make_server(
    root: Path, *, may_write: bool = False, run: Callable[..., Any] = diagnose
) -> MCPServer[Any]:
    """Return the server for the files of a folder; raise InputError for a path that is no folder.

    ``run`` is `axisight.diagnose`, or what a test puts in its place.
    """
    folder = Folder(root, may_write=may_write)
    logs, gaps = LogTools(folder), DiagnosisTools(folder, Diagnoses(run))
    server: MCPServer[Any] = MCPServer(
        "axisight", instructions=INSTRUCTIONS, version=__version__, log_level="WARNING"
    )
    only_read = ToolAnnotations(read_only_hint=True, open_world_hint=False)
    # A file is written only if it is new, or an earlier result of the same kind.
    writes = ToolAnnotations(
        read_only_hint=not may_write,
        destructive_hint=False,
        idempotent_hint=True,
        open_world_hint=False,
    )
    server.add_tool(logs.list_files, annotations=only_read)
    server.add_tool(logs.check_log, annotations=only_read)
    server.add_tool(logs.guess_columns, annotations=writes)
    server.add_tool(gaps.diagnose, annotations=writes)
    server.add_tool(gaps.explain, annotations=only_read)
    server.add_tool(gaps.next_experiment, annotations=writes)
    server.resource(
        "axisight://skill",
        name="skill",
        description="How to use the command line of Axisight.",
        mime_type="text/markdown",
    )(skill)
    return server
