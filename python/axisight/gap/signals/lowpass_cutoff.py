"""Chooses the cutoff of inverse dynamics, and between measured and differentiated velocity, from the logs."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.gap.signals.motion import Filtering, Motion, has_velocity, motion
from axisight.logs import Log
from axisight.robot import Robot

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Highest cutoff that is tried [Hz]: below the first resonance of most machines.
_HIGHEST_HZ = 60.0
# Lowest cutoff that is tried [Hz]. Slower modes of a robot are pendulum motions.
_LOWEST_HZ = 2.0
# Smallest number of samples in a period of the cutoff.
_OVERSAMPLING = 5.0
# Share of the frequency of the first elastic mode up to which gears count as rigid.
_RIGID = 1 / 3
# Speed where the smoothed sign turns, as a share of the largest speed.
_CORNER = 0.01
# Share by which a measured velocity must lower the held-out error to be preferred to a differentiated position.
_CLEARLY = 0.02


def highest_cutoff_hz(sample_time_s: float) -> float:
    """Return the highest cutoff [Hz] that is tried at a sample time."""
    return min(_HIGHEST_HZ, 1 / (_OVERSAMPLING * sample_time_s))


def rigid_below_hz(robot: Robot) -> float:
    """Return the frequency [Hz] up to which the gears of a robot count as rigid; infinity for a rigid robot.

    A third of its first elastic mode. A mass behind the gear moves by a ninth more than the motor there.
    """
    if all(robot.axis_is_rigid):
        return float("inf")
    modes = robot.modes()
    swings = np.abs(modes["eigenvalue_rad_s"].values.imag) / (2 * np.pi)
    # Slower modes are pendulum motions under gravity.
    elastic = swings[swings > _LOWEST_HZ]
    return float(elastic.min()) * _RIGID if len(elastic) else float("inf")


def chosen_filtering(
    logs: Sequence[Log],
    predict: Callable[[Motion], Array],
    cutoff_hz: float | None = None,
    *,
    measured: Mask | None = None,
    highest_hz: float = float("inf"),
) -> Filtering:
    """Return the filtering whose motion predicts torque best on held-out data.

    ``predict``: torque of the rigid simulator along a motion. For each axis the torque *as logged* is regressed
    on the predicted torque, the speed, its sign and an offset. The fit uses one half of each log and predicts
    the other. A low cutoff costs part of the motion, a high one leaves noise; the held-out error counts both.

    Without ``cutoff_hz``, cutoffs up to ``highest_hz`` are tried in half octaves. The best one is then tried
    with the measured velocity of the axes ``measured`` (n_axes,); by default the axes that have one in all
    logs.
    """
    highest = max(min(highest_cutoff_hz(logs[0].sample_time_s), highest_hz), _LOWEST_HZ)
    count = int(2 * np.log2(highest / _LOWEST_HZ)) + 1
    grid = highest * 2.0 ** (-np.arange(max(count, 1)) / 2)
    best = cutoff_hz
    if best is None:
        # Relative errors: an axis that no cutoff predicts does not choose for the others.
        errors = [
            np.log(np.maximum(held_out_error(logs, predict, float(f)), 1e-300)).sum() for f in grid
        ]
        best = float(grid[int(np.argmin(errors))])
    available = has_velocity(logs) if measured is None else measured
    if not available.any():
        return Filtering(best)
    position, velocity = (
        held_out_error(logs, predict, best, tuple(axes))
        for axes in (np.zeros_like(available), available)
    )
    better = available & (velocity < (1 - _CLEARLY) * position)
    return Filtering(best, tuple(bool(x) for x in better))


def held_out_error(
    logs: Sequence[Log],
    predict: Callable[[Motion], Array],
    cutoff_hz: float,
    measured: Sequence[bool] = (),
) -> Array:
    """Return the squared error on the held-out halves, relative to the torque's variance (n_axes,).

    The motion is extended without curvature at its ends, so that low cutoffs, which smear the ends far, do
    worse.
    """
    moved = [motion(log, cutoff_hz, measured, curved=False) for log in logs]
    rigid = np.concatenate([predict(m) for m in moved])
    speed = np.concatenate([m[1] for m in moved])
    torque = np.concatenate([log.torque_nm for log in logs])
    late = np.concatenate([2 * np.arange(log.n_samples) >= log.n_samples for log in logs])
    out = np.zeros(torque.shape[1])
    for axis in range(len(out)):
        y = torque[:, axis]
        x = columns(rigid[:, axis], speed[:, axis])
        squares = 0.0
        for half in (late, ~late):
            theta = np.linalg.lstsq(x[half], y[half], rcond=None)[0]
            squares += float(((y[~half] - x[~half] @ theta) ** 2).sum())
        out[axis] = squares / max(float(y.var()), 1e-300)
    return out


def columns(rigid: Array, speed: Array) -> Array:
    """Return the columns of the regression of one axis (n, 4): predicted torque, speed, its sign, an offset."""
    return np.stack([rigid, speed, direction(speed), np.ones(len(speed))], axis=1)


def direction(speed: Array) -> Array:
    """Return the sign of a speed (n,), smoothed below 1 % of the largest speed."""
    corner = _CORNER * max(float(np.abs(speed).max()), 1e-12)
    return np.asarray(speed / np.sqrt(speed**2 + corner**2))
