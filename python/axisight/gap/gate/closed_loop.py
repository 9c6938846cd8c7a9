"""Closed-loop logs against the controller of the robot file: whose column, sign, unit and time is off."""

from __future__ import annotations

import math
from dataclasses import dataclass

from axisight.gap.faults import InputFinding
from axisight.gap.gate.control_law import ControlLaw, LawFit
from axisight.gap.gate.follows import check_follows
from axisight.gap.gate.scales import scale_name
from axisight.gap.gate.shifts import Shift, best_shift
from axisight.logs import Log
from axisight.robot import Robot

# The law holds to a thousandth on logs of simulated machines with any effect, limits included. A
# drive that filters what it reports leaves a few per cent; a wrong column explains less than half.
EXPLAINED = 0.9
NAMED = 0.95
# Factors of a controller that is otherwise tuned than the file says pass within these; a factor in
# the second range is worth a word.
_OTHER_GAINS = (0.4, 2.5)
_SAME_GAINS = (0.8, 1.25)
_ANGLES = ("position_in_degrees", "position_in_revolutions")
_CHANNELS = {"torque": "torque_cmd", "velocity_ref": "velocity_ref", "position": "position"}


@dataclass(frozen=True)
class _Axis:
    """What is known of one axis of one log, axes from 0."""

    index: int
    as_given: LawFit
    reference: int
    position: int
    best: LawFit
    shift: Shift | None


def check_closed_loop(robot: Robot, log: Log) -> list[InputFinding]:
    """Return findings about channels that do not fit one another by the controller's law."""
    law = ControlLaw(robot, log)
    axes = [_look(law, i, robot.n_axes) for i in range(robot.n_axes)]
    out: list[InputFinding] = []
    unexplained = []
    for axis in axes:
        if not math.isfinite(axis.as_given.explained):
            continue
        if axis.as_given.explained >= EXPLAINED:
            out += _factors(robot, log, axis.index, axis.as_given)
        elif axis.best.explained >= NAMED:
            out += _other_columns(log, axis)
            out += _factors(robot, log, axis.index, axis.best)
        elif axis.shift is not None:
            out += _shifted(log, axis, [a.shift for a in axes])
        else:
            unexplained.append(axis)
    followed = check_follows(robot, log, [a.index for a in unexplained])
    out += followed
    out += [_off(log, a) for a in unexplained if a.index + 1 not in {f.axis for f in followed}]
    return _once(out)


def _look(law: ControlLaw, i: int, n_axes: int) -> _Axis:
    as_given = law.fit(i, i, i)
    if not as_given.explained < EXPLAINED:
        return _Axis(i, as_given, i, i, as_given, None)
    # The least that was mistaken first: one column before two.
    pairs = [(j, k) for j in range(n_axes) for k in range(n_axes) if (j, k) != (i, i)]
    pairs.sort(key=lambda p: (p[0] != i) + (p[1] != i) - (p[0] == p[1]))
    fits = [(law.fit(i, j, k), j, k) for j, k in pairs]
    good = [f for f in fits if f[0].explained >= NAMED and _plain(f[0])]
    best, j, k = max(good or fits or [(as_given, i, i)], key=lambda f: f[0].explained)
    if best.explained >= NAMED:
        return _Axis(i, as_given, j, k, best, None)
    return _Axis(i, as_given, i, i, as_given, best_shift(law, i, NAMED))


def _plain(fit: LawFit) -> bool:
    """Whether both factors are one, up to sign and other gains: swapped columns have right units."""
    low, high = _OTHER_GAINS
    return all(not math.isfinite(x) or low < abs(x) < high for x in (fit.reference, fit.position))


def _column(field: str, axis: int) -> str:
    return f"{_CHANNELS[field]}_{axis + 1}"


def _other_columns(log: Log, axis: _Axis) -> list[InputFinding]:
    i, j, k = axis.index, axis.reference, axis.position
    both = (("velocity_ref", j), ("position", k))
    swapped = [("torque", j)] if j == k else [(field, s) for field, s in both if s != i]
    return [
        InputFinding(
            "axes_swapped",
            "refuse",
            f"expected the {field.replace('_', ' ')} of axis {i + 1}, got that of axis {source + 1}: "
            f"with it the controller of the robot file explains {100 * axis.best.explained:.3g} % of "
            f"the torque, as given {100 * max(axis.as_given.explained, 0):.3g} %; exchange the columns",
            log.name,
            i + 1,
            _column(field, i),
        )
        for field, source in swapped
    ]


def _factors(robot: Robot, log: Log, i: int, fit: LawFit) -> list[InputFinding]:
    """Return findings about the factors of reference and position in the torque."""
    a = fit.reference if math.isfinite(fit.reference) else fit.position
    b = fit.position if math.isfinite(fit.position) else a
    known = math.isfinite(a) and math.isfinite(b) and a != 0.0 and b != 0.0
    if not known or (_within(a, _SAME_GAINS) and _within(b, _SAME_GAINS)):
        return []
    ratio = float(robot.gear_ratio[i])
    if abs(a / b - 1.0) < 0.2:
        return [_both(log, i, b, ratio)]
    if _within(b, _OTHER_GAINS):
        return [_wrong(log, i, "velocity_ref", 1.0 / a, ratio)]
    if _within(a, _OTHER_GAINS):
        return [_wrong(log, i, "position", 1.0 / b, ratio)]
    return [_wrong(log, i, "torque", b, ratio), _wrong(log, i, "velocity_ref", b / a, ratio)]


def _both(log: Log, i: int, factor: float, ratio: float) -> InputFinding:
    """Return the finding where reference and position agree: the torque, or the unit of both."""
    if _within(factor, _OTHER_GAINS):
        return _scaled(log, i, "torque", factor, ratio, severity="flag")
    if scale_name("position", 1.0 / factor, ratio) in _ANGLES:
        return _wrong(log, i, "position", 1.0 / factor, ratio)
    return _wrong(log, i, "torque", factor, ratio)


def _within(x: float, limits: tuple[float, float]) -> bool:
    return limits[0] < x < limits[1]


def _wrong(log: Log, i: int, field: str, factor: float, ratio: float) -> InputFinding:
    if factor < 0.0 and _within(-factor, _OTHER_GAINS):
        message = (
            f"expected the sign of the robot's axis, got the other one (factor {factor:.4g} by the "
            "controller's law): turn it round"
        )
        return InputFinding("sign_flipped", "refuse", message, log.name, i + 1, _column(field, i))
    return _scaled(log, i, field, factor, ratio, severity="refuse")


def _scaled(
    log: Log, i: int, field: str, factor: float, ratio: float, *, severity: str
) -> InputFinding:
    name = scale_name(field, factor, ratio)
    message = (
        f"expected SI units, got numbers {factor:.4g} times what the controller of the robot file "
        f"makes of the other channels: {_advice(name)}"
    )
    return InputFinding(name, severity, message, log.name, i + 1, _column(field, i))  # type: ignore[arg-type]


def _advice(name: str) -> str:
    if name.endswith("_scaled"):
        return "state the unit and scale in a column map, or the gains in the robot file"
    return "state the unit in a column map"


def _shifted(log: Log, axis: _Axis, shifts: list[Shift | None]) -> list[InputFinding]:
    shift = axis.shift
    assert shift is not None
    others = [s for s in shifts if s is not None and s.field == shift.field]
    whole = len(others) == len(shifts) and len(shifts) > 1
    name = "time_shifted" if whole or shift.field == "torque" else "axis_delayed"
    words = shift.field.replace("_", " ")
    late = "late" if shift.seconds > 0 else "early"
    message = (
        f"expected channels of one clock, got the {words} {abs(shift.seconds) * 1e3:.4g} ms {late} "
        f"against the others (the controller's law then explains {100 * shift.explained:.4g} % of the "
        f"torque, as given {100 * max(axis.as_given.explained, 0):.3g} %): shift it back, or record on "
        "one clock"
    )
    column = _column(shift.field, axis.index)
    return [InputFinding(name, "refuse", message, log.name, axis.index + 1, column)]


def _off(log: Log, axis: _Axis) -> InputFinding:
    message = (
        f"expected what the controller of the robot file gives, got a torque of which it explains "
        f"{100 * max(axis.as_given.explained, 0):.3g} %: other kind or gains of the controller, a feed-forward, "
        "another torque than the command, or channels of different times"
    )
    column = _column("torque", axis.index)
    return InputFinding("torque_off_control_law", "flag", message, log.name, axis.index + 1, column)


def _once(findings: list[InputFinding]) -> list[InputFinding]:
    seen: dict[tuple[str, str], InputFinding] = {}
    for finding in findings:
        seen.setdefault((finding.name, finding.field), finding)
    return list(seen.values())
