"""The run-up: a simulated motion from rest into the motion at the first sample of a log."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.display.summary import summarized
from axisight.errors import InputError

Floats = NDArray[np.float64]


@summarized
@dataclass(frozen=True, eq=False, kw_only=True)
class RunUp:
    """Samples before a log that are simulated but not compared; the first is at rest.

    Motor-side `position_rad` (rad), `torque_nm` (Nm) and `velocity_ref_rad_s` (rad/s) have shape (m, axes),
    at the sample time of the log. The sample after the last one is the first of the log. Raises InputError
    when shapes disagree.
    """

    position_rad: Floats
    torque_nm: Floats
    velocity_ref_rad_s: Floats

    def __post_init__(self) -> None:
        """Check the shapes."""
        shape = self.position_rad.shape
        if len(shape) != 2 or shape[0] < 1:
            raise InputError(f"run_up.position_rad: expected shape (m, axes), got {shape}")
        for field in ("torque_nm", "velocity_ref_rad_s"):
            got = getattr(self, field).shape
            if got != shape:
                raise InputError(f"run_up.{field}: expected shape {shape}, got {got}")

    @property
    def n_samples(self) -> int:
        """Number of samples."""
        return int(self.position_rad.shape[0])

    def less(self, position_rad: Floats, torque_nm: Floats) -> RunUp:
        """Return the run-up minus an offset that eases from 0 to these values at the start of the log.

        `position_rad` (rad) and `torque_nm` (Nm) have shape (axes,).
        """
        share = eased(np.linspace(0.0, 1.0, self.n_samples + 1)[:-1])[:, None]
        return RunUp(
            position_rad=self.position_rad - share * position_rad,
            torque_nm=self.torque_nm - share * torque_nm,
            velocity_ref_rad_s=self.velocity_ref_rad_s,
        )


def eased(share: Floats) -> Floats:
    """Return a smooth step of a share from 0 to 1: its first two derivatives are zero at both ends."""
    return np.asarray(share**3 * (10 - 15 * share + 6 * share**2))
