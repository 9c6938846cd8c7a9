"""Shared by the estimators: spectra of records, quantity of the output, flags of the input."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from axisight import _core
from axisight.arguments import Complex, Lines, Real, instance, one_of, switch, threads_of
from axisight.errors import InputError
from axisight.frf.response import Flag
from axisight.records.arbitrary import ArbitraryRecords
from axisight.records.periodic import PeriodicRecords

Quantity = Literal["position", "velocity", "acceleration"]
ORDER: dict[Quantity, int] = {"position": 0, "velocity": 1, "acceleration": 2}
RATES: dict[Quantity, str] = {"position": "", "velocity": "/s", "acceleration": "/s^2"}
"""Suffix of the unit of position for each derivative."""

SMALLEST = 1e-12
"""Amplitudes and singular values below this share of the largest are rounding."""

LARGE_CONDITION = 1e3


def line_factor(frequency_hz: Real, quantity: Quantity) -> Complex:
    """Return ``(i w)^p`` at the lines, for the p-th derivative of a recorded position."""
    one_of("quantity", quantity, ORDER)
    return np.asarray((2j * np.pi * frequency_hz) ** ORDER[quantity], np.complex128)


def output_unit(records: PeriodicRecords | ArbitraryRecords, quantity: Quantity) -> str:
    """Return the unit of the output, with seconds for derivatives."""
    one_of("quantity", quantity, ORDER)
    return records.output_unit + RATES[quantity]


def provenance(records: PeriodicRecords, quantity: Quantity) -> dict[str, Any]:
    """Return the attributes of every estimate from records."""
    return {
        "quantity": quantity,
        "n_experiments": records.n_experiments,
        "n_periods": records.n_periods,
        "n_samples": records.n_samples,
        "sample_time_s": records.sample_time_s,
    }


def expect_options(
    records: PeriodicRecords, quantity: Quantity, remove_drift: bool, threads: int
) -> None:
    """Check the arguments common to all estimators of periodic records."""
    instance("records", records, PeriodicRecords)
    one_of("quantity", quantity, ORDER)
    switch("remove_drift", remove_drift)
    threads_of(threads)


def line_spectra(
    signal: Real, lines: Lines, *, remove_drift: bool = False, threads: int = 1
) -> Complex:
    """Return the DFT of every period of a signal at lines, (n_freq, channel, experiment, period)."""
    found = _core.record_spectra(signal, lines.tolist(), remove_drift=remove_drift, threads=threads)
    return np.ascontiguousarray(found.transpose(2, 3, 0, 1))


def spectra(
    records: PeriodicRecords,
    quantity: Quantity,
    *,
    remove_drift: bool,
    threads: int,
    lines: Lines | None = None,
) -> tuple[Complex, Complex]:
    """Return the spectra of input and output, (n_freq, channel, experiment, period).

    ``lines`` are the excited lines by default.
    """
    at = records.lines if lines is None else lines
    factor = line_factor(at / (records.n_samples * records.sample_time_s), quantity)
    output = line_spectra(records.output, at, remove_drift=remove_drift, threads=threads)
    return (
        line_spectra(records.input, at, threads=threads),
        output * factor[:, None, None, None],
    )


def lost_lines(flag: NDArray[np.int8]) -> NDArray[np.bool_]:
    """Return which lines have no estimate."""
    return np.asarray((flag == Flag.RANK_DEFICIENT) | (flag == Flag.NO_EXCITATION))


def worst_flag(flags: NDArray[np.int8]) -> NDArray[np.int8]:
    """Return the worst flag along the first axis: no excitation, then deficient, then ill-conditioned."""
    out = np.full(flags.shape[1:], Flag.GOOD, np.int8)
    for flag in (Flag.ILL_CONDITIONED, Flag.RANK_DEFICIENT, Flag.NO_EXCITATION):
        out[(flags == flag).any(axis=0)] = flag
    return out


def in_noise(u: Complex) -> NDArray[np.bool_]:
    """Return at which lines the weakest direction of U is lost in the scatter of the periods.

    ``u`` is (n_freq, n_inputs, n_experiments, n_periods), with at least as many experiments as inputs.
    Like the compiled estimate, it compares the smallest singular value of the mean, rows scaled to
    one, with twice the rms of the noise along a direction. If even the strongest direction is lost at
    half of the lines, the periods are not copies of one another and their scatter is not noise; then
    no line is lost.
    """
    periods = u.shape[3]
    if periods < 2:
        return np.zeros(len(u), bool)
    mean = u.mean(axis=3)
    power = np.sum(np.abs(mean) ** 2, axis=2)
    scatter = np.sum(np.abs(u - mean[..., None]) ** 2, axis=(2, 3))
    known = power > 0
    share = np.divide(scatter, power, out=np.zeros_like(power), where=known)
    noise = share.mean(axis=1) / (periods * (periods - 1))
    scaled = mean / np.sqrt(np.where(known, power, 1.0))[:, :, None]
    value = np.linalg.svd(scaled, compute_uv=False)
    repeats = value[:, 0] ** 2 >= 4 * noise
    if np.mean(repeats) < 0.5:
        return np.zeros(len(u), bool)
    return np.asarray(value[:, -1] ** 2 < 4 * noise)


def condition_and_flag(u: Complex) -> tuple[Real, NDArray[np.int8]]:
    """Return the condition number of U (n_freq, n_inputs, n_columns), rows scaled to one, and flags."""
    norm = np.linalg.norm(u, axis=2)
    silent = np.any(norm <= SMALLEST * norm.max(axis=0), axis=1)
    scaled = u / np.where(norm > 0, norm, 1.0)[:, :, None]
    value = np.linalg.svd(scaled, compute_uv=False)
    short = u.shape[2] < u.shape[1]
    deficient = (value[:, -1] <= SMALLEST * value[:, 0]) | short
    usable = ~(silent | deficient)
    condition = np.full(len(u), np.nan)
    condition[usable] = value[usable, 0] / value[usable, -1]
    flag = np.where(condition > LARGE_CONDITION, Flag.ILL_CONDITIONED, Flag.GOOD)
    flag[deficient] = Flag.RANK_DEFICIENT
    flag[silent] = Flag.NO_EXCITATION
    return condition, flag.astype(np.int8)


def expect_experiments(records: PeriodicRecords, why: str) -> None:
    """Raise InputError if there are fewer experiments than inputs."""
    if records.n_experiments < records.n_inputs:
        raise InputError(
            f"records: expected at least {records.n_inputs} experiments for "
            f"{records.n_inputs} inputs, got {records.n_experiments}: {why}"
        )
