"""Responses from logs that do not repeat."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from axisight.arguments import Lines
from axisight.errors import InputError
from axisight.records import ArbitraryRecords, Experiment
from axisight.responses.account import Setting
from axisight.responses.estimators import chosen_of_arbitrary, estimate_arbitrary
from axisight.responses.options import Estimated, Options
from axisight.responses.with_period import said_choice

# Level below the strongest at which a line of a signal without a period no longer counts as excited.
_FLOOR_DB = -40.0


def estimate_without_period(
    runs: Sequence[Experiment], labels: tuple[str, str], options: Options
) -> Estimated:
    """Return the response from logs that do not repeat, cut to the shortest."""
    choice = chosen_of_arbitrary(options.estimator, options.average)
    n = min(run.n_samples for run in runs)
    records = ArbitraryRecords(
        runs[0].sample_time_s,
        np.stack([run.input[:n] for run in runs]),
        np.stack([run.output[:n] for run in runs]),
        input_unit=labels[0],
        output_unit=labels[1],
    )
    lines, source = _lines_of_band(runs, n, options.band_hz)
    response = estimate_arbitrary(records, lines, choice, options.quantity, options.bandwidth_hz)
    frequency = response["frequency_hz"].values
    choices = [
        "period: none, the logs do not repeat; a periodic excitation gives a smaller error in the same time",
        f"lines: {len(frequency)} of the record, {frequency[0]:.4g} to {frequency[-1]:.4g} Hz, {source}",
        said_choice(choice, response),
    ]
    return Estimated(response, records, choices, (), Setting(False, 0, False))


def _lines_of_band(
    runs: Sequence[Experiment], n: int, band_hz: tuple[float, float] | None
) -> tuple[Lines, str]:
    """Return the lines of a record of n samples within the band, or within the band of its excitation."""
    step = runs[0].sample_time_s
    lines = np.arange(1, (n - 1) // 2 + 1)
    if band_hz is not None:
        low, high = band_hz
        inside = lines[(lines >= low * n * step) & (lines <= high * n * step)]
        if not inside.size:
            raise InputError(
                f"band_hz: expected lines of the record, 1 / {n * step:g} s apart, got none between {low:g} "
                f"and {high:g} Hz"
            )
        return inside, "given"
    whole = all(run.reference is not None for run in runs)
    signals = [run.reference if whole else run.input for run in runs]
    level = np.zeros(len(lines))
    for signal in signals:
        if signal is None:
            continue
        part = signal[:n] - signal[:n].mean(axis=0)
        taper = np.hanning(n)[:, None]
        size = np.abs(np.fft.rfft(part * taper, axis=0))[lines]
        most = size.max(axis=0)
        level = np.maximum(level, (size / np.where(most > 0, most, 1.0)).max(axis=1))
    excited = np.flatnonzero(level > 10 ** (_FLOOR_DB / 20))
    if not excited.size:
        raise InputError("logs: expected an excitation, got constant signals")
    name = "reference" if whole else "torque"
    return lines[
        excited[0] : excited[-1] + 1
    ], f"where the {name} is within 40 dB of its strongest line"
