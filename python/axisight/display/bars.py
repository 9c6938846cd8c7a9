"""Progress bars in a terminal or a notebook, for functions that report their progress."""

from __future__ import annotations

import sys
import time
from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from importlib import import_module
from typing import Any, Protocol

from rich.console import Console
from rich.markup import escape as escape_markup
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from axisight.display.html import lines

# Every update sends the whole output to the notebook.
_AT_MOST_EVERY_S = 0.1
_MOST_NOTES = 20


class Counted(Protocol):
    """State of a study: ``done`` of ``total`` runs, and a message about unusual events."""

    @property
    def done(self) -> int:
        """Number of finished runs."""

    @property
    def total(self) -> int:
        """Number of all runs."""

    @property
    def message(self) -> str:
        """Text about an unusual event; empty without one."""


class Bars(ABC):
    """Bars, one per stage of work; callers report (stage, done, total) by calling the object."""

    @abstractmethod
    def __call__(self, what: str, done: int, total: int) -> None:
        """Show that ``done`` of ``total`` steps of the stage ``what`` are finished."""

    def study(self, state: Counted) -> None:
        """Show the state that `axisight.montecarlo.run` reports."""
        if state.message:
            self.note(state.message)
        self("runs", state.done, state.total)

    @abstractmethod
    def note(self, text: str) -> None:
        """Show a text above the bars permanently."""


@contextmanager
def progress_bars() -> Iterator[Bars]:
    """Show progress while the block runs: in a notebook below the cell, else on standard error.

    Example: ``with progress_bars() as bars: diagnose(case, progress=bars)``; for studies
    ``montecarlo.run(study, progress=bars.study)``. A notebook needs IPython only, no widgets.
    """
    if _in_notebook():
        bars = _NotebookBars()
        try:
            yield bars
        finally:
            bars.show()
    else:
        with terminal_bars(Console(stderr=True)) as shown:
            yield shown


@contextmanager
def terminal_bars(console: Console) -> Iterator[Bars]:
    """Show progress on a console while the block runs."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console) as shown:
        yield _TerminalBars(shown)


class _TerminalBars(Bars):
    def __init__(self, shown: Progress) -> None:
        self._shown = shown
        self._tasks: dict[str, Any] = {}

    def __call__(self, what: str, done: int, total: int) -> None:
        if what not in self._tasks:
            self._tasks[what] = self._shown.add_task(escape_markup(what), total=total)
        self._shown.update(self._tasks[what], completed=done, total=total)

    def note(self, text: str) -> None:
        self._shown.console.print(text, markup=False, highlight=False, soft_wrap=True)


class _NotebookBars(Bars):
    """Bars as HTML in one display that is updated, so that no widgets are needed."""

    def __init__(self) -> None:
        self._ipython = import_module("IPython.display")
        self._stages: dict[str, tuple[int, int]] = {}
        self._notes: list[str] = []
        self._handle: Any = None
        self._shown_s = float("-inf")

    def __call__(self, what: str, done: int, total: int) -> None:
        new = what not in self._stages
        self._stages[what] = (done, total)
        if new or done >= total or time.monotonic() - self._shown_s > _AT_MOST_EVERY_S:
            self.show()

    def note(self, text: str) -> None:
        self._notes.append(text)
        self.show()

    def show(self) -> None:
        """Show the current notes and bars."""
        if not (self._stages or self._notes):
            return
        self._shown_s = time.monotonic()
        notes = lines(self._notes[-_MOST_NOTES:])
        bars = "".join(_bar(what, *counts) for what, counts in self._stages.items())
        html = self._ipython.HTML(notes + bars)
        if self._handle is None:
            self._handle = self._ipython.display(html, display_id=True)
        else:
            self._handle.update(html)


def _bar(what: str, done: int, total: int) -> str:
    return (
        f'<div><progress value="{done:d}" max="{max(total, 1):d}"></progress> '
        f"{escape(what)}: {done:d} of {total:d}</div>"
    )


def _in_notebook() -> bool:
    """Whether this process is a Jupyter kernel, not a terminal."""
    ipython = sys.modules.get("IPython")
    get = getattr(ipython, "get_ipython", lambda: None)
    # Hosted notebooks use subclasses of this shell.
    return any(kind.__name__ == "ZMQInteractiveShell" for kind in type(get()).__mro__)
