"""Logs of one pose and one load, and the frequency response that they give."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from axisight.arguments import Lines, counted
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.frequency_fit import MeasuredResponse
from axisight.frf.mfrf import mfrf
from axisight.graybox.multiaxis.starts import mean_angle
from axisight.logs import Log
from axisight.records import FindingKind, RecordFinding, prepare_records
from axisight.robot import Robot

SAME_POSE_RAD = 0.05
"""Largest difference of the starts of logs of one operating point [rad; m if prismatic]."""


@summarized
@dataclass(frozen=True)
class OperatingPoint:
    """Logs that excite the arm at one pose with one load, and their response.

    ``logs`` are their names, ``response`` is from motor torque to motor acceleration, at the mean measured
    pose, and ``findings`` are reasons to doubt it.
    """

    logs: tuple[str, ...]
    response: MeasuredResponse
    findings: tuple[str, ...]


def operating_points(
    robot: Robot,
    logs: Sequence[Log],
    *,
    period_s: float | None = None,
    lines: Sequence[int] | Lines | None = None,
    drop_periods: int | None = None,
) -> tuple[list[OperatingPoint], list[str]]:
    """Return the operating points of broadband logs, and findings on logs that give no response.

    Logs belong together if they begin within 0.05 rad of the first log of the point and have its load.
    A response needs as many logs as axes at a point (3.53). ``period_s``, ``lines`` and ``drop_periods`` are
    those of :func:`axisight.records.prepare_records`. Raises InputError as that function, naming the logs,
    and if no point has enough logs.
    """
    found, findings = [], []
    for group in _groups(robot, logs):
        names = tuple(log.name for log in group)
        if len(group) < robot.n_axes:
            findings.append(
                f"{', '.join(names)}: {counted(len(group), 'log')} at this pose, and a response needs {robot.n_axes}: "
                "used in step 3 only"
            )
            continue
        found.append(_point(robot, group, names, period_s, lines, drop_periods))
    if not found:
        raise InputError(
            f"broadband: expected {robot.n_axes} logs of one pose and load with different excitations, got "
            f"at most {max(len(g) for g in _groups(robot, logs))}: record them, or give starts "
            "(responses=False, --no-responses)"
        )
    return found, findings


def _groups(robot: Robot, logs: Sequence[Log]) -> list[list[Log]]:
    groups: list[list[Log]] = []
    for log in logs:
        angle = log.position_rad[0] * robot.gear_ratio
        for group in groups:
            first = group[0].position_rad[0] * robot.gear_ratio
            if group[0].load == log.load and np.abs(first - angle).max() < SAME_POSE_RAD:
                group.append(log)
                break
        else:
            groups.append([log])
    return groups


def _point(
    robot: Robot,
    logs: Sequence[Log],
    names: tuple[str, ...],
    period_s: float | None,
    lines: Sequence[int] | Lines | None,
    drop_periods: int | None,
) -> OperatingPoint:
    try:
        prepared = prepare_records(logs, period_s=period_s, lines=lines, drop_periods=drop_periods)
        data: xr.Dataset = mfrf(prepared.records, quantity="acceleration")
    except InputError as error:
        raise InputError(f"{', '.join(names)}: {error}") from None
    kept_s = prepared.records.n_periods * prepared.period.n_samples * logs[0].sample_time_s
    angle = np.mean([mean_angle(robot, log, kept_s) for log in logs], axis=0)
    response = MeasuredResponse.of(angle, data)
    return OperatingPoint(
        names,
        response.with_load(logs[0].load),
        _worst(prepared.serious),
    )


def _worst(findings: Sequence[RecordFinding]) -> tuple[str, ...]:
    """Return the text of the worst finding of each kind, with the number of others like it."""
    kinds: dict[FindingKind, list[RecordFinding]] = {}
    for finding in findings:
        kinds.setdefault(finding.kind, []).append(finding)
    return tuple(
        max(alike, key=lambda f: float(np.nan_to_num(f.value))).message
        + (f" (the worst of {len(alike)} like it)" if len(alike) > 1 else "")
        for alike in kinds.values()
    )
