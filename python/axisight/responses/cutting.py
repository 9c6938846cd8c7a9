"""Cut logs into experiments: stretches in which the reference repeats."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from axisight.arguments import Real, counted
from axisight.errors import InputError, NotPeriodicError
from axisight.records import Experiment, find_period

# Largest difference between samples one period apart, as a share of the largest sample: rounding and
# resampling stay below, another experiment does not.
_SAME = 1e-3
# A stretch whose reference is below this share of the strongest is a rest, which repeats as well.
_RESTS = 0.01
# Parts of a log in which the period is looked for, as several experiments in a row repeat only apart.
_PARTS = (1, 2, 3, 4, 6, 8, 12, 16, 24)
# Share of the motion that must repeat with the period of a log.
_MOSTLY = 0.6


@dataclass(frozen=True)
class Cut:
    """An experiment, and where it stands in its log: samples ``start`` to ``stop`` of log ``log`` (from 0)."""

    experiment: Experiment
    log: int
    start: int
    stop: int


def common_period(experiments: Sequence[Experiment]) -> int | None:
    """Return the period of all experiments [samples]; None if none of them repeats.

    It is found from the reference, or from the input without one. Raises InputError if some experiments repeat
    and others do not, if their periods differ, and as :func:`axisight.records.find_period`.
    """
    found = {run.name: _period(run) for run in experiments}
    periods = {n for n in found.values() if n is not None}
    if not periods:
        return None
    if len(periods) > 1 or None in found.values():
        said = ", ".join(f"{name}: {n or 'none'}" for name, n in found.items())
        raise InputError(
            f"period: expected the same in all logs, got {said} (samples); estimate them apart, or give "
            "period_s"
        )
    return periods.pop()


def _period(run: Experiment) -> int | None:
    """Return the period of a log, which may hold several experiments in a row.

    A period found in a part of the log counts if the reference repeats with it over most of its motion.
    """
    if run.reference is None:
        return _found(run.input)
    for parts in _PARTS:
        length = len(run.reference) // parts
        for k in range(parts):
            try:
                found = _found(run.reference[k * length : (k + 1) * length])
            except InputError:
                continue  # the whole reference has the message
            if found is not None and _explains(run.reference, found):
                return found
    return _found(run.reference)


def _found(signal: Real) -> int | None:
    """Return the period of a signal, None if it does not move or repeat; raise as `find_period` else."""
    if not np.ptp(signal, axis=0).any():
        return None
    try:
        return find_period(signal).n_samples
    except NotPeriodicError:
        return None


def _explains(reference: Real, n_samples: int) -> bool:
    """Whether a reference repeats with a period wherever it moves, but for changes of experiment."""
    covered = sum(stop - start for start, stop in _repeating(reference, n_samples))
    still = np.abs(reference).max(axis=1) <= _SAME * np.abs(reference).max()
    return bool(covered > _MOSTLY * np.count_nonzero(~still))


def cut_at_changes(runs: Sequence[Experiment], n_samples: int) -> list[Cut]:
    """Return the experiments of all logs: each stretch in which the reference repeats with the period.

    A log without a reference, or without such a stretch of two periods, is one experiment. Every stretch is at
    least two periods long; rests are left out.
    """
    out = []
    for i, run in enumerate(runs):
        spans = [] if run.reference is None else _repeating(run.reference, n_samples)
        if not spans:
            spans = [(0, run.n_samples)]
        for k, (start, stop) in enumerate(spans):
            name = f"{run.name}#{k + 1}" if len(spans) > 1 else run.name
            part = slice(start, stop)
            reference = None if run.reference is None else run.reference[part]
            piece = replace(
                run, input=run.input[part], output=run.output[part], reference=reference, name=name
            )
            out.append(Cut(piece, i, start, stop))
    return out


def _repeating(reference: Real, n: int) -> list[tuple[int, int]]:
    """Return the stretches (start, stop) of at least two periods in which a reference repeats and moves."""
    if len(reference) < 2 * n:
        return []
    limit = _SAME * float(np.abs(reference).max())
    same = (np.abs(reference[n:] - reference[:-n]) <= limit).all(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate(([False], same, [False])).astype(np.int8)))
    spans = [
        (int(start), int(stop) + n)
        for start, stop in zip(edges[::2], edges[1::2], strict=True)
        if stop - start >= n
    ]
    strength = [float(np.std(reference[start : start + n], axis=0).max()) for start, _ in spans]
    most = max(strength, default=0.0)
    return [span for span, s in zip(spans, strength, strict=True) if s > _RESTS * most]


def said_cuts(cuts: Sequence[Cut], runs: Sequence[Experiment]) -> list[str]:
    """Return a sentence if logs hold several experiments, and one if parts of logs are left out."""
    out = []
    if len(cuts) > len(runs):
        out.append(
            f"experiments: {counted(len(cuts), 'stretch', 'stretches')} in which the reference repeats, in "
            f"{counted(len(runs), 'log')}"
        )
    left = [run.n_samples for run in runs]
    for cut in cuts:
        left[cut.log] -= cut.stop - cut.start
    most = max(left)
    if most > 0:
        step = runs[left.index(most)].sample_time_s
        out.append(
            f"left out where the reference does not repeat: up to {most * step:.3g} s of a log"
        )
    return out
