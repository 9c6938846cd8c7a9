"""Data that are asked for beside a verdict: torques of all logs, and the joint posterior of its parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from axisight.arguments import switch
from axisight.gap.facts.result import Diagnosis
from axisight.gap.measure.torque_traces import signals_of
from axisight.gap.screening.search_round import Progress
from axisight.gap.uncertainty.posterior_of import posterior_of
from axisight.gap.verdict.validated import Validated
from axisight.gap.views.view import View
from axisight.logs import Log


@dataclass(frozen=True)
class Wanted:
    """What is asked for; as in `diagnose`."""

    signals: bool
    posterior: bool

    def __post_init__(self) -> None:
        """Raise InputError for what is neither true nor false."""
        switch("signals", self.signals)
        switch("posterior", self.posterior)

    def added(
        self,
        found: Diagnosis,
        view: View,
        held_logs: Sequence[Log],
        seen: Validated,
        progress: Progress,
        *,
        logged: bool,
    ) -> Diagnosis:
        """Return a diagnosis with the data that are asked for; ``logged``: whether torques were logged."""
        if self.signals:
            after = seen.reach.simulator
            found = replace(found, signals=signals_of(view, held_logs, after, logged=logged))
        if self.posterior:
            progress("computing the posterior", 0, 1)
            found = replace(found, posterior=posterior_of(found, view, held_logs, seen))
            progress("computing the posterior", 1, 1)
        return found
