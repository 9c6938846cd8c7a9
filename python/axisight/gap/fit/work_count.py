"""Counts the work of all fits of one diagnosis, on any thread."""

from __future__ import annotations

from dataclasses import replace
from threading import Lock

from axisight.gap.facts.trace import Work


class WorkCount:
    """Thread-safe count of work; ``done`` holds the sum so far."""

    def __init__(self) -> None:
        self.done = Work()
        self._lock = Lock()

    def fit(self, steps: int, evaluations: int) -> None:
        """Count a fit."""
        with self._lock:
            done = self.done
            self.done = replace(
                done,
                fits=done.fits + 1,
                steps=done.steps + steps,
                evaluations=done.evaluations + evaluations,
            )

    def linearization(self) -> None:
        """Count a model that was evaluated with its sensitivities but not fitted."""
        with self._lock:
            self.done = replace(self.done, linearizations=self.done.linearizations + 1)
