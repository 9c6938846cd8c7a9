"""Checks logs without a controller against the simulator's inverse dynamics: columns, signs, units, time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.faults import Finding, GateSeverity, refused
from axisight.gap.gate.by_dynamics.axis_travel import travels
from axisight.gap.gate.by_dynamics.friction_sign import check_passive
from axisight.gap.gate.by_dynamics.gravity_share import check_gravity_share
from axisight.gap.gate.by_dynamics.load_or_rotor import load_or_rotor_explains
from axisight.gap.gate.by_dynamics.small_errors import check_small_errors
from axisight.gap.gate.by_dynamics.torque_fit import EXPLAINED, SAME, TorqueFit, torque_fit
from axisight.gap.gate.by_dynamics.undone_mistakes import Mistake, predict, undone, with_gravity
from axisight.gap.signals.lowpass_cutoff import highest_cutoff_hz
from axisight.gap.signals.motion import Motion, motion
from axisight.gap.signals.unit_scales import scale_name
from axisight.logs import Log
from axisight.robot import Robot

Array = NDArray[np.float64]

# Cutoff [Hz] of the low-pass before the checks: motions of arms lie below.
_BAND_HZ = 10.0
# Samples that are kept in a period of the cutoff.
_SAMPLES_PER_BAND = 10
# Share of the unexplained variance, summed over the axes, that a named mistake must remove when it is undone.
_REMOVED = 0.5
# Smallest such decrease of the sum, as a share of one axis' variance.
_LEAST_REMOVED = 0.08
# Share of the torque's variance that the prediction must explain beyond friction for its factor to be known.
_CARRIES = 0.1
# Range of the factor that is no refusal if all axes lie outside `SAME`. A heavy tool changes the torque of a
# wrist by five and more, but not that of all axes.
_ALL_AXES = (0.25, 4.0)
# Range of the factor that is no refusal of a unit on one axis: no load changes torques by thirty.
_ONE_AXIS = (1 / 30.0, 30.0)
_FASTEST_RAD_S = 3000.0
"""Motor speed [rad/s], 28 600 rpm, above which a position is in encoder counts."""


def check_inverse(robot: Robot, logs: Sequence[Log]) -> list[Finding]:
    """Return findings about logs whose torques the simulator's inverse dynamics should explain."""
    motions = [thinned(log) for log in logs]
    without_gravity = check_gravity_share(robot, [at for _, at in motions])
    out = list(without_gravity)
    if refused(out):
        return out
    for log, (_, at) in zip(logs, motions, strict=True):
        out += _one_log(robot, log, at)
    if any(f.name == "gravity_flipped" for f in out) and not _gravity_off(robot, motions):
        out = [f for f in out if f.name != "gravity_flipped"]
    if not refused(out):
        out += check_passive(robot, logs, [at for _, at in motions])
    # Small errors are those of a model that is right otherwise.
    if refused(out) or without_gravity:
        return out
    moves = np.all([travels(log) & (np.ptp(log.torque_nm, axis=0) > 0) for log in logs], axis=0)
    return [*out, *check_small_errors(robot, motions, moves)]


def thinned(log: Log) -> tuple[float, Motion]:
    """Return sample time [s] and motion of a log, low-passed at 10 Hz or less and thinned accordingly."""
    band = min(_BAND_HZ, highest_cutoff_hz(log.sample_time_s))
    step = max(1, int(1.0 / (_SAMPLES_PER_BAND * band * log.sample_time_s)))
    position, speed, acceleration, torque = (x[::step] for x in motion(log, band))
    return step * log.sample_time_s, (position, speed, acceleration, torque)


def _one_log(robot: Robot, log: Log, at: Motion) -> list[Finding]:
    fast = _too_fast(robot, log, at)
    if fast:
        return fast
    given = torque_fit(at[3], predict(robot, at), at)
    turned = (given.slope < 0.0) & (given.gain > _CARRIES)
    if np.any((given.left > EXPLAINED) | turned):
        found = _most_likely(robot, at, given)
        if found is not None:
            return [_named(log, found, given)]
    return _scales(robot, log, at, given)


def _too_fast(robot: Robot, log: Log, at: Motion) -> list[Finding]:
    out = []
    for axis, slides in enumerate(robot.axis_is_prismatic):
        top = float(np.abs(at[1][:, axis]).max())
        if top > _FASTEST_RAD_S and not slides:
            message = (
                f"expected a motor position in rad, got speeds up to {top:.3g} rad/s. Are these encoder counts? "
                "State the unit in a column map"
            )
            column = f"position_{axis + 1}"
            out.append(Finding("position_in_counts", "refuse", message, log.name, axis + 1, column))
    return out


def _most_likely(robot: Robot, at: Motion, given: TorqueFit) -> Mistake | None:
    # Positions in a far too small unit would leave only a prediction times a thousand.
    sound = (mistake for mistake in undone(robot, at) if _in_scale(mistake.fit))
    best = min(sound, key=lambda mistake: mistake.fit.total, default=None)
    if best is None:
        return None
    # An axis on which the prediction shows neither way says nothing.
    tells = (given.gain > _CARRIES) | (best.fit.gain > _CARRIES)
    before, after = (float(fit.left[tells].sum()) for fit in (given, best.fit))
    left = best.fit.left[[axis for axis in best.axes if tells[axis]]]
    if not left.size:
        return None
    # A mistake of the whole machine is judged by all its axes together, as one may lack much else.
    whole = len(best.axes) == robot.n_axes
    explains = float(left.mean() if whole else left.max()) < EXPLAINED
    enough = before - after > max(_REMOVED * before, _LEAST_REMOVED)
    return best if enough and explains else None


def _gravity_off(robot: Robot, motions: Sequence[tuple[float, Motion]]) -> bool:
    """Whether gravity with the other sign explains all logs in which gravity matters."""
    for _, at in motions:
        given = torque_fit(at[3], predict(robot, at), at).total
        removed = given - with_gravity(robot, at, -1.0).total
        if abs(removed) > _LEAST_REMOVED and removed < _REMOVED * given:
            return False
    return True


def _in_scale(fit: TorqueFit) -> bool:
    """Whether the factors of predicted torques are plausible, with loads that the prediction lacks."""
    slope = np.abs(fit.slope[fit.gain > _CARRIES])
    return bool(np.all((slope > _ONE_AXIS[0]) & (slope < _ONE_AXIS[1])))


def _named(log: Log, found: Mistake, given: TorqueFit) -> Finding:
    axes = ", ".join(str(i + 1) for i in found.axes)
    message = (
        "expected motions that explain the torques, got motions that leave "
        f"{100 * given.total / len(given.left):.3g} % of the variance of the torque. After one change "
        f"({found.words}) they leave {100 * found.fit.total / len(given.left):.3g} %. Make that change in the log "
        "or in its column map"
    )
    axis = found.axes[0] + 1 if len(found.axes) < len(given.left) else None
    whole = found.field == "gravity"
    field = found.field if axis is None else f"{found.field}_{axes}"
    return Finding(found.name, "refuse", message, None if whole else log.name, axis, field)


def _scales(robot: Robot, log: Log, at: Motion, given: TorqueFit) -> list[Finding]:
    """Return findings about torques that are a multiple of the predicted ones."""
    out = []
    known = (given.gain > _CARRIES) & (given.left < EXPLAINED) & (given.slope > 0.0)
    slopes = given.slope[known]
    # One axis of an arm says nothing of the unit of all.
    enough = len(slopes) > 1 or robot.n_axes == 1
    everywhere = enough and bool(np.all((slopes < _ALL_AXES[0]) | (slopes > _ALL_AXES[1])))
    for axis in np.flatnonzero(known).tolist():
        slope = float(given.slope[axis])
        if SAME[0] < slope < SAME[1] or load_or_rotor_explains(robot, at, axis):
            continue
        name = scale_name("torque", slope, float(robot.gear_ratio[axis]))
        a_unit = not (_ONE_AXIS[0] < slope < _ONE_AXIS[1] or name.endswith("_scaled"))
        severity: GateSeverity = "refuse" if everywhere or a_unit else "flag"
        message = (
            f"expected Nm on the motor side, got numbers {slope:.4g} times the predicted torque. State unit, "
            "scale and side of the gear in a column map, or masses and counterbalance in the robot file"
        )
        column = f"torque_cmd_{axis + 1}"
        out.append(Finding(name, severity, message, log.name, axis + 1, column))
    return out
