"""Answers of the tools: a short text and structured content, and errors in the package's own words."""

from __future__ import annotations

import functools
from collections.abc import Callable, Coroutine
from typing import Any, Concatenate, ParamSpec, Protocol, TypeVar

from mcp.types import CallToolResult, TextContent
from pydantic import BaseModel, Field

from axisight.cli.assistants.folder import Folder
from axisight.cli.suggest import suggestion
from axisight.documents import finite
from axisight.errors import AxisightError
from axisight.gap import RefusedInputError


class FileEntry(BaseModel):
    """One file or folder that a tool can read."""

    path: str = Field(description="Name relative to the server's folder.")
    kind: str = Field(description="case, log, model, or what else the suffix tells.")
    bytes: int = Field(description="Size in bytes; of a case that of all its files.")


class FilesAnswer(BaseModel):
    """What the folder holds."""

    files: list[FileEntry]
    more: int = Field(description="Number of further files that are not listed.")
    may_write: bool = Field(description="Whether tools may write files.")


class LogFinding(BaseModel):
    """One finding of a check."""

    severity: str = Field(description="error, warning or ok.")
    column: str
    axis: int | None = Field(description="Axis, counted from 1; null for all.")
    name: str = Field(description="Stable name of the fault; empty without one.")
    message: str


class CheckAnswer(BaseModel):
    """The check of a log."""

    readable: bool = Field(description="Whether the log can be read.")
    fits: bool | None = Field(
        description="Whether a diagnosis with the model would accept it; null without a model."
    )
    sample_rate_hz: float | None
    n_samples: int | None
    n_axes: int | None
    findings: list[LogFinding]


class ColumnsAnswer(BaseModel):
    """A proposed column map."""

    text: str = Field(description="The map as TOML, with the reason of every choice.")
    named: str | None = Field(description="The shipped map that fits the file.")
    doubts: list[str] = Field(description="Choices that may be wrong.")
    unused: dict[str, str] = Field(description="Columns left out, with the reason.")
    missing: str | None = Field(description="What must be added before the map can be used.")
    written: list[str] = Field(description="Files written.")


class DiagnosisAnswer(BaseModel):
    """A diagnosis."""

    diagnosis: str = Field(description="Number of this diagnosis, for the other tools.")
    verdict: dict[str, Any] = Field(
        description="The verdict (axisight.verdict/2), without the keys in left_out."
    )
    left_out: list[str] = Field(description="Keys of the verdict that full=true adds.")
    written: list[str] = Field(description="Files written.")


class ExplainAnswer(BaseModel):
    """How a verdict came about."""

    diagnosis: str = Field(description="Number of the diagnosis, or name of the verdict file.")
    comparisons: list[str]
    moves: list[str]
    rules: list[str]
    work: list[str]


class ExperimentAnswer(BaseModel):
    """An experiment that tells open causes apart, or shows an effect."""

    diagnosis: str
    advice: str = Field(description="What to run and what it tells, or why there is none.")
    decides: bool | None = Field(description="Whether it decides; null without an experiment.")
    motion: str | None
    axes: list[int] = Field(description="Axes that move, counted from 1.")
    period_s: float | None = Field(description="Duration of one period in s.")
    repeats: int | None = Field(description="How often to run the period.")
    peak_rad_s: list[float] = Field(description="Largest motor speed of each axis in rad/s.")
    limits: list[str] = Field(
        description="Limits of the motors, each with its source: as given, robot's model or logs."
    )
    written: list[str] = Field(description="Files written.")


def answer(text: str, content: BaseModel) -> CallToolResult:
    """Return the answer of a tool; numbers that are not finite become null."""
    plain = "\n".join(line.rstrip() for line in text.strip("\n").splitlines())
    return CallToolResult(
        content=[TextContent(type="text", text=plain)],
        structured_content=dict(finite(content.model_dump(mode="json"))),
    )


class _OnFolder(Protocol):
    folder: Folder


P = ParamSpec("P")
T = TypeVar("T", bound=_OnFolder)


def told_errors(
    tool: Callable[Concatenate[T, P], Coroutine[Any, Any, CallToolResult]],
) -> Callable[Concatenate[T, P], Coroutine[Any, Any, CallToolResult]]:
    """Return a tool that answers every AxisightError as an error of the tool, with its type and message."""

    @functools.wraps(tool)
    async def told(self: T, /, *args: P.args, **more: P.kwargs) -> CallToolResult:
        try:
            return await tool(self, *args, **more)
        except AxisightError as error:
            return _failed(error, self.folder)

    return told


def _failed(error: AxisightError, folder: Folder) -> CallToolResult:
    near = suggestion(str(error))
    meant = "" if near is None else f" Did you mean {near}?"
    message = folder.shown(f"{error}{meant}")
    faults = [f.name for f in error.findings] if isinstance(error, RefusedInputError) else []
    return CallToolResult(
        is_error=True,
        content=[TextContent(type="text", text=f"{type(error).__name__}: {message}")],
        structured_content={
            "error": type(error).__name__,
            "message": message,
            "faults": faults,
        },
    )
