"""Regresses a logged torque on a predicted one, with friction and an offset."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.gap.signals.motion import Motion

Array = NDArray[np.float64]

EXPLAINED = 0.3
"""Largest share of an axis' torque variance that a right simulator leaves.

With friction and offset in the regression, simulators of real machines leave 10 % or less."""
SAME = (0.4, 2.5)
"""Range of the factor of a predicted torque that is no finding.

A load or gravity that is compensated in the arm changes torques by up to two."""
PARTS = 10
"""Number of parts of each log whose scatter gives a standard error."""
ALIKE = (0.5, 2.0)
"""Range of the ratio of one log's or axis' estimate to that of all."""
SIGNIFICANT = 6.0
"""Smallest significance of an error of a log [standard errors]."""
# Speed where the smoothed sign turns, as a share of the largest speed.
_CORNER = 0.02


@dataclass(frozen=True)
class TorqueFit:
    """A regression of torques on predicted ones, by axis; arrays are (n_axes,).

    - ``slope``: factor of the predicted torque.
    - ``left``: unexplained share of the variance with a positive factor.
    - ``left_turned``: the same with a negative factor.
    - ``gain``: share of the variance that the prediction explains beyond friction and an offset.
    """

    slope: Array
    left: Array
    left_turned: Array
    gain: Array

    @property
    def total(self) -> float:
        """Unexplained share, summed over the axes."""
        return float(self.left.sum())


def nuisance(speed: Array) -> Array:
    """Return speed, its smoothed sign and one, (n, 3): the columns of friction and a torque offset."""
    corner = _CORNER * max(float(np.abs(speed).max()), 1e-12)
    return np.column_stack([speed, speed / np.hypot(speed, corner), np.ones(len(speed))])


def torque_fit(torque: Array, predicted: Array, at: Motion) -> TorqueFit:
    """Regress each column of ``torque`` (n, n_axes) on that of ``predicted``, with speeds from ``at``."""
    rows = [_one(torque[:, i], predicted[:, i], at[1][:, i]) for i in range(torque.shape[1])]
    slope, left, turned, gain = (np.array(column) for column in zip(*rows, strict=True))
    return TorqueFit(slope, left, turned, gain)


def _one(y: Array, predicted: Array, speed: Array) -> tuple[float, float, float, float]:
    power = float(((y - y.mean()) ** 2).sum())
    if not power > 0.0:
        return 1.0, 0.0, 0.0, 0.0
    basis, _ = np.linalg.qr(nuisance(speed))
    y = y - basis @ (basis.T @ y)
    x = predicted - basis @ (basis.T @ predicted)
    bare = float(y @ y) / power
    energy = float(x @ x)
    if not energy > 1e-12 * float(predicted @ predicted):
        return 1.0, bare, bare, 0.0
    slope = float(x @ y) / energy
    gain = slope**2 * energy / power
    with_it = bare - gain
    return slope, with_it if slope > 0 else bare, with_it if slope < 0 else bare, gain
