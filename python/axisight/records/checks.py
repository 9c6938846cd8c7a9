"""Check experiments and records for clipping, dead outputs, transients and leakage."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight.errors import InputError
from axisight.records.clipping import clipped_samples
from axisight.records.delays import estimate_delay
from axisight.records.experiment import Experiment
from axisight.records.findings import FindingKind, RecordFinding
from axisight.records.period import not_whole
from axisight.records.periodic import PeriodicRecords
from axisight.records.transients import steady_state

Real = NDArray[np.float64]
Signals = dict[str, Real]

_REPEAT_LIMIT = 1e-3  # RMS of the part of the reference that does not repeat, over its RMS
_PHASE_WARN_RAD, _PHASE_REFUSE_RAD = 0.01, 0.5  # at the highest line, over the record


def check_clipping(runs: list[Experiment], start: int) -> list[RecordFinding]:
    """Return a finding for each clipped input or output (:func:`clipped_samples`)."""
    findings = []
    for e, run in enumerate(runs, 1):
        meant = run.reference
        if meant is not None and meant.shape != run.input.shape:
            meant = None
        for name in ("input", "output"):
            values = getattr(run, name)[start:]
            for c in range(values.shape[1]):
                same = None if meant is None or name == "output" else meant[start:, c]
                count = clipped_samples(values[:, c], same)
                if count:
                    share = count / len(values)
                    message = (
                        f"clipped: {count} samples ({share:.2%}) sit flat at the extreme; lower "
                        "the amplitude, the response holds the limit's distortion"
                    )
                    findings.append(
                        RecordFinding(
                            FindingKind.CLIPPED, message, True, e, f"{name} {c + 1}", share
                        )
                    )
    return findings


def check_dead(runs: list[Experiment], start: int) -> list[RecordFinding]:
    """Return a finding for each output that does not change: serious if it changes in no experiment."""
    still = np.array([np.ptp(run.output[start:], axis=0) == 0.0 for run in runs])
    findings = []
    for c in np.flatnonzero(still.any(axis=0)).tolist():
        always = bool(still[:, c].all())
        for e in [None] if always else (np.flatnonzero(still[:, c]) + 1).tolist():
            value = float(runs[0 if e is None else e - 1].output[start, c])
            message = (
                f"dead: expected it to change, got {value:g} throughout; its responses are zero, which says "
                f"nothing about the robot: look at its column and its sensor"
            )
            findings.append(
                RecordFinding(FindingKind.DEAD, message, always, e, f"output {c + 1}", value)
            )
    return findings


def keep_steady(
    cut: list[Signals],
    wait: int,
    drop_periods: int | None,
    last_line: int,
    significance: float,
    findings: list[RecordFinding],
) -> int:
    """Return the number of leading periods to drop, and append the reasons to ``findings``."""
    if drop_periods is not None:
        return drop_periods
    dropped = wait
    for e, signals in enumerate(cut, 1):
        both = np.concatenate([signals["input"], signals["output"]], axis=2)[wait:]
        if len(both) < 3:
            message = f"{max(len(both), 0)} periods: too few to judge transients and leakage"
            findings.append(RecordFinding(FindingKind.UNJUDGED, message, len(both) < 2, e))
            continue
        moving = both[:, :, np.ptp(both, axis=(0, 1)) > 0.0]
        if not moving.size:  # a constant signal is in its steady state
            continue
        found = steady_state(moving, last_line, significance / len(cut))
        dropped = max(dropped, wait + found.first)
        again = found.first + 1 + np.flatnonzero(found.p_value[found.first :] < found.significance)
        if found.reached and again.size:
            message = (
                f"periods {', '.join(str(wait + p) for p in again)} differ from the steady ones "
                f"(up to {found.excess[again - 1].max():.3g} times the noise): something disturbed "
                "them; kept, as the scatter over the periods holds it"
            )
            findings.append(RecordFinding(FindingKind.DISTURBED, message, experiment=e))
        if found.first:
            message = (
                f"periods {wait + 1} to {wait + found.first} differ from the later ones (up to "
                f"{found.excess[0]:.3g} times the noise, significance {significance}); dropped"
            )
            if not found.reached:
                message += (
                    "; so does every period before those taken for steady: wait longer, or "
                    "use the local polynomial method"
                )
            findings.append(
                RecordFinding(
                    FindingKind.TRANSIENT, message, not found.reached, e, value=found.excess[0]
                )
            )
    return dropped


def check_repetition(records: PeriodicRecords) -> list[RecordFinding]:
    """Return leakage findings, about signals that do not repeat with the period.

    Two causes are distinguished: a period that is not a whole number of samples (the phase at
    the excited lines advances from period to period), and a reference that changes. Raises
    InputError if the phase at the highest line turns by more than 0.5 rad over the record, or if
    the periods are not copies of each other.
    """
    findings: list[RecordFinding] = []
    if records.n_periods < 2:
        return findings
    source = "input" if records.reference is None else "reference"
    signals = records.input if records.reference is None else records.reference
    highest = 2 * np.pi * records.lines[-1] / records.n_samples
    for e, signal in enumerate(signals, 1):
        c = int(signal.std(axis=(0, 1)).argmax())
        x = signal[:, :, c]
        label = f"{source} {c + 1}"
        slope, error = _slip(x, records, e, label)
        turn = abs(slope) * highest * records.n_periods
        if abs(slope) > 4 * error and turn > _PHASE_REFUSE_RAD:
            raise InputError(f"experiment {e}, {label}: {not_whole(records.n_samples + slope)}")
        if abs(slope) > 4 * error and turn > _PHASE_WARN_RAD:
            message = (
                f"leakage: the period is {records.n_samples + slope:.5f} samples, not "
                f"{records.n_samples}; the phase at line {records.lines[-1]} turns by {turn:.2g} rad "
                "over the record; resample, or tie the clocks"
            )
            findings.append(RecordFinding(FindingKind.LEAKAGE, message, True, e, label, turn))
            continue
        typical = np.median(x, axis=0)
        changes = np.sqrt(np.mean((x - typical) ** 2, axis=1)) / x.std()
        change, worst = float(changes.max()), int(changes.argmax()) + 1
        if source == "reference" and change > _REPEAT_LIMIT:
            message = (
                f"leakage: it does not repeat with the period, by {change:.2g} of its RMS in "
                f"period {worst} of those kept; leave that period out, or look at the recording"
            )
            findings.append(RecordFinding(FindingKind.LEAKAGE, message, True, e, label, change))
    return findings


def _slip(x: Real, records: PeriodicRecords, e: int, label: str) -> tuple[float, float]:
    """Return the delay per period [samples] of ``x`` (n_periods, N), and its standard error."""
    try:
        delays = [estimate_delay(row, x[0], records.lines, free_sign=False) for row in x[1:]]
    except InputError as error:
        raise InputError(
            f"experiment {e}, {label}: expected to repeat with the period of {records.n_samples} "
            f"samples, got periods that are no copies of one another ({error})"
        ) from error
    late = np.array([d.samples for d in delays])
    order = np.arange(1, len(late) + 1)
    squares = float(order @ order)
    slope = float(order @ late) / squares
    spread = (late - slope * order) @ (late - slope * order) / max(len(late) - 1, 1)
    own = float(np.mean([d.standard_error**2 for d in delays]))
    return slope, float(np.sqrt(max(spread, own) / squares))
