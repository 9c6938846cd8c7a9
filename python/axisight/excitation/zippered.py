"""Excitation of all inputs in one experiment, each at its own lines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from axisight.arguments import instance, several, whole
from axisight.errors import InputError
from axisight.excitation.checks import few_enough, per_item
from axisight.excitation.directions import MOST_INPUTS
from axisight.excitation.multisine import Multisine
from axisight.excitation.references import References, describe, repeated
from axisight.excitation.signals import PeriodicSignal


def zippered(signal: Multisine, n_inputs: int) -> tuple[Multisine, ...]:
    """Return one multisine per input, which share the lines of ``signal`` in turn.

    Input i has the lines number i, i + n, i + 2 n, ... of the signal, with their amplitudes and phases.
    The inputs together have the power of the signal. Each keeps the detection lines, and loses the
    snow. Source: Rivera, Lee, Mittelmann and Braun (2009), section on zippered spectra.

    Raises InputError for fewer lines than inputs.
    """
    instance("signal", signal, Multisine)
    n = whole("n_inputs", n_inputs, 1, MOST_INPUTS)
    if len(signal.lines) < n:
        raise InputError(f"signal: expected at least {n} lines, got {len(signal.lines)}")
    none = np.empty(0)
    return tuple(
        replace(
            signal,
            lines=signal.lines[i::n],
            amplitude=signal.amplitude[i::n],
            phase_rad=signal.phase_rad[i::n],
            snow_lines=np.empty(0, np.int64),
            snow_amplitude=none,
            snow_phase_rad=none,
        )
        for i in range(n)
    )


def simultaneous_references(
    signals: Sequence[Multisine],
    *,
    square: PeriodicSignal | None = None,
    dc_level: ArrayLike = 0.0,
    unit: str = "rad/s",
) -> References:
    """Return the references of one experiment with a multisine of its own for every input.

    signals
        One multisine per input, of one period and sample time: with different lines (:func:`zippered`)
        or with the same lines and other phases.
    square, dc_level, unit
        As for :func:`references`.

    `axisight.frf.local_joint_input_output` estimates the response from the experiment. Raises
    InputError naming the field.
    """
    given = [instance("signals", s, Multisine) for s in several("signals", signals)]
    if not given:
        raise InputError("signals: expected at least one multisine, got none")
    first = given[0]
    for i, s in enumerate(given, 1):
        if (s.n_samples, s.sample_time_s) != (first.n_samples, first.sample_time_s):
            raise InputError(
                f"signals: expected {first.n_samples} samples of {first.sample_time_s} s, got "
                f"{s.n_samples} of {s.sample_time_s} s for input {i}"
            )
    few_enough("signals", len(given) * first.n_samples)
    period = np.stack([s.period for s in given], axis=1)
    if square is not None:
        instance("square", square, PeriodicSignal)
        period = period + repeated(square, first)[:, None]
    level = per_item("dc_level", dc_level, len(given))
    lines = np.unique(np.concatenate([s.lines for s in given]))
    free = np.unique(np.concatenate([s.detection_lines for s in given]))
    return References(
        sample_time_s=first.sample_time_s,
        period=(period + level)[None],
        lines=lines,
        detection_lines=np.setdiff1d(free, lines),
        unit=unit,
        design={
            "schema": "axisight.excitation/1",
            "directions": "zippered",
            "signals": [describe(s) for s in given],
            "square": None if square is None else describe(square),
            "dc_level": level.tolist(),
        },
    )
