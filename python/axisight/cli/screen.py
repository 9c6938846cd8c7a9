"""What a command says to people: on standard output, beside data that goes there, or not at all."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.console import Console

# Colours are rich's own choice: none where it is no terminal, or where NO_COLOR is set.
ERR = Console(stderr=True)
BARS = Console(stderr=True)
"""Standard error once more, for what shows progress: silent where errors are not."""


class Screen:
    """Standard output, or standard error while data has the output to itself."""

    def __init__(self) -> None:
        self._console = self._standard = Console()
        self._quiet = False

    def print(self, *what: Any, **how: Any) -> None:
        """Print as `rich.console.Console.print`, unless asked to be quiet."""
        if not self._quiet:
            self._console.print(*what, **how)

    @property
    def width(self) -> int:
        """Columns of a line."""
        return self._console.width

    def begin(self) -> None:
        """Be as at the start of a command."""
        self._console, self._quiet, BARS.quiet = self._standard, False, False

    def be_quiet(self) -> None:
        """Print nothing, and no progress; errors are not printed here."""
        self._quiet = BARS.quiet = True

    def leave_output(self) -> None:
        """Print on standard error from here on."""
        self._console = ERR


OUT = Screen()


def is_output(path: Path | None) -> bool:
    """Whether a path stands for standard output: ``-``."""
    return path is not None and str(path) == "-"
