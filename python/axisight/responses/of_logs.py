"""From logs of one operating point to a frequency response."""

from __future__ import annotations

from collections.abc import Sequence

from numpy.typing import ArrayLike

from axisight.arguments import instance, one_of, positive, reals, several, whole
from axisight.errors import InputError
from axisight.excitation import References
from axisight.frf.quantity import RATES, Quantity
from axisight.logs import Log
from axisight.records import Experiment
from axisight.responses.account import account_of
from axisight.responses.cutting import Cut, common_period, cut_at_changes
from axisight.responses.estimators import ESTIMATORS, MEANS
from axisight.responses.operating_point import (
    OPERATING_POINT,
    expect_one_pose,
    operating_point,
)
from axisight.responses.options import Options
from axisight.responses.result import LogResponse
from axisight.responses.signals import chosen_axes, experiment_of_axes, units
from axisight.responses.with_period import estimate_with_period
from axisight.responses.without_period import estimate_without_period
from axisight.robot import Robot


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
        Gives gear ratios and gear stiffnesses for the operating point.
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
        encoders, or motor positions with the gears of ``robot``.
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
    options = Options(
        None if design is None else instance("design", design, References),
        estimator,
        average,
        quantity,
        None if period_s is None else positive("period_s", period_s),
        _band(band_hz),
        None if bandwidth_hz is None else positive("bandwidth_hz", bandwidth_hz),
        None if drop_periods is None else whole("drop_periods", drop_periods, 0),
    )
    if robot is not None:
        instance("robot", robot, Robot)
    _expect_one_rate(given, design)
    return _response(given, chosen_axes(given, axes), robot, operating_point_rad, options)


def _response(
    logs: Sequence[Log],
    axes: Sequence[int],
    robot: Robot | None,
    operating_point_rad: ArrayLike | None,
    options: Options,
) -> LogResponse:
    runs = [experiment_of_axes(log, axes) for log in logs]
    labels = units(logs, axes)
    n_samples = _period(runs, options)
    if n_samples is None:
        cuts = [Cut(run, i, 0, run.n_samples) for i, run in enumerate(runs)]
        found = estimate_without_period(runs, labels, options)
    else:
        cuts = cut_at_changes(runs, n_samples)
        found = estimate_with_period(cuts, runs, n_samples, labels, options)
    pieces = [_piece(logs[cut.log], cut) for cut in cuts]
    expect_one_pose(pieces, axes, robot)
    pose = _pose(pieces, robot, operating_point_rad, torque_in_nm="A" not in labels[0])
    response = found.response.assign_coords(output=list(axes), input=list(axes))
    account = account_of(response, found.records, found.setting)
    return LogResponse(
        response.assign_attrs({"logs": ", ".join(log.name for log in logs), **pose}),
        found.records,
        (*_said_axes(axes, logs[0].n_axes), *found.choices),
        found.findings,
        account,
    )


def _band(band_hz: tuple[float, float] | None) -> tuple[float, float] | None:
    if band_hz is None:
        return None
    found = reals("band_hz", band_hz, "two frequencies LOW, HIGH", 1)
    if len(found) != 2:
        raise InputError(f"band_hz: expected two frequencies LOW, HIGH, got {len(found)}")
    low, high = (float(f) for f in found)
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
    if design is not None and design.n_inputs != first.n_axes:
        raise InputError(f"design: expected {first.n_axes} axes as the logs, got {design.n_inputs}")
    if design is not None and abs(design.sample_time_s / first.sample_time_s - 1) > 1e-4:
        raise InputError(
            f"design: expected the sample time of the logs, {first.sample_time_s:g} s, got "
            f"{design.sample_time_s:g} s"
        )


def _period(runs: Sequence[Experiment], options: Options) -> int | None:
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
    logs: Sequence[Log], robot: Robot | None, given: ArrayLike | None, *, torque_in_nm: bool
) -> dict[str, list[float]]:
    """Return the attributes for the operating point, given or from the logs."""
    if given is None:
        return operating_point(logs, robot, torque_in_nm=torque_in_nm)
    pose = reals("operating_point_rad", given, "angles of shape (n_axes,)", 1)
    if len(pose) != logs[0].n_axes:
        raise InputError(f"operating_point_rad: expected {logs[0].n_axes} angles, got {len(pose)}")
    return {OPERATING_POINT: [float(angle) for angle in pose]}


def _said_axes(chosen: Sequence[int], n_axes: int) -> list[str]:
    left = [axis for axis in range(1, n_axes + 1) if axis not in chosen]
    if not left:
        return []
    return [
        f"axes: {', '.join(map(str, chosen))}; without {', '.join(map(str, left))}, which must stand still"
    ]
