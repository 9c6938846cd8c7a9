"""Stop a command at Ctrl-C and SIGTERM, in the same way except for the exit status."""

from __future__ import annotations

import signal
from types import FrameType

_asked: list[int] = []


class Terminated(KeyboardInterrupt):
    """Raised at SIGTERM; a KeyboardInterrupt, so that every handler of Ctrl-C catches it too."""


def listen() -> None:
    """Raise KeyboardInterrupt at Ctrl-C and Terminated at SIGTERM; a second signal kills the process."""
    for number in (signal.SIGINT, signal.SIGTERM):
        # An ignored signal stays ignored, such as Ctrl-C for a background job of a shell.
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _stop)


def asked() -> int | None:
    """Return the exit status if a signal asked the command to stop, else None."""
    return 128 + _asked[0] if _asked else None


def exit_status(stop: KeyboardInterrupt) -> int:
    """Return 130 after Ctrl-C and 143 after SIGTERM, as shells do."""
    return 128 + (signal.SIGTERM if isinstance(stop, Terminated) else signal.SIGINT)


def _stop(number: int, _frame: FrameType | None) -> None:
    _asked.append(number)
    for one in (signal.SIGINT, signal.SIGTERM):
        signal.signal(one, signal.SIG_DFL)
    raise Terminated if number == signal.SIGTERM else KeyboardInterrupt
