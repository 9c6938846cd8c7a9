"""What dry friction leaves open: where a motor stands or turns round, it may hold any torque in a band.

A rigid model with friction predicts the torque of a moving axis. Of a standing one it knows no
more than that the torque lies within the dry friction around it: brakes, stiction and the way the
axis came there decide. Such samples are weighed by how little they can tell, not left out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.gap.cutoff import columns, direction
from axisight.gap.motion import Motion

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


def open_torque_nm(motions: Sequence[Motion], friction_nm: Array) -> list[Array]:
    """Return the standard deviation that dry friction leaves open in every sample [(n, n_axes)] [Nm].

    That of a uniform band at standstill; falling with the square of the speed above a hundredth
    of the largest of all motions.
    """
    lengths = np.cumsum([len(m[1]) for m in motions])[:-1]
    speed = np.concatenate([m[1] for m in motions])
    still = 1 - np.stack([direction(v) ** 2 for v in speed.T], axis=1)
    return np.split(still * friction_nm / np.sqrt(3), lengths)


def certainty(open_nm: Array, error_nm: Array) -> Array:
    """Return the factor on errors (n, n_axes): error of the model over that and what is open."""
    return np.asarray(error_nm / np.sqrt(error_nm**2 + open_nm**2))
