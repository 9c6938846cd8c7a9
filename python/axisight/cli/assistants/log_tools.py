"""Tools on single logs: list the files, check a log, guess its columns."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import anyio.to_thread
from mcp.types import CallToolResult

from axisight.cli.assistants import fields
from axisight.cli.assistants.answers import (
    CheckAnswer,
    ColumnsAnswer,
    FileEntry,
    FilesAnswer,
    LogFinding,
    answer,
    told_errors,
)
from axisight.cli.assistants.folder import Folder
from axisight.cli.check import fits, show_report
from axisight.cli.model_options import ModelOptions
from axisight.cli.screen import OUT
from axisight.logs import check_log
from axisight.logs.guessing import guess_columns
from axisight.robot.sources import USD_SUFFIXES
from axisight.storage import check_targets, write_whole

_KINDS = {
    ".csv": "log",
    ".tsv": "log",
    ".gz": "log",
    ".json": "verdict or log",
    ".jsonl": "log",
    ".ndjson": "log",
    ".parquet": "log",
    ".mat": "log",
    ".h5": "log",
    ".hdf5": "log",
    ".npy": "log",
    ".npz": "log",
    ".mcap": "log",
    ".bag": "log",
    ".db3": "log",
    ".urdf": "model",
    ".xml": "model",
    ".mjcf": "model",
    **dict.fromkeys(USD_SUFFIXES, "model"),
    ".toml": "robot file, column map or drive data",
    ".html": "report",
}
_MOST_FILES = 500


class LogTools:
    """The tools on single logs of a folder."""

    def __init__(self, folder: Folder) -> None:
        self.folder = folder

    @told_errors
    async def list_files(self) -> Annotated[CallToolResult, FilesAnswer]:
        """List the cases, logs, models and verdicts in the server's folder."""
        found = await anyio.to_thread.run_sync(lambda: list(_entries(self.folder)))
        shown = found[:_MOST_FILES]
        lines = [f"{entry.path} ({entry.kind}, {entry.bytes} bytes)" for entry in shown]
        more = len(found) - len(shown)
        tail = [f"and {more} more"] if more else []
        text = "\n".join([*lines, *tail]) or "no case, log or model in the folder"
        return answer(text, FilesAnswer(files=shown, more=more, may_write=self.folder.may_write))

    @told_errors
    async def check_log(
        self,
        log: fields.Log,
        columns: fields.Columns = None,
        columns_text: fields.ColumnsText = None,
        model: fields.Model = None,
        base: fields.Base = None,
        tip: fields.Tip = None,
        payload: fields.Payload = None,
    ) -> Annotated[CallToolResult, CheckAnswer]:
        """Check a log: rate in Hz, gaps, NaN, saturation, quantization, units, constant channels.

        With a model it also says what a diagnosis would refuse, and whether torques in Nm are compared in
        closed loop or by inverse dynamics. Fits nothing; takes about a second.
        """
        return await anyio.to_thread.run_sync(
            lambda: self._check(log, columns, columns_text, model, ModelOptions(base, tip, payload))
        )

    @told_errors
    async def guess_columns(
        self,
        log: fields.Log,
        model: fields.Model = None,
        base: fields.Base = None,
        tip: fields.Tip = None,
        write_to: fields.WriteMap = None,
    ) -> Annotated[CallToolResult, ColumnsAnswer]:
        """Propose a column map for a log: which column is time, position, velocity, torque, in which unit.

        Every choice has its reason as a comment. Show doubts to the user before you use the map. Pass the
        text on as columns_text. A model gives the number of axes.
        """
        return await anyio.to_thread.run_sync(
            lambda: self._guess(log, model, ModelOptions(base, tip), write_to)
        )

    def _check(
        self,
        log: str,
        columns: str | None,
        columns_text: str | None,
        model: str | None,
        options: ModelOptions,
    ) -> CallToolResult:
        path = self.folder.log("log", log)
        source = None if model is None else self.folder.model("model", model)
        by = self.folder.columns(columns, columns_text)
        with OUT.recorded() as said:
            found = check_log(path, by)
            show_report(found)
            good = None if source is None else found.ok and fits(source, options, found, by, None)
        findings = [
            LogFinding(**asdict(f) | {"message": self.folder.shown(f.message)})
            for f in found.findings
        ]
        content = CheckAnswer(
            readable=found.ok,
            fits=good,
            sample_rate_hz=found.sample_rate_hz,
            n_samples=found.n_samples,
            n_axes=found.n_axes,
            findings=findings,
        )
        return answer(self.folder.shown(said()), content)

    def _guess(
        self, log: str, model: str | None, options: ModelOptions, write_to: str | None
    ) -> CallToolResult:
        path = self.folder.log("log", log)
        source = None if model is None else self.folder.model("model", model)
        target = self.folder.write("write_to", write_to)
        check_targets({"write_to": target}, inputs=[path], replaces={"write_to": ()})
        found = guess_columns(path, None if source is None else options.load(source))
        text = self.folder.shown(found.text)
        if target is not None:
            write_whole(target, found.text)
        written = [] if target is None else [self.folder.shown(str(target))]
        notes = [f"doubtful: {doubt}" for doubt in found.doubts]
        notes += [f"to be completed: {found.missing}"] if found.missing else []
        notes += [f"written: {name}" for name in written]
        content = ColumnsAnswer(
            text=text,
            named=found.named,
            doubts=list(found.doubts),
            unused=found.unused,
            missing=found.missing,
            written=written,
        )
        return answer("\n".join([text.rstrip("\n"), *notes]), content)


def _entries(folder: Folder) -> Iterator[FileEntry]:
    """Yield what tools can read, without following links; hidden ones are left out."""
    for place, inner, files in os.walk(folder.root):
        here = Path(place)
        inner[:] = sorted(name for name in inner if not name.startswith("."))
        if "case.toml" in files:
            size = sum(
                p.stat().st_size for p in here.rglob("*") if p.is_file() and not p.is_symlink()
            )
            yield FileEntry(path=folder.relative(here), kind="case", bytes=size)
        for name in sorted(files):
            path = here / name
            kind = _KINDS.get(path.suffix.lower())
            if kind is None or name == "case.toml" or path.is_symlink() or name.startswith("."):
                continue
            yield FileEntry(path=folder.relative(path), kind=kind, bytes=path.stat().st_size)
