"""What is asked for beside a verdict: torques of all logs, the joint posterior, a modelled remainder."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from axisight.arguments import switch
from axisight.gap.facts.result import Diagnosis
from axisight.gap.facts.settings import Settings
from axisight.gap.measure.torque_traces import signals_of
from axisight.gap.modelled.remainder import with_modelled_remainder
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
    remainder: bool

    def __post_init__(self) -> None:
        """Raise InputError for what is neither true nor false."""
        switch("signals", self.signals)
        switch("posterior", self.posterior)
        switch("remainder", self.remainder)

    def added(
        self,
        found: Diagnosis,
        view: View,
        held_logs: Sequence[Log],
        seen: Validated,
        settings: Settings,
        progress: Progress,
        *,
        logged: bool,
    ) -> Diagnosis:
        """Return a diagnosis with the data that are asked for; ``logged``: whether torques were logged."""
        after = seen.reach.simulator
        if self.remainder:
            found = with_modelled_remainder(found, view, held_logs, after, settings)
        if self.signals:
            gap = found.gap.before_per_axis
            signals = signals_of(view, held_logs, after, gap_before=gap, logged=logged)
            found = replace(found, signals=signals)
        if self.posterior:
            progress("computing the posterior", 0, 1)
            found = replace(found, posterior=posterior_of(found, view, held_logs, seen))
            progress("computing the posterior", 1, 1)
        return found
