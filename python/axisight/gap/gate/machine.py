"""Checks the robot file against the logs: axes, sample time, gears."""

from __future__ import annotations

from collections.abc import Sequence

from axisight.gap.facts.faults import Finding
from axisight.gap.gate.joint_ranges import check_ranges
from axisight.logs import Log
from axisight.logs.grid import RATE_TOLERANCE
from axisight.logs.mean_rate import whole_rate
from axisight.robot import Robot

# Joint angle per motor angle above which a ratio is flagged: the gear speeds up.
_SUSPICIOUS_RATIO = 1.0 + 1e-9
# Joint angle per motor angle above which a ratio is refused. Five exists in principle; larger ones are
# catalogue ratios (50:1 to 300:1), the inverse.
_IMPOSSIBLE_RATIO = 5.0
_DIFFERS = "sample_time_differs"


def check_machine(robot: Robot, logs: Sequence[Log]) -> list[Finding]:
    """Return findings about axes, sample times, gear ratios and ranges of joints."""
    out = [*_gears(robot), *check_ranges(robot, logs)]
    for log in logs:
        if log.n_axes != robot.n_axes:
            message = (
                f"expected {robot.n_axes} axes as in the robot, got {log.n_axes}. Use the robot file of this "
                "machine, or a column map that names its axes"
            )
            out.append(Finding("axes_differ", "refuse", message, log.name, None, "axis"))
        factor = log.sample_time_s / robot.sample_time_s
        if abs(factor - 1.0) > RATE_TOLERANCE:
            found = _another_rate(robot, log, factor, logs[0])
            if found.name != _DIFFERS or not _at_its_own_rate(robot, log, logs[0]):
                out.append(found)
    return out


def _at_its_own_rate(robot: Robot, log: Log, first: Log) -> bool:
    """Whether torque is predicted at the logs' own rate: no controller of speeds, and one rate for all logs."""
    same = abs(log.sample_time_s / first.sample_time_s - 1.0) <= RATE_TOLERANCE
    return same and not robot.told_speeds


def _another_rate(robot: Robot, log: Log, factor: float, first: Log) -> Finding:
    name, unit = _DIFFERS, ""
    for known, known_name, words in ((1e3, "time_in_ms", "ms"), (1e6, "time_in_us", "us")):
        if abs(factor / known - 1.0) < 0.01:
            name, unit = known_name, f": time in {words}? Write it in s"
    if name == _DIFFERS and not robot.told_speeds:
        rate_hz = whole_rate(1.0 / first.sample_time_s)
        message = (
            f"expected the sample time {first.sample_time_s:.6g} s of {first.name}, got {log.sample_time_s:.6g} s. "
            f"Put all logs on one grid by the line resample_hz = {rate_hz:.6g} in [time] of the column map"
        )
    else:
        message = (
            f"expected the robot's sample time {robot.sample_time_s:g} s, got {log.sample_time_s:g} s"
            f"{unit}"
        )
    return Finding(name, "refuse", message, log.name, None, "time_s")


def _gears(robot: Robot) -> list[Finding]:
    out = []
    for axis, (ratio, slides) in enumerate(
        zip(robot.gear_ratio, robot.axis_is_prismatic, strict=True), start=1
    ):
        if slides or abs(ratio) <= _SUSPICIOUS_RATIO:
            continue
        message = (
            f"expected joint angle per motor angle, at most 1 (0.00446 for a gear of 224:1), got {ratio:g}. Did "
            f"you mean {1 / ratio:.6g}?"
        )
        severity = "refuse" if abs(ratio) > _IMPOSSIBLE_RATIO else "flag"
        out.append(
            Finding("gear_ratio_inverted", severity, message, None, axis, "gear_ratio")  # type: ignore[arg-type]
        )
    return out
