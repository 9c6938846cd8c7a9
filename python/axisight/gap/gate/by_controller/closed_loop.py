"""Checks closed-loop logs against the controller of the robot file: wrong columns, signs, units and times."""

from __future__ import annotations

import math
from dataclasses import dataclass

from axisight.gap.facts.faults import Finding, GateSeverity
from axisight.gap.gate.by_controller.control_law import ControlLaw, LawFit
from axisight.gap.gate.by_controller.follows_reference import check_follows
from axisight.gap.gate.by_controller.time_shifts import Shift, best_shift
from axisight.gap.signals.unit_scales import scale_name
from axisight.logs import Log
from axisight.robot import Robot

# Share of the torque's variance that the law must explain to hold. On simulated machines with any effect it
# leaves 0.1 %, limits included. A named mistake must leave as little. Other gains, filters and feedforward
# leave more.
HOLDS = 0.99
# Share of the variance below which an axis is flagged if no mistake is found.
_EXPLAINED = 0.9
# Range of the factors of reference and position with which a law holds.
_ONE = (0.9, 1.1)
# Range of these factors that counts as the stated gains.
_SAME_GAINS = (0.8, 1.25)
# Range of a common factor that counts as other gains and is only flagged.
_OTHER_GAINS = (0.2, 5.0)
# Delay up to which a channel is only flagged [s]: a controller may read its sensor that late, which is an
# effect.
_LATE_S = 0.012
_ANGLES = ("position_in_degrees", "position_in_revolutions")
_CHANNELS = {"torque": "torque_cmd", "velocity_ref": "velocity_ref", "position": "position"}


@dataclass(frozen=True)
class _Axis:
    """The result for one axis of one log; axes from 0."""

    index: int
    as_given: LawFit
    reference: int
    position: int
    best: LawFit
    shift: Shift | None


def check_closed_loop(robot: Robot, log: Log) -> list[Finding]:
    """Return findings about channels that contradict the controller's law."""
    law = ControlLaw(robot, log)
    looked = [_examined(law, i, robot.n_axes) for i in range(robot.n_axes)]
    out: list[Finding] = []
    unexplained = []
    for axis in looked:
        if not math.isfinite(axis.as_given.explained):
            continue
        if axis.as_given.explained >= HOLDS:
            out += _factors(robot, log, axis.index, axis.as_given)
        elif (axis.reference, axis.position) != (axis.index, axis.index):
            out += _other_columns(log, axis)
        elif axis.shift is not None:
            out += _shifted(log, axis, [a.shift for a in looked])
        elif axis.as_given.explained < _EXPLAINED:
            unexplained.append(axis)
    followed = check_follows(robot, log, [a.index for a in unexplained])
    out += followed
    out += [_off(log, a) for a in unexplained if a.index + 1 not in {f.axis for f in followed}]
    return _once(out)


def _examined(law: ControlLaw, i: int, n_axes: int) -> _Axis:
    as_given = law.fit(i, i, i)
    if not as_given.explained < HOLDS:
        return _Axis(i, as_given, i, i, as_given, None)
    # A single wrong column: reference, position, or torque with the gains of its own axis.
    others = [j for j in range(n_axes) if j != i]
    fits = [(law.fit(i, j, i), j, i) for j in others]
    fits += [(law.fit(i, i, j), i, j) for j in others]
    fits += [(law.fit(i, j, j, gains=j), j, j) for j in others]
    good = [f for f in fits if _law_holds(f[0])]
    if good:
        best, j, k = max(good, key=lambda f: f[0].explained)
        return _Axis(i, as_given, j, k, best, None)
    return _Axis(i, as_given, i, i, as_given, best_shift(law, i, _law_holds))


def _law_holds(fit: LawFit) -> bool:
    """Whether a law holds, with factors of reference and position near one."""
    factors = [x for x in (fit.reference, fit.position) if math.isfinite(x)]
    return fit.explained >= HOLDS and all(_within(x, _ONE) for x in factors)


def _column(field: str, axis: int) -> str:
    return f"{_CHANNELS[field]}_{axis + 1}"


def _other_columns(log: Log, axis: _Axis) -> list[Finding]:
    i, j, k = axis.index, axis.reference, axis.position
    both = (("velocity_ref", j), ("position", k))
    swapped = [("torque", j)] if j == k else [(field, s) for field, s in both if s != i]
    return [
        Finding(
            "axes_swapped",
            "refuse",
            f"expected the {field.replace('_', ' ')} of axis {i + 1}, got that of axis {source + 1}. With the "
            "columns exchanged the controller of the robot file explains "
            f"{100 * axis.best.explained:.3g} % of the torque, as given "
            f"{100 * max(axis.as_given.explained, 0):.3g} %. Exchange them",
            log.name,
            i + 1,
            _column(field, i),
        )
        for field, source in swapped
    ]


def _factors(robot: Robot, log: Log, i: int, fit: LawFit) -> list[Finding]:
    """Return findings about the factors of reference and position in the torque."""
    a = fit.reference if math.isfinite(fit.reference) else fit.position
    b = fit.position if math.isfinite(fit.position) else a
    known = math.isfinite(a) and math.isfinite(b) and a != 0.0 and b != 0.0
    if not known or (_within(a, _SAME_GAINS) and _within(b, _SAME_GAINS)):
        return []
    ratio = float(robot.gear_ratio[i])
    if abs(a / b - 1.0) < 0.2:
        return [_both(log, i, b, ratio)]
    if _within(b, _SAME_GAINS):
        return [_wrong(log, i, "velocity_ref", 1.0 / a, ratio)]
    if _within(a, _SAME_GAINS):
        return [_wrong(log, i, "position", 1.0 / b, ratio)]
    return [_wrong(log, i, "torque", b, ratio), _wrong(log, i, "velocity_ref", b / a, ratio)]


def _both(log: Log, i: int, factor: float, ratio: float) -> Finding:
    """Return the finding for equal factors of reference and position: the torque's unit, or that of both others."""
    if _within(factor, _OTHER_GAINS):
        return _scaled(log, i, "torque", factor, ratio, severity="flag")
    if scale_name("position", 1.0 / factor, ratio) in _ANGLES:
        return _wrong(log, i, "position", 1.0 / factor, ratio)
    return _wrong(log, i, "torque", factor, ratio)


def _within(x: float, limits: tuple[float, float]) -> bool:
    return limits[0] < x < limits[1]


def _wrong(log: Log, i: int, field: str, factor: float, ratio: float) -> Finding:
    if factor < 0.0 and _within(-factor, _SAME_GAINS):
        message = (
            f"expected the sign of the robot's axis, got the other sign (factor {factor:.4g} by the controller's "
            "law). Change the sign of this column"
        )
        return Finding("sign_flipped", "refuse", message, log.name, i + 1, _column(field, i))
    return _scaled(log, i, field, factor, ratio, severity="refuse")


def _scaled(
    log: Log, i: int, field: str, factor: float, ratio: float, *, severity: GateSeverity
) -> Finding:
    name = scale_name(field, factor, ratio)
    message = (
        f"expected SI units, got numbers {factor:.4g} times those that the controller of the robot file gives for "
        f"the other channels. {_advice(name)}"
    )
    return Finding(name, severity, message, log.name, i + 1, _column(field, i))


def _advice(name: str) -> str:
    if name.endswith("_scaled"):
        return (
            "State unit and scale in a column map (--columns), or correct the gains in the robot file. A "
            "position in deg that is read as rad scales torques too"
        )
    return "State the unit in a column map (--columns)"


def _shifted(log: Log, axis: _Axis, shifts: list[Shift | None]) -> list[Finding]:
    shift = axis.shift
    assert shift is not None
    others = [s for s in shifts if s is not None and s.field == shift.field]
    whole = len(others) == len(shifts) and len(shifts) > 1
    name = "time_shifted" if whole or shift.field == "torque" else "axis_delayed"
    words = shift.field.replace("_", " ")
    late = "late" if shift.seconds > 0 else "early"
    message = (
        f"expected channels of one clock, got the {words} {abs(shift.seconds) * 1e3:.4g} ms {late} against the "
        f"others. Shifted, the controller's law explains {100 * shift.fit.explained:.4g} % of the torque, as given "
        f"{100 * max(axis.as_given.explained, 0):.3g} %. Shift it back, or record on one clock"
    )
    column = _column(shift.field, axis.index)
    # On a smooth motion that the law explains nearly as given, other gains look like a shift.
    doubtful = abs(shift.seconds) <= _LATE_S or axis.as_given.explained > _EXPLAINED
    severity: GateSeverity = "flag" if doubtful else "refuse"
    return [Finding(name, severity, message, log.name, axis.index + 1, column)]


def _off(log: Log, axis: _Axis) -> Finding:
    message = (
        "expected the torque that the controller of the robot file commands, got a torque of which it explains "
        f"{100 * max(axis.as_given.explained, 0):.3g} %. Check kind and gains of the controller, a feed-forward, "
        "whether the column is the command, and the times of the channels"
    )
    column = _column("torque", axis.index)
    return Finding("torque_off_control_law", "flag", message, log.name, axis.index + 1, column)


def _once(findings: list[Finding]) -> list[Finding]:
    seen: dict[tuple[str, str], Finding] = {}
    for finding in findings:
        seen.setdefault((finding.name, finding.field), finding)
    return list(seen.values())
