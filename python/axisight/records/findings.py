"""What preparing records found, as data."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from axisight.display.summary import summarized


class FindingKind(StrEnum):
    """What a finding is about."""

    PERIOD = "period"
    """The period was found, not given."""
    LINES = "lines"
    """The excited lines were found, not given."""
    TRANSIENT = "transient"
    """Periods before the steady state were dropped, or the steady state was not reached."""
    DISTURBED = "disturbed"
    """A later period differs from the steady ones though an earlier one does not; it was kept."""
    UNJUDGED = "unjudged"
    """Too few periods to judge transients, noise or leakage."""
    LEAKAGE = "leakage"
    """The signals do not repeat with the period: excited lines leak into others."""
    UNEQUAL = "unequal"
    """Experiments held different numbers of periods; the longer ones were cut."""
    DELAY = "delay"
    """An experiment started at another instant of the period; it was aligned."""
    CLIPPED = "clipped"
    """A signal sits flat at its extreme where it was about to go on."""
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
        True if estimates from these records are not to be trusted without a look at it.
    experiment
        Experiment, from 1; None if it is about all.
    signal
        E.g. "output 2"; empty if it is about all.
    value
        The figure behind it, in the unit the message names; NaN where there is none.
    """

    kind: FindingKind
    message: str
    serious: bool = False
    experiment: int | None = None
    signal: str = ""
    value: float = float("nan")

    def __str__(self) -> str:
        """One line for a person."""
        where = [] if self.experiment is None else [f"experiment {self.experiment}"]
        where += [self.signal] if self.signal else []
        return f"{', '.join(where)}: {self.message}" if where else self.message
