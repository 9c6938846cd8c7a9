"""Findings of the preparation of records, as data."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from axisight.display.summary import summarized


class FindingKind(StrEnum):
    """The subject of a finding."""

    PERIOD = "period"
    """The period was found, not given."""
    LINES = "lines"
    """The excited lines were found, not given."""
    TRANSIENT = "transient"
    """Periods before the steady state were dropped, or the steady state was not reached."""
    DISTURBED = "disturbed"
    """A period after the start of the steady state differs from the steady ones; it was kept."""
    UNJUDGED = "unjudged"
    """Too few periods to judge transients, noise or leakage."""
    LEAKAGE = "leakage"
    """The signals do not repeat with the period: excited lines leak into others."""
    UNEQUAL = "unequal"
    """Experiments held different numbers of periods; the longer ones were cut."""
    DELAY = "delay"
    """An experiment started at another instant of the period; it was aligned."""
    CLIPPED = "clipped"
    """A limit clipped a signal: it stays flat at its extreme after a slope towards it."""
    DEAD = "dead"
    """An output does not change: its responses are zero, whatever the robot does."""
    DRIFT = "drift"
    """A linear drift was removed."""


@summarized
@dataclass(frozen=True)
class RecordFinding:
    """One observation about the records.

    kind
        See :class:`FindingKind`.
    message
        What was seen, with figures, and what to do about it.
    serious
        True if estimates from these records cannot be trusted until somebody has checked the finding.
    experiment
        Experiment, from 1; None if the finding concerns all.
    signal
        Signal, e.g. "output 2"; empty if the finding concerns all.
    value
        The main figure of the message, in the unit stated there; NaN if there is none.
    """

    kind: FindingKind
    message: str
    serious: bool = False
    experiment: int | None = None
    signal: str = ""
    value: float = float("nan")

    def __str__(self) -> str:
        """Return the finding as one line of text."""
        where = [] if self.experiment is None else [f"experiment {self.experiment}"]
        where += [self.signal] if self.signal else []
        return f"{', '.join(where)}: {self.message}" if where else self.message
