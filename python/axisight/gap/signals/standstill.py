"""What dry friction leaves open: where a motor stands or turns round, it may hold any torque in a band.

A rigid model with friction predicts the torque of a moving axis. Of a standing one it knows no
more than that the torque lies within the dry friction around it: brakes, stiction and the way the
axis came there decide. Such samples are weighed by how little they can tell, not left out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.fitting import Weighting
from axisight.gap.signals.lowpass_cutoff import columns, direction
from axisight.gap.signals.motion import Motion

Array = NDArray[np.float64]


def dry_friction_nm(motions: Sequence[Motion], predict: Callable[[Motion], Array]) -> Array:
    """Return the dry friction of every axis (n_axes,) [Nm], by least squares; zero where it drives.

    ``predict``: torque of the rigid simulator without effects along a motion.
    """
    rigid = np.concatenate([predict(m) for m in motions])
    speed = np.concatenate([m[1] for m in motions])
    torque = np.concatenate([m[3] for m in motions])
    out = np.zeros(torque.shape[1])
    for axis in range(len(out)):
        x = columns(rigid[:, axis], speed[:, axis])
        out[axis] = max(0.0, np.linalg.lstsq(x, torque[:, axis], rcond=None)[0][2])
    return out


# Share of the samples that have to run each way for a friction to be told from an offset, and share
# of the top speed that a log has to reach to tell it.
_EACH_WAY = 0.01
_MOVES = 0.1


def sure_friction_nm(motions: Sequence[Motion], predict: Callable[[Motion], Array]) -> Array:
    """Return the dry friction that every axis shows in all logs that run it both ways (n_axes,) [Nm].

    Elasticity, which a rigid prediction lacks, passes for friction in one log and not in another. Zero
    where an axis runs one way only.
    """
    found = np.array([dry_friction_nm([m], predict) for m in motions])
    top = np.max([np.abs(m[1]).max(axis=0) for m in motions], axis=0)
    for row, (_, speed, *_) in zip(found, motions, strict=True):
        way = np.stack([direction(v) for v in speed.T], axis=1)
        least = np.minimum((way > 0.5).mean(axis=0), (way < -0.5).mean(axis=0))
        row[(least < _EACH_WAY) | (np.abs(speed).max(axis=0) < _MOVES * top)] = np.inf
    out = found.min(axis=0)
    return np.asarray(np.where(np.isfinite(out), out, 0.0))


def open_torque_nm(motions: Sequence[Motion], friction_nm: Array) -> list[Array]:
    """Return the standard deviation that dry friction leaves open in every sample [(n, n_axes)] [Nm].

    That of a uniform band at standstill; falling with the square of the speed above a hundredth
    of the largest of all motions.
    """
    return [still * friction_nm / np.sqrt(3) for still in standing(motions)]


def standing(motions: Sequence[Motion]) -> list[Array]:
    """Return how far every sample stands, from 0 to 1 [(n, n_axes)]: a half at a hundredth of the top speed."""
    lengths = np.cumsum([len(m[1]) for m in motions])[:-1]
    speed = np.concatenate([m[1] for m in motions])
    return np.split(1 - np.stack([direction(v) ** 2 for v in speed.T], axis=1), lengths)


def alike(still: Array) -> Array:
    """Return how many samples stand together with each (n, n_axes), one where the axis moves.

    What is open is one and the same torque, or law, all along such a stretch.
    """
    out = np.ones(still.shape)
    for axis, stands in enumerate(still.T > 0.5):
        stretch, count = scipy.ndimage.label(stands)
        if count:
            out[stands, axis] = np.bincount(stretch)[stretch[stands]]
    return out


def certainty(open_nm: Array, error_nm: Array) -> Array:
    """Return the factor on errors (n, n_axes): error of the model over that and what is open."""
    return np.asarray(error_nm / np.sqrt(error_nm**2 + open_nm**2))


# Over which errors count together [s]: longer than a period of what a loop rings with.
_TOGETHER_S = 0.1


def open_errors(
    speed: Array, friction_nm: Array, weighting: Weighting, sample_time_s: float
) -> Array:
    """Return the weighted error that dry friction leaves open around every residual (n, n_axes), rms.

    ``speed`` (n_samples, n_axes). What laws of dry friction differ by where a motor turns round or
    stands: an abrupt sign and a rounded one, and a torque held.
    """
    smooth = np.stack([direction(v) for v in speed.T], axis=1)
    differ = [np.sign(speed) - smooth, 1 - smooth**2]
    squares = sum(weighting.of(friction_nm * d, sample_time_s) ** 2 for d in differ) / 3
    length = max(1, round(_TOGETHER_S / (weighting.decimation * sample_time_s)))
    return np.asarray(np.sqrt(scipy.ndimage.uniform_filter1d(squares, length, axis=0)))
