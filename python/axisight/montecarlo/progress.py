"""Progress of a study."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from axisight.display.summary import summarized


@summarized
@dataclass(frozen=True)
class Progress:
    """State of a study.

    ``done`` of ``total`` runs are finished, and ``failed`` of them failed. ``rate_hz`` is the number
    of runs per second in this call, and ``remaining_s`` the remaining time [s] at that rate; both are
    NaN before the first block. ``message`` reports unusual events.
    """

    done: int
    total: int
    failed: int
    rate_hz: float
    remaining_s: float
    message: str = ""


Report = Callable[[Progress], None]


class Meter:
    """Counter of finished runs that reports progress."""

    def __init__(self, total: int, report: Report | None) -> None:
        self.total = total
        self.done = 0
        self.failed = 0
        self._computed = 0
        self._begun = time.monotonic()
        self._report = report

    def found(self, runs: int, failed: int) -> None:
        """Count runs found in the store."""
        self.done += runs
        self.failed += failed

    def finished(self, runs: int, failed: int) -> None:
        """Count runs computed now, and report."""
        self._computed += runs
        self.found(runs, failed)
        self.report()

    def report(self, message: str = "") -> None:
        """Report the progress to the caller."""
        if self._report is None:
            return
        elapsed = max(time.monotonic() - self._begun, 1e-9)
        rate = self._computed / elapsed if self._computed else float("nan")
        left = (self.total - self.done) / rate
        self._report(Progress(self.done, self.total, self.failed, rate, left, message))
