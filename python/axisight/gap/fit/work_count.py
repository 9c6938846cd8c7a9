"""The work that fits of one diagnosis did, counted on any thread."""

from __future__ import annotations

from dataclasses import replace
from threading import Lock

from axisight.gap.facts.trace import Work


class WorkCount:
    """Counts work; ``done`` is what was done so far."""

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
        """Count a model that was evaluated with its sensitivities, and not fitted."""
        with self._lock:
            self.done = replace(self.done, linearizations=self.done.linearizations + 1)
