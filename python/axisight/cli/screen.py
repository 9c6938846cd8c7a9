"""Print the text of commands: on standard output, on standard error beside data, or not at all."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from io import StringIO
from pathlib import Path
from typing import Any

from rich.console import Console

# rich chooses the colours: none without a terminal, or if NO_COLOR is set.
ERR = Console(stderr=True)
BARS = Console(stderr=True)
"""A second console on standard error for progress bars, which ``--quiet`` silences but errors not."""

# A context variable, because a server records the text of several calls at the same time.
_RECORDING: ContextVar[Console | None] = ContextVar("recording", default=None)
_RECORDED_WIDTH = 100


class Screen:
    """The console for text: standard output, or standard error if data goes to standard output."""

    def __init__(self) -> None:
        self._console = self._standard = Console()
        self._quiet = False

    def print(self, *what: Any, **how: Any) -> None:
        """Print as `rich.console.Console.print`, unless asked to be quiet."""
        recording = _RECORDING.get()
        if recording is not None:
            recording.print(*what, **how)
        elif not self._quiet:
            self._console.print(*what, **how)

    @property
    def width(self) -> int:
        """Width of a line in characters."""
        return (_RECORDING.get() or self._console).width

    def begin(self) -> None:
        """Reset to the state at the start of a command."""
        self._console, self._quiet, BARS.quiet = self._standard, False, False

    def be_quiet(self) -> None:
        """Stop printing text and progress; errors go to another console."""
        self._quiet = BARS.quiet = True

    def leave_output(self) -> None:
        """Print on standard error from now on."""
        self._console = ERR

    @contextmanager
    def recorded(self) -> Iterator[Callable[[], str]]:
        """Keep what this context prints off the screen; the given function returns it as plain text."""
        kept = StringIO()
        console = Console(file=kept, width=_RECORDED_WIDTH, force_terminal=False, no_color=True)
        before = _RECORDING.set(console)
        try:
            yield kept.getvalue
        finally:
            _RECORDING.reset(before)


OUT = Screen()


def is_output(path: Path | None) -> bool:
    """Whether a path means standard output (``-``)."""
    return path is not None and str(path) == "-"
