"""Ctrl-C and SIGTERM: the same end of a command, told apart by its exit status."""

from __future__ import annotations

import signal
from types import FrameType

_asked: list[int] = []


class Terminated(KeyboardInterrupt):
    """SIGTERM: whoever handles Ctrl-C handles it too."""


def listen() -> None:
    """Raise KeyboardInterrupt at Ctrl-C and Terminated at SIGTERM, once; the second of either ends at once."""
    for number in (signal.SIGINT, signal.SIGTERM):
        # What is ignored, as Ctrl-C is by a job in the background of a shell, stays ignored.
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _stop)


def asked() -> int | None:
    """Return the exit status of a command that was asked to stop, None of one that was not."""
    return 128 + _asked[0] if _asked else None


def exit_status(stop: KeyboardInterrupt) -> int:
    """Return 130 after Ctrl-C and 143 after SIGTERM, as shells have it."""
    return 128 + (signal.SIGTERM if isinstance(stop, Terminated) else signal.SIGINT)


def _stop(number: int, _frame: FrameType | None) -> None:
    _asked.append(number)
    for one in (signal.SIGINT, signal.SIGTERM):
        signal.signal(one, signal.SIG_DFL)
    raise Terminated if number == signal.SIGTERM else KeyboardInterrupt
