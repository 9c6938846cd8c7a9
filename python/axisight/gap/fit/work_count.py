"""Counts the work of all fits of one diagnosis by stage, on any thread."""

from __future__ import annotations

from threading import Lock

from axisight.gap.facts.trace import Work


class WorkCount:
    """Thread-safe count of work.

    ``by_stage``: the sums so far, by the names of `axisight.gap.facts.trace.STAGES`; ``stage``: what counts now. Stages
    follow one another, and all threads work on one stage.
    """

    def __init__(self) -> None:
        self.stage = "refit"
        self.by_stage: dict[str, Work] = {}
        self._lock = Lock()

    @property
    def done(self) -> Work:
        """The sum over all stages so far."""
        return sum(self.by_stage.values(), Work())

    def fit(self, steps: int, evaluations: int) -> None:
        """Count a fit."""
        self._add(Work(fits=1, steps=steps, evaluations=evaluations))

    def linearization(self) -> None:
        """Count a model that was evaluated with its sensitivities but not fitted."""
        self._add(Work(linearizations=1))

    def _add(self, work: Work) -> None:
        with self._lock:
            self.by_stage[self.stage] = self.by_stage.get(self.stage, Work()) + work
