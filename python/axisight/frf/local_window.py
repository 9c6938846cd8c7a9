"""Shared by the local methods: joined records, lines, and the width of the window."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight import _core
from axisight.arguments import instance, lines_below, switch, threads_of
from axisight.arguments import whole as whole_number
from axisight.errors import InputError
from axisight.frf._lines import Quantity, line_factor, output_unit
from axisight.frf.response import frequency_response
from axisight.records.arbitrary import ArbitraryRecords
from axisight.records.drift import remove_drift as without_drift
from axisight.records.periodic import PeriodicRecords

Records = PeriodicRecords | ArbitraryRecords
Lines = Sequence[int] | NDArray[np.int64]

HIGHEST_ORDER = 8

DEGREES_OF_FREEDOM = 12
"""Least degrees of freedom that a default window leaves. The 95 % disc for a known variance then holds
``1 - (1 - ln(0.05) / 12) ** -12`` = 93 % for the estimated one."""


@dataclass(frozen=True)
class Whole:
    """Records with joined periods, and the lines to estimate."""

    input: NDArray[np.float64]
    output: NDArray[np.float64]
    lines: NDArray[np.int64]
    n_periods: int
    frequency_hz: NDArray[np.float64]
    quantity: Quantity

    @property
    def bins(self) -> NDArray[np.int64]:
        """The lines to estimate, counted in lines of the whole record."""
        return self.lines * self.n_periods

    @property
    def last_bin(self) -> int:
        """Highest line of the whole record below half the sampling frequency."""
        return int((self.input.shape[1] - 1) // 2)


def whole(
    records: Records,
    lines: Lines | None,
    *,
    quantity: Quantity,
    remove_drift: bool,
    threads: int,
) -> Whole:
    """Return the records with joined periods and checked lines (None: all, or all excited)."""
    instance("records", records, PeriodicRecords, ArbitraryRecords)
    output_unit(records, quantity)
    switch("remove_drift", remove_drift)
    threads_of(threads)
    n_periods = 1
    chosen = None if lines is None else lines_below("lines", lines, records.n_samples)
    output = records.output
    if isinstance(records, PeriodicRecords):
        n_periods = records.n_periods
        chosen = records.lines if chosen is None else chosen
        if remove_drift and n_periods > 1:
            output = without_drift(output)
        joined = [a.reshape(records.n_experiments, -1, a.shape[3]) for a in (records.input, output)]
        other = np.setdiff1d(chosen, records.lines)
        if other.size:
            raise InputError(f"lines: expected excited lines of the records, got {other[0]}")
    else:
        if chosen is None:
            chosen = np.arange(1, (records.n_samples - 1) // 2 + 1)
        joined = [records.input, output]
    if not chosen.size:
        raise InputError("lines: expected at least one, got none")
    length = joined[0].shape[1] / n_periods
    frequency_hz = chosen / (length * records.sample_time_s)
    return Whole(joined[0], joined[1], chosen, n_periods, frequency_hz, quantity)


def regression(
    records: Records,
    data: Whole,
    *,
    estimator: str,
    order: int,
    denominator_order: int,
    half_width: int | None,
    threads: int,
) -> xr.Dataset:
    """Return the estimate by local regression over all lines of the record."""
    if half_width is None:
        half_width = _half_width(records, data, order, denominator_order)
    half_width = whole_number("half_width", half_width, 1)
    found = _core.frf_local_model(
        data.input,
        data.output,
        data.bins.tolist(),
        order=order,
        denominator_order=denominator_order,
        half_width=half_width,
        band=_band(records, data, half_width),
        threads=threads,
    )
    orders = {"order": order, "denominator_order": denominator_order, "half_width": half_width}
    return dataset(records, data, found, estimator, orders)


def dataset(
    records: Records,
    data: Whole,
    found: _core.LocalEstimate,
    estimator: str,
    attrs: dict[str, int],
) -> xr.Dataset:
    """Return the estimate of the core as the Dataset of `frequency_response`."""
    provenance = {
        **attrs,
        "quantity": data.quantity,
        "degrees_of_freedom": found["degrees_of_freedom"],
        "n_experiments": records.n_experiments,
        "n_periods": data.n_periods,
    }
    factor = line_factor(data.frequency_hz, data.quantity)[:, None, None]
    variance = found["variance"] * np.abs(factor) ** 2
    return frequency_response(
        data.frequency_hz,
        found["response"] * factor,
        estimator=estimator,
        variance=variance,
        noise_variance=variance if data.n_periods > 1 else None,
        condition=found["condition"],
        flag=found["flag"],
        input_unit=records.input_unit,
        output_unit=output_unit(records, data.quantity),
        attrs=provenance,
    )


def _half_width(records: Records, data: Whole, order: int, denominator_order: int) -> int:
    """Return the smallest half-width with enough degrees of freedom, counted on excited lines only."""
    experiments, inputs = records.n_experiments, records.n_inputs
    unknowns = (order + 1) * (inputs + experiments) + denominator_order
    if not isinstance(records, PeriodicRecords):
        needed = max(-(-(unknowns + DEGREES_OF_FREEDOM) // experiments), 2 * order + 3)
        return needed // 2
    needed = max(-(-(unknowns + DEGREES_OF_FREEDOM) // experiments), order + 2)
    excited = records.lines * data.n_periods
    if len(excited) < needed:
        raise InputError(
            f"lines: expected at least {needed} excited lines for order {order} with "
            f"{experiments} experiments and {inputs} inputs, got {len(excited)}"
        )
    widest = int((excited[needed - 1 :] - excited[: len(excited) - needed + 1]).max())
    return -(-widest // 2)


def _band(records: Records, data: Whole, half_width: int) -> tuple[int, int]:
    """Return the range of lines that windows may cover: the excited lines, or more if a window needs it."""
    if not isinstance(records, PeriodicRecords):
        return 1, data.last_bin
    first, last = (int(records.lines[i]) * data.n_periods for i in (0, -1))
    missing = max(0, 2 * half_width + 1 - (last - first + 1))
    first = max(1, first - (missing + 1) // 2)
    last = min(data.last_bin, max(last, first + 2 * half_width))
    return max(1, min(first, last - 2 * half_width)), last
