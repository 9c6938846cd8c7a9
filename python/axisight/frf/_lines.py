"""What the estimators share: spectra of records, the motion wanted, state of the input."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from axisight import _core
from axisight.errors import InputError
from axisight.frf.response import Flag
from axisight.records.periodic import PeriodicRecords

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]
Quantity = Literal["position", "velocity", "acceleration"]
ORDER = {"position": 0, "velocity": 1, "acceleration": 2}

SMALLEST = 1e-12
"""Amplitudes and singular values below this share of the largest are rounding."""

LARGE_CONDITION = 1e3


def line_factor(frequency_hz: Real, quantity: Quantity) -> Complex:
    """``(i w)^p`` on the lines, for the p-th derivative of a recorded position."""
    if quantity not in ORDER:
        raise InputError(f"quantity: expected one of {', '.join(ORDER)}, got {quantity!r}")
    return np.asarray((2j * np.pi * frequency_hz) ** ORDER[quantity], np.complex128)


def output_unit(records: PeriodicRecords, quantity: Quantity) -> str:
    """Unit of the output, seconds added."""
    return records.output_unit + ("", "/s", "/s^2")[ORDER[quantity]]


def provenance(records: PeriodicRecords, quantity: Quantity) -> dict[str, Any]:
    """Attributes every estimate from records carries."""
    return {
        "quantity": quantity,
        "n_experiments": records.n_experiments,
        "n_periods": records.n_periods,
        "n_samples": records.n_samples,
        "sample_time_s": records.sample_time_s,
    }


def spectra(
    records: PeriodicRecords, quantity: Quantity, *, remove_drift: bool, threads: int
) -> tuple[Complex, Complex]:
    """Spectra of input and output on the lines, (n_freq, channel, experiment, period)."""
    factor = line_factor(records.frequency_hz, quantity)
    lines = records.lines.tolist()

    def of(signal: Real, drifts: bool) -> Complex:
        found = _core.record_spectra(signal, lines, remove_drift=drifts, threads=threads)
        return np.ascontiguousarray(found.transpose(2, 3, 0, 1))

    output = of(records.output, remove_drift) * factor[:, None, None, None]
    return of(records.input, False), output


def condition_and_flag(u: Complex) -> tuple[Real, NDArray[np.int8]]:
    """Condition number of U (n_freq, n_inputs, n_columns), rows scaled to one, and flags."""
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
    """Raise InputError where the experiments are too few for any line."""
    if records.n_experiments < records.n_inputs:
        raise InputError(
            f"records: expected at least {records.n_inputs} experiments for "
            f"{records.n_inputs} inputs, got {records.n_experiments}: {why}"
        )
