"""Turn recorded signals into periodic records: cut, check and align them, and report findings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from axisight.arguments import (
    Lines,
    Real,
    between,
    instance,
    lines_below,
    not_negative,
    positive,
    several,
    switch,
    whole,
    words,
)
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.logs import Log
from axisight.records.checks import check_clipping, check_dead, check_repetition, keep_steady
from axisight.records.delays import Delay, advance, reference_delays
from axisight.records.drift import drift_per_period, remove_drift
from axisight.records.experiment import Experiment, experiment_of_log
from axisight.records.findings import FindingKind, RecordFinding
from axisight.records.lines import excited_lines, widest_gap
from axisight.records.period import Period, find_period, not_whole
from axisight.records.periodic import PeriodicRecords

_DRIFT_LIMIT = 0.01  # largest error over the whole record from rounding a given period [samples]
_CLEAR_MARGIN_DB = 6.0
_DRIFT_WORTH_SAYING = 1e-3  # share of the RMS, per period


@summarized
@dataclass(frozen=True)
class Prepared:
    """Records ready for estimation, with everything that preparing them found.

    records
        The periods that were kept.
    period
        Period and its uncertainty; `repetition` is NaN if the caller gave the period.
    dropped_periods
        Number of periods dropped before the first kept one.
    delays
        Delay removed from each experiment; empty without ``synchronise``.
    findings
        What was seen and done, in the order of the steps.
    """

    records: PeriodicRecords
    period: Period
    dropped_periods: int
    delays: tuple[Delay, ...]
    findings: tuple[RecordFinding, ...]

    @property
    def serious(self) -> tuple[RecordFinding, ...]:
        """The findings that put estimates in doubt."""
        return tuple(f for f in self.findings if f.serious)


def prepare_records(
    experiments: Sequence[Experiment | Log],
    *,
    period_s: float | None = None,
    lines: Sequence[int] | Lines | None = None,
    detection_lines: Sequence[int] | Lines = (),
    skip_s: float = 0.0,
    waiting_time_s: float = 0.0,
    drop_periods: int | None = None,
    significance: float = 0.01,
    drift: bool = True,
    synchronise: bool = False,
    excitation: Real | None = None,
    input_unit: str = "Nm",
    output_unit: str = "rad",
) -> Prepared:
    """Return experiments cut into whole periods in steady state, aligned on request.

    experiments
        :class:`Experiment`, or `axisight.Log` (see :func:`experiment_of_log`), with the same sample time and
        the same channels.
    period_s
        Period [s], a whole number of samples. None takes that of the logs, or else finds it from the
        reference, or from the input without a reference (:func:`find_period`).
    lines, detection_lines
        Excited lines, and lines left free to detect distortion. None finds the excited lines from the
        reference, or from the input without one (:func:`excited_lines`).
    skip_s
        Time before the excitation starts [s].
    waiting_time_s
        Time after that start [s]; periods that begin before its end are dropped untested, see
        :func:`waiting_time_s`.
    drop_periods
        Number of periods to drop. None lets :func:`steady_state` decide.
    significance
        Probability of dropping a period without need, over all experiments together.
    drift
        Whether to remove the linear drift of the outputs (:func:`remove_drift`).
    synchronise, excitation
        Whether to align the experiments by their references, and the excitation to align to
        (:func:`reference_delays`). Cutting later removes whole samples, a phase ramp the rest.
    input_unit, output_unit
        Units, for labels.

    Every experiment keeps its last periods, as many as the shortest has. Raises InputError, naming the field,
    for signals that do not fit together, and for a period that is not whole, differs between experiments, or
    exceeds the signals. It also raises InputError if no period is left, and as :class:`PeriodicRecords`.
    """
    given = several("experiments", experiments)
    for e in given:
        instance("experiments", e, Experiment, Log)
    runs = [e if isinstance(e, Experiment) else experiment_of_log(e) for e in given]
    _expect_alike(runs)
    sample_time_s = runs[0].sample_time_s
    significance = between("significance", significance, 0, 1)
    drift, synchronise = switch("drift", drift), switch("synchronise", synchronise)
    for name, unit in (("input_unit", input_unit), ("output_unit", output_unit)):
        words(name, unit)
    if drop_periods is not None:
        drop_periods = whole("drop_periods", drop_periods, 0)
    start = _samples("skip_s", skip_s, runs, 1e-6)
    findings: list[RecordFinding] = []
    period = _period(given, runs, period_s, start, findings)
    n = period.n_samples
    free = lines_below("detection_lines", detection_lines, n)
    if lines is not None:
        lines = lines_below("lines", lines, n)
        if not lines.size:
            raise InputError("lines: expected at least one excited line, got none")
    starts = [start] * len(runs)
    cut = _cut(runs, starts, n)
    excited = _excited(cut, lines, findings)
    delays: list[Delay] = []
    if synchronise:
        rough = _records(sample_time_s, _equal(cut), excited, free)
        delays = reference_delays(rough, excitation)
        starts = [start + round(d.samples) % n for d in delays]
        cut = _cut(runs, starts, n)
        findings += _delay_findings(delays)
    findings += check_clipping(runs, start) + check_dead(runs, start)
    wait = -(-_samples("waiting_time_s", waiting_time_s, runs, 1e-9 * n) // n)
    last = int(np.max([*excited, *free]))
    judged = [_without_drift(c) for c in cut] if drift else cut
    dropped = keep_steady(judged, wait, drop_periods, last, significance, findings)
    counts = [len(c["input"]) - dropped for c in cut]
    if min(counts) < 1:
        raise InputError(
            f"drop_periods, waiting_time_s: expected to keep a period, got {dropped} to drop of "
            f"{min(counts) + dropped}"
        )
    if len(set(counts)) > 1:
        message = f"whole periods {counts} differ; the last {min(counts)} of each were kept"
        findings.append(RecordFinding(FindingKind.UNEQUAL, message))
    kept = [{k: v[-min(counts) :] for k, v in c.items()} for c in cut]
    if drift:  # again, from the signals as recorded but without the transient
        findings += _drift_findings(kept)
        kept = [_without_drift(c) for c in kept]
    if delays:
        kept = [
            {k: advance(v, d.samples - round(d.samples)) for k, v in c.items()}
            for c, d in zip(kept, delays, strict=True)
        ]
    records = _records(sample_time_s, _stack(kept), excited, free, (input_unit, output_unit))
    findings += check_repetition(records)
    return Prepared(records, period, dropped, tuple(delays), tuple(findings))


def _samples(field: str, seconds: float, runs: list[Experiment], slack: float) -> int:
    """Return the number of samples that begin within a time, at most the length of the longest run."""
    count = not_negative(field, seconds) / runs[0].sample_time_s
    longest = max(run.n_samples for run in runs)
    return math.ceil(count - slack) if count < longest else longest


def _expect_alike(runs: list[Experiment]) -> None:
    if not runs:
        raise InputError("experiments: expected at least one, got none")
    first = runs[0]
    for e, run in enumerate(runs[1:], 2):
        if not math.isclose(run.sample_time_s, first.sample_time_s, rel_tol=1e-9):
            raise InputError(
                f"sample_time_s: expected {first.sample_time_s} as experiment 1, got "
                f"{run.sample_time_s} in experiment {e}"
            )
        for name in ("input", "output", "reference"):
            mine, its = getattr(run, name), getattr(first, name)
            a, b = (0 if x is None else x.shape[1] for x in (mine, its))
            if a != b:
                raise InputError(
                    f"{name}: expected {b} channels as experiment 1, got {a} in experiment {e}"
                )


def _period(
    experiments: list[Experiment | Log],
    runs: list[Experiment],
    period_s: float | None,
    start: int,
    findings: list[RecordFinding],
) -> Period:
    sample_time_s = runs[0].sample_time_s
    shortest = min(run.n_samples for run in runs) - start
    if period_s is None:
        noted = {e.period_s for e in experiments if isinstance(e, Log)} - {None}
        if len(noted) > 1:
            raise InputError(f"period_s: expected one for all logs, got {noted}")
        period_s = noted.pop() if noted else None
    if period_s is None:
        return _found_period(runs, start, findings)
    samples = positive("period_s", period_s) / sample_time_s
    if not math.isfinite(samples):
        raise InputError(f"period_s: expected at most the experiment, got {period_s} s")
    n_periods = int((shortest + 0.5) // samples)
    if abs(samples - round(samples)) * max(n_periods, 1) > _DRIFT_LIMIT or round(samples) < 3:
        raise InputError(not_whole(samples))
    if shortest < round(samples):
        raise InputError(
            f"period_s: expected at most the shortest experiment's {shortest * sample_time_s:g} s "
            f"after skip_s, got {period_s:g} s"
        )
    return Period(float(round(samples)), 0.0, float("nan"), n_periods)


def _found_period(runs: list[Experiment], start: int, findings: list[RecordFinding]) -> Period:
    found = []
    for e, run in enumerate(runs, 1):
        signal = run.input if run.reference is None else run.reference
        try:
            found.append(find_period(signal[start:]))
        except InputError as error:
            raise InputError(f"experiment {e}: {error}") from error
    lengths = [p.n_samples for p in found]
    if len(set(lengths)) > 1:
        raise InputError(
            f"period: expected the same for all experiments, got {lengths} samples; estimate them "
            "apart, or give period_s if one of them is a multiple"
        )
    least = min(found, key=lambda p: p.repetition)
    source = "input" if runs[0].reference is None else "reference"
    message = (
        f"period of {least.n_samples} samples found from the {source}: {least.samples:.4f} +- "
        f"{least.standard_error:.1g}, autocorrelation {least.repetition:.4f}, "
        f"{least.n_periods} periods"
    )
    findings.append(RecordFinding(FindingKind.PERIOD, message, value=least.samples))
    return least


Signals = dict[str, Real]


def _cut(runs: list[Experiment], starts: list[int], n: int) -> list[Signals]:
    """Return whole periods (n_periods, n, channels) of every signal, from the given sample on."""
    cut = []
    for e, (run, start) in enumerate(zip(runs, starts, strict=True), 1):
        n_periods = (run.n_samples - start) // n
        if n_periods < 1:
            raise InputError(
                f"experiment {e}: expected a whole period of {n} samples from sample {start + 1} "
                f"on, got {max(run.n_samples - start, 0)} samples"
            )
        signals = {"input": run.input, "output": run.output, "reference": run.reference}
        cut.append(
            {
                name: value[start : start + n_periods * n].reshape(n_periods, n, -1)
                for name, value in signals.items()
                if value is not None
            }
        )
    return cut


def _equal(cut: list[Signals]) -> Signals:
    n_periods = min(len(c["input"]) for c in cut)
    return _stack([{k: v[-n_periods:] for k, v in c.items()} for c in cut])


def _stack(cut: list[Signals]) -> Signals:
    return {name: np.stack([c[name] for c in cut]) for name in cut[0]}


def _records(
    sample_time_s: float,
    signals: Signals,
    lines: Lines,
    detection_lines: Lines,
    units: tuple[str, str] = ("", ""),
) -> PeriodicRecords:
    return PeriodicRecords(
        sample_time_s,
        signals["input"],
        signals["output"],
        lines,
        reference=signals.get("reference"),
        input_unit=units[0],
        output_unit=units[1],
        detection_lines=detection_lines,
    )


def _excited(cut: list[Signals], lines: Lines | None, findings: list[RecordFinding]) -> Lines:
    if lines is not None:
        return lines
    source = "reference" if "reference" in cut[0] else "input"
    signal = _equal(cut)[source]
    found = excited_lines(signal)
    if found.margin_db < _CLEAR_MARGIN_DB and (floor := widest_gap(signal)) is not None:
        # Distortion and noise repeat or come close; a gap in the levels separates them from the excitation.
        found = excited_lines(signal, floor_db=floor)
    unsure = found.margin_db < _CLEAR_MARGIN_DB
    message = (
        f"{len(found.lines)} excited lines, {found.lines[0]} to {found.lines[-1]} times one over the period, "
        f"found from the {source}; the weakest is {found.margin_db:.1f} dB over the strongest other line"
        + ("; give lines" if unsure else "")
    )
    findings.append(
        RecordFinding(FindingKind.LINES, message, serious=unsure, value=found.margin_db)
    )
    return found.lines


def _delay_findings(delays: list[Delay]) -> list[RecordFinding]:
    return [
        RecordFinding(
            FindingKind.DELAY,
            f"{d.samples:.4f} +- {d.standard_error:.1g} samples late; aligned",
            experiment=e,
            value=d.samples,
        )
        for e, d in enumerate(delays, 1)
        if abs(d.samples) > max(4 * d.standard_error, 1e-6)
    ]


def _without_drift(signals: Signals) -> Signals:
    output = signals["output"]
    return signals if len(output) < 2 else {**signals, "output": remove_drift(output)}


def _drift_findings(kept: list[Signals]) -> list[RecordFinding]:
    findings = []
    for e, signals in enumerate(kept, 1):
        output = signals["output"]
        if len(output) < 2:
            continue
        slope = drift_per_period(output)
        swing = output.std(axis=1).mean(axis=0)
        for c in np.flatnonzero(np.abs(slope) > _DRIFT_WORTH_SAYING * swing):
            message = (
                f"linear drift of {slope[c]:.3g} a period removed ({slope[c] / swing[c]:.1%} of "
                "the RMS)"
            )
            value = float(slope[c])
            findings.append(
                RecordFinding(FindingKind.DRIFT, message, False, e, f"output {c + 1}", value)
            )
    return findings
