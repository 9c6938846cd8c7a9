"""Verdict files of the folder, for tools that explain them."""

from __future__ import annotations

from pydantic import ValidationError

from axisight.arguments import shown
from axisight.cli.assistants.folder import Folder
from axisight.errors import InputError
from axisight.explore.said import read_said
from axisight.gap.facts.trace import Trace


def verdict_file(folder: Folder, name: str) -> tuple[str, Trace]:
    """Return the headline and the trace of a verdict in the folder.

    Raises InputError, naming the file, if it is no verdict or has no trace.
    """
    said = read_said(folder.read("verdict", name))
    trace = said.document.get("trace")
    if not isinstance(trace, dict):
        raise InputError(
            f"verdict: {name}: trace: expected the trace of a diagnosis, got {shown(trace)}"
        )
    try:
        return said.headline, Trace.from_dict(trace)
    except ValidationError as error:
        fault = error.errors()[0]
        where = ".".join(str(part) for part in ("trace", *fault["loc"]))
        raise InputError(f"verdict: {name}: {where}: {fault['msg']}") from None
