"""Estimate and remove delays between experiments that did not start at the same instant of the period.

If an experiment starts a time tau late within the period, every DFT line is multiplied by
``exp(-i w tau)``. The estimate takes two steps. The largest circular cross-correlation gives whole
samples. A weighted regression of the remaining phase over the excited lines, through zero, gives the
fraction. Removal takes two steps as well: a shift by whole samples, which changes no value, and a phase ramp
over the DFT of the whole record. The ramp is exact for periodic records; a resampling filter would have edges
and ripple.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from axisight.arguments import Complex, Lines, Real, instance, lines_below, reals, switch
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.records.periodic import PeriodicRecords

_LEAST_FIT = 0.9  # mean resultant length of the remaining phases


@summarized
@dataclass(frozen=True)
class Delay:
    """A delay against the excitation.

    samples
        Delay of the signal [samples], in (-N/2, N/2].
    standard_error
        Standard error [samples], from the scatter of the phases.
    sign
        1 if the signal is the delayed excitation, -1 if it is minus that.
    """

    samples: float
    standard_error: float
    sign: int


def estimate_delay(
    signal: Real, excitation: Real, lines: Lines, *, free_sign: bool = True
) -> Delay:
    """Return the delay of ``signal`` (N,) against ``excitation`` (N,), one period of each.

    lines
        Excited lines (n_lines,), weighted by their power; other lines do not count.
    free_sign
        Whether the signal may be minus the excitation. For an excitation with odd lines only, minus equals
        half a period of delay: the smaller delay is returned.

    Raises InputError if shapes differ, if nothing is excited, or if the signal is not a delayed copy of
    the excitation (mean resultant length of the remaining phases below 0.9).
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
    # Odd lines give equally high peaks half a period apart: take the nearest.
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

    records
        Periodic records with a reference; its strongest channel is compared in each experiment.
    excitation
        One period of the excitation. With shape (N,), every reference channel must be a multiple of it
        (r = T r_0, any sign). With shape (n_experiments, N, n_references), it is the reference as designed,
        with its signs. None means the strongest reference of experiment 1.

    Raises InputError if there is no reference, if shapes differ, or if a reference is not a delayed copy of
    its excitation.
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
    """Return ``signals`` (n_periods, N, channels) shifted earlier by ``samples``, as one periodic record.

    A rotation shifts by whole samples, a phase ramp over all periods at once by the fraction. At the Nyquist
    line, if there is one, only the real part remains.
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
    """Return ``records`` with all experiments aligned to the excitation, and the delays removed.

    ``excitation`` and the errors are those of :func:`reference_delays`. All signals of an experiment are
    shifted by the same delay. The records must be in steady state, because the end of each wraps around to
    its start.

    ``Y U^-1`` of the same experiments does not need this, as a delay multiplies a column of U and of Y by the
    same phase. Averages over experiments and joint input-output estimates need it.
    """
    delays = reference_delays(records, excitation)

    def aligned(signal: Real) -> Real:
        pairs = zip(signal, delays, strict=True)
        return np.stack([advance(x, delay.samples) for x, delay in pairs])

    assert records.reference is not None  # checked by reference_delays
    moved = replace(
        records,
        input=aligned(records.input),
        output=aligned(records.output),
        reference=aligned(records.reference),
    )
    return moved, delays
