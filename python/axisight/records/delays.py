"""Delays between experiments that were not started in step, and their removal.

An experiment that starts a time tau late within the period has every DFT line turned by
``exp(-i w tau)``. The delay is found in two steps: to a sample by the largest circular
cross-correlation, to a fraction of it by weighted regression of the remaining phase over the
excited lines, a straight line through zero. It is taken out in two steps too: whole samples by
shifting, which changes no number; the rest by a phase ramp over the DFT of the whole record.
For periodic records the ramp is exact, where a resampling filter would have edges and ripple.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from axisight.arguments import Complex, Lines, Real, instance, lines_below, reals, switch
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.records.periodic import PeriodicRecords

_LEAST_FIT = 0.9  # mean resultant length of the phases that are left


@summarized
@dataclass(frozen=True)
class Delay:
    """A delay against the excitation.

    samples
        How late the signal is [samples], in (-N/2, N/2].
    standard_error
        Standard error [samples], from the scatter of the phases.
    sign
        1 or -1: the signal is the excitation, or minus it.
    """

    samples: float
    standard_error: float
    sign: int


def estimate_delay(
    signal: Real, excitation: Real, lines: Lines, *, free_sign: bool = True
) -> Delay:
    """Return how late ``signal`` (N,) is against ``excitation`` (N,), one period of each.

    lines
        The excited lines (n_lines,), the only ones that count; each weighs with its power.
    free_sign
        Whether the signal may be minus the excitation. For an excitation of odd lines minus
        is half a period late: the smaller delay is chosen.

    Raises InputError if shapes differ, nothing is excited, or the signal is no delayed copy of
    the excitation (mean resultant length of the remaining phases under 0.9).
    """
    signal = reals("signal", signal, "numbers of shape (N,)", 1)
    excitation = reals("excitation", excitation, "numbers of shape (N,)", 1)
    lines = lines_below("lines", lines, len(signal))
    switch("free_sign", free_sign)
    if not lines.size:
        raise InputError("lines: expected at least one excited line, got none")
    if signal.shape != excitation.shape:
        raise InputError(f"excitation: expected shape {signal.shape}, got {excitation.shape}")
    n = len(signal)
    cross = (np.fft.rfft(signal) * np.fft.rfft(excitation).conj())[lines]
    weight = np.abs(cross)
    energy = n * float(np.linalg.norm(signal) * np.linalg.norm(excitation))
    if not weight.sum() > 1e-12 * energy:
        raise InputError("excitation: expected amplitude at the excited lines, got none")
    spectrum = np.zeros(n // 2 + 1, complex)
    spectrum[lines] = cross
    correlation = np.fft.irfft(spectrum, n)
    height = np.abs(correlation) if free_sign else correlation
    distance = np.minimum(np.arange(n), n - np.arange(n))
    # Of equally high peaks (odd lines: half a period apart) the nearest.
    top = int(np.argmin(np.where(height >= height.max() * (1 - 1e-6), distance, n)))
    sign = -1 if correlation[top] < 0 else 1
    whole = top - n if top > n // 2 else top
    omega = 2 * np.pi * lines / n
    left = np.angle(sign * cross * np.exp(1j * omega * whole))
    squares = float(weight @ omega**2)
    fraction = -float(weight @ (omega * left)) / squares
    rest = left + omega * fraction
    fit = float(np.abs(weight @ np.exp(1j * rest)) / weight.sum())
    if fit < _LEAST_FIT:
        raise InputError(
            "excitation: expected the signal to be a delayed copy of it, got phases that fit no "
            f"delay (resultant {fit:.2f}, below {_LEAST_FIT})"
        )
    scatter = float((weight * omega) ** 2 @ rest**2) / squares**2
    correction = len(lines) / max(len(lines) - 1, 1)
    return Delay(whole + fraction, float(np.sqrt(scatter * correction)), sign)


def reference_delays(records: PeriodicRecords, excitation: Real | None = None) -> list[Delay]:
    """Return the delay of each experiment against the known excitation.

    excitation
        One period: (N,), of which every reference channel is a multiple (r = T r_0, any sign), or
        (n_experiments, N, n_references) as designed, with its signs. None: the strongest
        reference of experiment 1.

    The strongest reference channel of each experiment is compared. Raises InputError if there
    is no reference, shapes differ, or a reference is no delayed copy of its excitation.
    """
    instance("records", records, PeriodicRecords)
    if records.reference is None:
        raise InputError("reference: expected one to synchronise by, got records without")
    mean = records.reference.mean(axis=1)
    power = np.abs(np.fft.rfft(mean, axis=1)[:, records.lines]) ** 2
    channel = power.sum(axis=1).argmax(axis=1)
    n_exp, n, n_ref = mean.shape
    known = mean[0, :, channel[0]]
    if excitation is not None:
        known = reals("excitation", excitation, f"shape ({n},) or ({n_exp}, {n}, {n_ref})", (1, 3))
    if known.shape not in ((n,), (n_exp, n, n_ref)):
        raise InputError(
            f"excitation: expected shape ({n},) or ({n_exp}, {n}, {n_ref}), got {known.shape}"
        )
    free = known.ndim == 1
    delays = []
    for e, c in enumerate(channel):
        base = known if free else known[e, :, c]
        try:
            found = estimate_delay(mean[e, :, c], base, records.lines, free_sign=free)
        except InputError as error:
            raise InputError(f"experiment {e + 1}, reference {c + 1}: {error}") from error
        delays.append(found)
    return delays


def advance(signals: Real, samples: float) -> Real:
    """Return ``signals`` (n_periods, N, channels), periodic as a whole, earlier by ``samples``.

    Whole samples by rotation, the fraction by a phase ramp over all periods at once. The line
    at Nyquist, if there is one, keeps only the part a real signal can have there.
    """
    whole = round(samples)
    fraction = samples - whole
    n_periods, n, channels = signals.shape
    total = n_periods * n
    record = np.roll(signals.reshape(total, channels), -whole, axis=0)
    if fraction:
        spectrum = np.fft.rfft(record, axis=0)
        ramp: Complex = np.exp(2j * np.pi * fraction / total * np.arange(len(spectrum)))
        record = np.fft.irfft(spectrum * ramp[:, None], total, axis=0)
    return np.asarray(record.reshape(n_periods, n, channels))


def synchronise(
    records: PeriodicRecords, excitation: Real | None = None
) -> tuple[PeriodicRecords, list[Delay]]:
    """Return records whose experiments are in step with the excitation, and their delays.

    ``excitation`` as in :func:`reference_delays`, which also says what is raised. All signals of
    an experiment are shifted by its one delay. The records must be in steady state: the end of
    each wraps around to its start.

    ``Y U^-1`` of the same experiments does not need this (a delay turns a column of U and of Y
    alike); averaging over experiments and joint input-output estimates do.
    """
    delays = reference_delays(records, excitation)

    def aligned(signal: Real) -> Real:
        pairs = zip(signal, delays, strict=True)
        return np.stack([advance(x, delay.samples) for x, delay in pairs])

    assert records.reference is not None  # or reference_delays had refused
    moved = replace(
        records,
        input=aligned(records.input),
        output=aligned(records.output),
        reference=aligned(records.reference),
    )
    return moved, delays
