"""How far a study is."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from axisight.display.summary import summarized


@summarized
@dataclass(frozen=True)
class Progress:
    """State of a study.

    ``done`` of ``total`` runs are finished, ``failed`` of them failed; ``rate_hz`` are the
    runs finished per second by this call, ``remaining_s`` the time left at that rate; NaN
    before the first block. ``message`` tells of something out of the ordinary.
    """

    done: int
    total: int
    failed: int
    rate_hz: float
    remaining_s: float
    message: str = ""


Report = Callable[[Progress], None]


class Meter:
    """Counts finished runs and reports."""

    def __init__(self, total: int, report: Report | None) -> None:
        self.total = total
        self.done = 0
        self.failed = 0
        self._computed = 0
        self._begun = time.monotonic()
        self._report = report

    def found(self, runs: int, failed: int) -> None:
        """Count runs that were stored before."""
        self.done += runs
        self.failed += failed

    def finished(self, runs: int, failed: int) -> None:
        """Count runs computed now, and report."""
        self._computed += runs
        self.found(runs, failed)
        self.report()

    def report(self, message: str = "") -> None:
        """Tell the caller where the study is."""
        if self._report is None:
            return
        elapsed = max(time.monotonic() - self._begun, 1e-9)
        rate = self._computed / elapsed if self._computed else float("nan")
        left = (self.total - self.done) / rate
        self._report(Progress(self.done, self.total, self.failed, rate, left, message))
