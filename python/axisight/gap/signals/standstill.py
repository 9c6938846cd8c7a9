"""The torque that dry friction leaves open where a motor stands or turns round.

A rigid model with friction predicts the torque of a moving axis. For a standing axis it predicts only a band as
wide as the dry friction: brakes, stiction and the way to the stop decide where in the band the torque lies.
Such samples stay in the comparison with smaller weights.
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
    """Return the dry friction of every axis (n_axes,) [Nm], by least squares; zero instead of a negative one.

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


EACH_WAY = 0.01
"""Smallest share of the samples in each direction that separates friction from an offset."""
# Smallest top speed of a log for an estimate of friction, as a share of the top speed in all logs.
_MOVES = 0.1


def sure_friction_nm(motions: Sequence[Motion], predict: Callable[[Motion], Array]) -> Array:
    """Return the smallest dry friction (n_axes,) [Nm] among the logs that move an axis in both directions.

    The rigid prediction lacks elasticity, which may look like friction in single logs. Zero for an axis without
    such a log.
    """
    found = np.array([dry_friction_nm([m], predict) for m in motions])
    top = np.max([np.abs(m[1]).max(axis=0) for m in motions], axis=0)
    for row, (_, speed, *_) in zip(found, motions, strict=True):
        way = np.stack([direction(v) for v in speed.T], axis=1)
        least = np.minimum((way > 0.5).mean(axis=0), (way < -0.5).mean(axis=0))
        row[(least < EACH_WAY) | (np.abs(speed).max(axis=0) < _MOVES * top)] = np.inf
    out = found.min(axis=0)
    return np.asarray(np.where(np.isfinite(out), out, 0.0))


def open_torque_nm(motions: Sequence[Motion], friction_nm: Array) -> list[Array]:
    """Return the standard deviation (n, n_axes) [Nm] of the torque that dry friction leaves open at each sample.

    At standstill it is that of a uniform band; it falls with the square of the speed above 1 % of the top speed
    of all motions.
    """
    return [still * friction_nm / np.sqrt(3) for still in standing(motions)]


def standing(motions: Sequence[Motion]) -> list[Array]:
    """Return how far each sample is at standstill (n, n_axes): 1 at rest, 0.5 at 1 % of the top speed, 0 in motion."""
    lengths = np.cumsum([len(m[1]) for m in motions])[:-1]
    speed = np.concatenate([m[1] for m in motions])
    return np.split(1 - np.stack([direction(v) ** 2 for v in speed.T], axis=1), lengths)


def alike(still: Array) -> Array:
    """Return the number of samples in the standstill around each sample (n, n_axes); one where the axis moves.

    The open torque is the same throughout one standstill, so its samples are not independent.
    """
    out = np.ones(still.shape)
    for axis, stands in enumerate(still.T > 0.5):
        stretch, count = scipy.ndimage.label(stands)
        if count:
            out[stands, axis] = np.bincount(stretch)[stretch[stands]]
    return out


def certainty(open_nm: Array, error_nm: Array) -> Array:
    """Return the factor on errors (n, n_axes): model error over the root of squared model error and open torque."""
    return np.asarray(error_nm / np.sqrt(error_nm**2 + open_nm**2))


# Length of the moving average over squared errors [s], longer than a period in which a loop rings.
_TOGETHER_S = 0.1


def open_errors(
    speed: Array, friction_nm: Array, weighting: Weighting, sample_time_s: float
) -> Array:
    """Return the rms of the weighted error that dry friction leaves open around each residual (n, n_axes).

    ``speed`` (n_samples, n_axes) [rad/s]. Near standstill friction laws differ by an abrupt or a smooth sign,
    and by a torque that holds the axis. The error is what these differences make of ``friction_nm`` (n_axes,)
    [Nm].
    """
    smooth = np.stack([direction(v) for v in speed.T], axis=1)
    differ = [np.sign(speed) - smooth, 1 - smooth**2]
    squares = sum(weighting.of(friction_nm * d, sample_time_s) ** 2 for d in differ) / 3
    length = max(1, round(_TOGETHER_S / (weighting.decimation * sample_time_s)))
    return np.asarray(np.sqrt(scipy.ndimage.uniform_filter1d(squares, length, axis=0)))
