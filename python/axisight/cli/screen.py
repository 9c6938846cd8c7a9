"""Print the text of commands: on standard output, on standard error beside data, or not at all."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.console import Console

# rich chooses the colours: none without a terminal, or if NO_COLOR is set.
ERR = Console(stderr=True)
BARS = Console(stderr=True)
"""A second console on standard error for progress bars, which ``--quiet`` silences but errors not."""


class Screen:
    """The console for text: standard output, or standard error if data goes to standard output."""

    def __init__(self) -> None:
        self._console = self._standard = Console()
        self._quiet = False

    def print(self, *what: Any, **how: Any) -> None:
        """Print as `rich.console.Console.print`, unless asked to be quiet."""
        if not self._quiet:
            self._console.print(*what, **how)

    @property
    def width(self) -> int:
        """Width of a line in characters."""
        return self._console.width

    def begin(self) -> None:
        """Reset to the state at the start of a command."""
        self._console, self._quiet, BARS.quiet = self._standard, False, False

    def be_quiet(self) -> None:
        """Stop printing text and progress; errors go to another console."""
        self._quiet = BARS.quiet = True

    def leave_output(self) -> None:
        """Print on standard error from now on."""
        self._console = ERR


OUT = Screen()


def is_output(path: Path | None) -> bool:
    """Whether a path means standard output (``-``)."""
    return path is not None and str(path) == "-"
