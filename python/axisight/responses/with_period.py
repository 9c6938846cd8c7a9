"""Responses from logs that repeat: whole periods in steady state, grouped into realizations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from axisight.arguments import counted
from axisight.errors import InputError
from axisight.excitation import References
from axisight.frf.quantity import quantity_of
from axisight.records import (
    Experiment,
    FindingKind,
    PeriodicRecords,
    Prepared,
    excited_lines,
    prepare_records,
)
from axisight.responses.account import Setting
from axisight.responses.cutting import Cut, said_cuts
from axisight.responses.estimators import (
    FROM_REFERENCES,
    Choice,
    chosen_of_periodic,
    estimate_periodic,
)
from axisight.responses.options import Estimated, Options
from axisight.responses.ordering import Order, in_order, realizations

# Share of the designed lines that the references of logs must excite.
_DESIGNED = 0.9
# Estimators that see distortion as scatter, if there are more experiments than inputs.
_BY_SCATTER = ("mfrf", "h1", "h2", "joint_input_output", "robust")


def estimate_with_period(
    cuts: Sequence[Cut],
    runs: Sequence[Experiment],
    n_samples: int,
    labels: tuple[str, str],
    options: Options,
) -> Estimated:
    """Return the response from whole periods."""
    period_s = options.period_s
    if period_s is None:
        period_s = n_samples * runs[0].sample_time_s
    experiments = [cut.experiment for cut in cuts]
    more: dict[str, Any] = {"period_s": period_s, "input_unit": labels[0], "output_unit": labels[1]}
    prepared = prepare_records(
        experiments,
        drop_periods=options.drop_periods,
        **more,
        **_designed_lines(cuts, n_samples, options.design),
    )
    records = _in_band(prepared.records, options.band_hz)
    order = realizations(records)
    choice = chosen_of_periodic(
        records,
        estimator=options.estimator,
        mean=options.average,
        count=order.count,
        settled=_settled(prepared),
    )
    if choice.estimator in FROM_REFERENCES and records.reference is None:
        raise InputError(
            "reference: expected velocity references or position targets in the logs for the estimator "
            f"{choice.estimator}, got none"
        )
    findings = prepared.findings
    local = choice.estimator in ("local_polynomial", "local_rational") and records.n_periods > 1
    if local and options.drop_periods is None:
        # These methods remove the transient themselves, from the whole record.
        whole = prepare_records(
            experiments, drop_periods=0, drift=False, lines=prepared.records.lines, **more
        )
        records, findings = _in_band(whole.records, options.band_hz), whole.findings
    ordered = _ordered(records, order)
    response = estimate_periodic(ordered, choice, options.quantity, options.bandwidth_hz)
    choices = [
        *_said_period(period_s, n_samples, ordered, prepared, options),
        *said_cuts(cuts, runs),
        *_said_order(order, experiments, ordered.n_inputs),
        said_choice(choice, response),
    ]
    return Estimated(
        response, ordered, choices, findings, _setting(choice, order, ordered, response)
    )


def _designed_lines(
    cuts: Sequence[Cut], n_samples: int, design: References | None
) -> dict[str, Any]:
    """Return excited and detection lines of a design; raise InputError if the logs do not excite them."""
    if design is None or not design.lines.size:
        return {}
    for cut in cuts:
        reference = cut.experiment.reference
        if reference is None or len(reference) < n_samples:
            continue
        periods = len(reference) // n_samples
        signal = reference[: periods * n_samples].reshape(1, periods, n_samples, -1)
        there = np.isin(design.lines, excited_lines(signal).lines).mean()
        if there < _DESIGNED:
            raise InputError(
                f"design: expected the {len(design.lines)} lines of the design in the reference of "
                f"{cut.experiment.name}, got {there:.0%} of them: is it the design of these logs?"
            )
    return {"lines": design.lines, "detection_lines": design.detection_lines}


def _in_band(records: PeriodicRecords, band_hz: tuple[float, float] | None) -> PeriodicRecords:
    if band_hz is None:
        return records
    low, high = band_hz
    inside = (records.frequency_hz >= low) & (records.frequency_hz <= high)
    if not inside.any():
        raise InputError(
            f"band_hz: expected excited lines between {low:g} and {high:g} Hz, got lines from "
            f"{records.frequency_hz[0]:g} to {records.frequency_hz[-1]:g} Hz"
        )
    return replace(records, lines=records.lines[inside])


def _settled(prepared: Prepared) -> bool:
    return not any(f.kind == FindingKind.TRANSIENT for f in prepared.serious)


def _ordered(records: PeriodicRecords, order: Order) -> PeriodicRecords:
    if not order.moved:
        return records
    index = list(order.index)
    reference = None if records.reference is None else records.reference[index]
    return replace(
        records, input=records.input[index], output=records.output[index], reference=reference
    )


def _setting(
    choice: Choice, order: Order, records: PeriodicRecords, response: xr.Dataset
) -> Setting:
    """Return what an estimate shows of distortion."""
    several_sets = records.n_experiments > records.n_inputs and choice.estimator in _BY_SCATTER
    seen = choice.estimator == "fast" or (several_sets and not order.repeats)
    known = "noise_variance" in response and bool(np.isfinite(response["variance"]).any())
    return Setting(seen and known, order.count, order.repeats)


def _said_period(
    period_s: float,
    n_samples: int,
    records: PeriodicRecords,
    prepared: Prepared,
    options: Options,
) -> list[str]:
    source = "given" if options.period_s is not None else "found from the reference"
    if options.period_s is None and options.design is not None:
        source = "of the design"
    elif options.period_s is None and records.reference is None:
        source = "found from the torque"
    total = prepared.dropped_periods + prepared.records.n_periods
    used = records.n_periods
    frequency = records.frequency_hz
    return [
        f"period: {period_s:g} s ({n_samples} samples), {source}",
        f"periods: {used} of {total} used"
        + (f", the first {total - used} dropped as transient" if used < total else ""),
        f"lines: {len(frequency)} excited, {frequency[0]:.4g} to {frequency[-1]:.4g} Hz",
    ]


def _said_order(order: Order, experiments: Sequence[Experiment], n: int) -> list[str]:
    total = len(experiments)
    if order.count < 1:
        return [f"experiments: {total}, not grouped into realizations of {n}"]
    out = [
        f"realizations: {order.count}, of {counted(n, 'experiment')} each"
        + (", all with the same phases" if order.repeats else "")
    ]
    if order.moved:
        names = [run.name for run in in_order(experiments, order)][:n]
        out.append(
            f"the first one is {', '.join(names)}, as logs in a row excite the same direction"
        )
    return out


def said_choice(choice: Choice, response: xr.Dataset) -> str:
    """Return the estimator, the mean, why they were chosen, and the unit of the response."""
    mean = f", {choice.mean} mean over the realizations" if choice.mean != "none" else ""
    why = f" ({choice.reason})" if choice.reason else ""
    unit = response["response"].attrs.get("units", "")
    return f"estimator: {choice.estimator}{mean}{why}; {quantity_of(response)} by torque [{unit}]"
