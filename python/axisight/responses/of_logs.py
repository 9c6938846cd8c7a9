"""From logs of one operating point to a frequency response."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from axisight.arguments import Lines, counted, instance, one_of, reals, several
from axisight.errors import InputError
from axisight.excitation import References
from axisight.frf.quantity import RATES, Quantity, quantity_of
from axisight.logs import Log
from axisight.records import (
    ArbitraryRecords,
    Experiment,
    FindingKind,
    PeriodicRecords,
    Prepared,
    RecordFinding,
    excited_lines,
    prepare_records,
)
from axisight.responses.account import Setting, account_of
from axisight.responses.cutting import Cut, common_period, cut_at_changes, said_cuts
from axisight.responses.estimators import (
    ESTIMATORS,
    MEANS,
    Choice,
    chosen_of_arbitrary,
    chosen_of_periodic,
    estimate_arbitrary,
    estimate_periodic,
)
from axisight.responses.operating_point import (
    OPERATING_POINT,
    expect_one_pose,
    mean_joint_angles,
)
from axisight.responses.ordering import Order, in_order, realizations
from axisight.responses.result import LogResponse
from axisight.responses.signals import chosen_axes, experiment_of_axes, units
from axisight.robot import Robot

# Level below the strongest at which a line of a signal without a period no longer counts as excited.
_FLOOR_DB = -40.0
# Share of the designed lines that the references of logs must excite.
_DESIGNED = 0.9
# Estimators that see distortion as scatter, if there are more experiments than inputs.
_BY_SCATTER = ("mfrf", "h1", "h2", "joint_input_output", "robust")


@dataclass(frozen=True)
class _Options:
    """The options of `response_of_logs`, checked."""

    design: References | None
    estimator: str
    average: str | None
    quantity: Quantity
    period_s: float | None
    band_hz: tuple[float, float] | None
    bandwidth_hz: float | None
    drop_periods: int | None


@dataclass(frozen=True)
class _Estimated:
    """A response and how it came about."""

    response: xr.Dataset
    records: PeriodicRecords | ArbitraryRecords
    choices: list[str]
    findings: tuple[RecordFinding, ...]
    setting: Setting


def response_of_logs(
    logs: Sequence[Log],
    *,
    robot: Robot | None = None,
    design: References | None = None,
    estimator: str = "auto",
    average: str | None = None,
    quantity: Quantity = "acceleration",
    axes: Sequence[int] | None = None,
    operating_point_rad: ArrayLike | None = None,
    period_s: float | None = None,
    band_hz: tuple[float, float] | None = None,
    bandwidth_hz: float | None = None,
    drop_periods: int | None = None,
) -> LogResponse:
    """Return the response from motor torques to motor motions at one operating point.

    logs
        One log for each experiment, or logs that hold several: each stretch in which the reference repeats is
        an experiment. All have the same sample time and axes.
    robot
        Gives the gear ratios for the operating point.
    design
        References of the experiments (:func:`axisight.excitation.read_references`), for period, excited lines
        and detection lines. None finds them from the reference of the logs, or from the torque without one.
    estimator, average
        One of ``ESTIMATORS`` and of ``MEANS``. "auto" takes the logarithmic mean of several realizations. For
        one, it takes the fast method if lines are free of excitation, or else MFRF. It takes a local method if
        no steady state is reached, if there are fewer experiments than axes or one period, and if the logs do
        not repeat.
    quantity
        ``acceleration``, ``velocity`` or ``position`` of the motors.
    axes
        Axes to estimate, from 1. None takes all that move in any log.
    operating_point_rad
        Angles of the driven joints [rad; m if prismatic], (n_axes,). None takes the mean of the logs: joint
        encoders, or motor positions with the gear ratios of ``robot``.
    period_s
        Period [s], a whole number of samples.
    band_hz
        Lowest and highest frequency [Hz] to estimate.
    bandwidth_hz
        Half width of the window of "spectral" [Hz].
    drop_periods
        Number of periods to drop as transient. None finds it (:func:`axisight.records.steady_state`).

    Methods: Wernholt (2004), sections 3.4.2, 5.2 and 7.2. Raises InputError naming the field if the logs
    cannot give the response: fewer experiments than axes that excite one direction, no excited line,
    different sample times, axes or operating points, no torque, no reference for "joint_input_output".
    """
    given = [instance("logs", log, Log) for log in several("logs", logs)]
    if not given:
        raise InputError("logs: expected at least one, got none")
    one_of("estimator", estimator, ESTIMATORS)
    one_of("average", "none" if average is None else average, MEANS)
    one_of("quantity", quantity, RATES)
    options = _Options(
        design, estimator, average, quantity, period_s, _band(band_hz), bandwidth_hz, drop_periods
    )
    _expect_one_rate(given, design)
    chosen = chosen_axes(given, axes)
    runs = [experiment_of_axes(log, chosen) for log in given]
    if design is not None and design.n_inputs != given[0].n_axes:
        raise InputError(
            f"design: expected {given[0].n_axes} axes as the logs, got {design.n_inputs}"
        )
    n_samples = _period(runs, options)
    labels = units(given, chosen)
    if n_samples is None:
        cuts = [Cut(run, i, 0, run.n_samples) for i, run in enumerate(runs)]
        found = _without_period(runs, labels, options)
    else:
        cuts = cut_at_changes(runs, n_samples)
        found = _with_period(cuts, runs, n_samples, labels, options)
    pieces = [_piece(given[cut.log], cut) for cut in cuts]
    expect_one_pose(pieces, chosen, robot)
    pose = _pose(pieces, robot, operating_point_rad)
    choices = [*_said_axes(chosen, given[0].n_axes), *found.choices]
    response = found.response.assign_coords(output=list(chosen), input=list(chosen))
    attrs: dict[str, Any] = {"logs": ", ".join(log.name for log in given)}
    if pose is not None:
        attrs[OPERATING_POINT] = pose
    account = account_of(response, found.records, found.setting)
    return LogResponse(
        response.assign_attrs(attrs), found.records, tuple(choices), found.findings, account
    )


def _band(band_hz: tuple[float, float] | None) -> tuple[float, float] | None:
    if band_hz is None:
        return None
    low, high = band_hz
    if not 0 <= low < high:
        raise InputError(f"band_hz: expected 0 <= LOW < HIGH, got {low:g}, {high:g}")
    return low, high


def _expect_one_rate(logs: Sequence[Log], design: References | None) -> None:
    first = logs[0]
    for log in logs[1:]:
        if abs(log.sample_time_s / first.sample_time_s - 1) > 1e-9:
            raise InputError(
                f"{log.name}: sample time: expected {first.sample_time_s:g} s as {first.name}, got "
                f"{log.sample_time_s:g} s; resample it, or estimate it apart"
            )
    if design is not None and abs(design.sample_time_s / first.sample_time_s - 1) > 1e-4:
        raise InputError(
            f"design: expected the sample time of the logs, {first.sample_time_s:g} s, got "
            f"{design.sample_time_s:g} s"
        )


def _period(runs: Sequence[Experiment], options: _Options) -> int | None:
    """Return the period [samples]: that given, of the design, or found; None if the logs do not repeat."""
    step = runs[0].sample_time_s
    if options.period_s is not None:
        # Whether it is whole is checked when the records are cut.
        return max(round(options.period_s / step), 1)
    if options.design is not None:
        return options.design.n_samples
    return common_period(runs)


def _piece(log: Log, cut: Cut) -> Log:
    """Return the part of a log that an experiment uses, with its motor and joint positions."""
    part = slice(cut.start, cut.stop)
    joint = log.joint_position_rad
    return Log(
        name=cut.experiment.name,
        sample_time_s=log.sample_time_s,
        time_s=log.time_s[part] - log.time_s[cut.start],
        torque_nm=log.torque_nm[part],
        position_rad=log.position_rad[part],
        joint_position_rad=None if joint is None else joint[part],
        axis_kinds=log.axis_kinds,
        source=log.source,
    )


def _pose(
    logs: Sequence[Log], robot: Robot | None, given: ArrayLike | None
) -> list[float] | None:
    if given is not None:
        pose = reals("operating_point_rad", given, "angles of shape (n_axes,)", 1)
        if len(pose) != logs[0].n_axes:
            raise InputError(
                f"operating_point_rad: expected {logs[0].n_axes} angles, got {len(pose)}"
            )
        return [float(angle) for angle in pose]
    found = mean_joint_angles(logs, robot)
    return None if found is None else [float(angle) for angle in found]


def _said_axes(chosen: Sequence[int], n_axes: int) -> list[str]:
    left = [axis for axis in range(1, n_axes + 1) if axis not in chosen]
    if not left:
        return []
    return [
        f"axes: {', '.join(map(str, chosen))}; without {', '.join(map(str, left))}, which must stand still"
    ]


def _with_period(
    cuts: Sequence[Cut],
    runs: Sequence[Experiment],
    n_samples: int,
    labels: tuple[str, str],
    options: _Options,
) -> _Estimated:
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
    if choice.estimator == "joint_input_output" and records.reference is None:
        raise InputError(
            "reference: expected velocity references or position targets in the logs for the estimator "
            "joint_input_output, got none"
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
        _said_choice(choice, response),
    ]
    return _Estimated(
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
    options: _Options,
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
        out.append(f"the first one is {', '.join(names)}, as logs in a row excite the same direction")
    return out


def _said_choice(choice: Choice, response: xr.Dataset) -> str:
    mean = f", {choice.mean} mean over the realizations" if choice.mean != "none" else ""
    why = f" ({choice.reason})" if choice.reason else ""
    unit = response["response"].attrs.get("units", "")
    return f"estimator: {choice.estimator}{mean}{why}; {quantity_of(response)} by torque [{unit}]"


def _without_period(
    runs: Sequence[Experiment], labels: tuple[str, str], options: _Options
) -> _Estimated:
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
        _said_choice(choice, response),
    ]
    return _Estimated(response, records, choices, (), Setting(False, 0, False))


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
    return lines[excited[0] : excited[-1] + 1], f"where the {name} is within 40 dB of its strongest line"
