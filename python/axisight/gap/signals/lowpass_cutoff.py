"""The low-pass of inverse dynamics, and whose velocity it takes, from the data."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.gap.signals.motion import Filtering, Motion, has_velocity, motion
from axisight.logs import Log
from axisight.robot import Robot

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Below the first resonance of most machines, above the spectrum of their motions.
_HIGHEST_HZ = 60.0
_LOWEST_HZ = 2.0
# A log has at least this many samples in a period of the cutoff.
_OVERSAMPLING = 5.0
# Of the first elastic mode, up to which gears are as good as rigid.
_RIGID = 1 / 3
# Corner of the sign of the speed, as a share of the largest speed.
_CORNER = 0.01
# A measured velocity has to leave less by this share than one differentiated from the position.
_CLEARLY = 0.02


def highest_cutoff_hz(sample_time_s: float) -> float:
    """Return the highest cutoff that is worth trying at a sample time."""
    return min(_HIGHEST_HZ, 1 / (_OVERSAMPLING * sample_time_s))


def rigid_below_hz(robot: Robot) -> float:
    """Return up to which frequency the torque of a robot is that of rigid gears [Hz]; infinity where they are.

    A third of its first elastic mode: the masses behind a gear move by a ninth more there.
    """
    if all(robot.axis_is_rigid):
        return float("inf")
    modes = robot.modes()
    swings = np.abs(modes["eigenvalue_rad_s"].values.imag) / (2 * np.pi)
    # What swings more slowly hangs in gravity.
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
    """Return the filtering whose motion predicts torque best on data left out.

    ``predict`` is the torque of the rigid simulator along a motion. On every axis the torque *as
    logged* is regressed on the predicted one, the speed, its sign and an offset, on one half of
    each log, and predicted on the other: what a low cutoff takes from the motion and what a high
    one leaves of the noise both count. Cutoffs up to ``highest_hz`` are tried in half octaves, unless
    ``cutoff_hz`` is given; with the best of them, the measured velocity of the axes that have one: ``measured``
    (n_axes,), by default those of these logs.
    """
    highest = max(min(highest_cutoff_hz(logs[0].sample_time_s), highest_hz), _LOWEST_HZ)
    count = int(2 * np.log2(highest / _LOWEST_HZ)) + 1
    grid = highest * 2.0 ** (-np.arange(max(count, 1)) / 2)
    best = cutoff_hz
    if best is None:
        # Relative changes count: an axis that nothing predicts does not choose for the others.
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
    """Return the squared error on the other half, relative to the torque's, of every axis (n_axes,).

    From motions with plain ends, which speak against cutoffs that smear far.
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
    """Return what an axis is regressed on (n, 4): prediction, speed, its sign, an offset."""
    return np.stack([rigid, speed, direction(speed), np.ones(len(speed))], axis=1)


def direction(speed: Array) -> Array:
    """Return the sign of a speed (n,), rounded off below a hundredth of the largest."""
    corner = _CORNER * max(float(np.abs(speed).max()), 1e-12)
    return np.asarray(speed / np.sqrt(speed**2 + corner**2))
