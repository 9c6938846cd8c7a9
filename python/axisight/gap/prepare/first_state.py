"""Fits the state in which a simulation enters a log to the start of that log.

A run-up brings a simulation to the position and speed at the start of a log. Oscillations there, of arms on
their gears or of the loop, depend on how the machine was driven before. So the references of the run-up are
changed until the simulated torque matches the log, for as long as the loop remembers its start. These changes
stand in for a free initial state.
"""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.gap.facts.compared_quantity import Compared
from axisight.logs import Log
from axisight.robot import Robot
from axisight.simulation import simulate_batch

Array = NDArray[np.float64]

# Distance between the knots of the B-splines [s], at least one sample. A change of the references is the
# difference of two neighbouring cubic B-splines that end at the start of the log, and sums to zero. The changes
# excite modes up to half the knots' rate.
_KNOT_S = 0.02
# Number of changes of an axis' references.
_SHAPES = 10
LEAST_SAMPLES = _SHAPES + 4
"""Smallest number of samples of a run-up that holds all changes."""
# Size of each change in its trial simulation, as a share of the references' rms.
_TRIED = 0.05
# Smallest singular value that is used, as a share of the largest.
_TOLD = 0.01
# Largest number of Gauss-Newton steps.
_STEPS = 2


def with_first_state(
    robot: Robot,
    log: Log,
    references: Array,
    start_rad: Array,
    seconds: float,
    compared: Compared = "torques",
) -> Array:
    """Return references (m, n_axes) [rad/s] before a log that fit its first ``seconds`` best.

    The fit compares torques, or positions without their mean, as ``compared`` says. It takes Gauss-Newton
    steps, with simulations of every change of ``references``, from rest at the joint angles ``start_rad``
    (n_axes,) [rad]. The sensitivities hardly change, and are simulated once. If no step lowers the error,
    ``references`` are returned.
    """
    n = round(seconds / log.sample_time_s)

    def missed(tried: Array) -> Array:
        return _errors(robot, log, tried, start_rad, n, compared)

    moves = _changes(log, len(references))
    best = references
    left, *moved = missed(np.concatenate([best[None], best + moves]))
    columns = (np.array(moved) - left).T
    if not (np.isfinite(columns).all() and np.isfinite(left).all()):
        return best
    for _ in range(_STEPS):
        shares = scipy.linalg.lstsq(columns, -left, cond=_TOLD)[0]
        found = best + np.tensordot(shares, moves, axes=1)
        after = missed(found[None])[0]
        if not float(after @ after) < float(left @ left):
            break
        best, left = found, after
    return best


def _changes(log: Log, lead: int) -> Array:
    """Return the changes of ``lead`` references before a log (n_axes * n_shapes, lead, n_axes) [rad/s]."""
    assert log.velocity_ref_rad_s is not None  # closed loop only
    size = _TRIED * np.sqrt(np.mean(log.velocity_ref_rad_s**2, axis=0))
    shapes = _shapes(lead, log.sample_time_s)
    out = np.zeros((log.n_axes, len(shapes), lead, log.n_axes))
    for axis in range(log.n_axes):
        out[axis, :, :, axis] = shapes * size[axis]
    return out.reshape(-1, lead, log.n_axes)


def _shapes(lead: int, step_s: float) -> Array:
    """Return changes (n_shapes, lead) that rise and fall by the same amount just before a log."""
    before_s = step_s * (np.arange(lead) - lead)
    knot_s = max(_KNOT_S, step_s)
    spline = scipy.interpolate.BSpline.basis_element(np.arange(-2.0, 3.0), extrapolate=False)
    at = [np.nan_to_num(spline(before_s / knot_s + 2 + i)) for i in range(_SHAPES + 1)]
    return np.asarray(np.diff(at, axis=0))


def _errors(
    robot: Robot, log: Log, tried: Array, start_rad: Array, n: int, compared: Compared
) -> Array:
    """Return the errors of simulations in the first ``n`` samples, over the log's standard deviation (n_tried, ...).

    ``tried`` (n_tried, lead, n_axes) [rad/s]: references before those of the log.
    """
    assert log.velocity_ref_rad_s is not None  # closed loop only
    lead = tried.shape[1]
    behind = np.broadcast_to(log.velocity_ref_rad_s[:n], (len(tried), n, log.n_axes))
    run = simulate_batch(
        robot, np.concatenate([tried, behind], axis=1), method="rk4", start_rad=start_rad
    )
    if compared == "torques":
        measured, off = log.torque_nm, run["torque_cmd_nm"].values[:, lead:] - log.torque_nm[:n]
    else:
        measured, off = (
            log.position_rad,
            run["position_rad"].values[:, lead:] - log.position_rad[:n],
        )
        off = off - off.mean(axis=1, keepdims=True)
    return np.asarray((off / np.maximum(measured.std(axis=0), 1e-300)).reshape(len(tried), -1))
