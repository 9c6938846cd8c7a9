"""Periodic joint motions as finite Fourier series (Swevers et al. 1997)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.excitation import References, write_references
from axisight.excitation.checks import whole_samples
from axisight.rigid_body.coupling import MotorCoupling, gear_coupling
from axisight.robot import Robot

Array = NDArray[np.float64]


@summarized
@dataclass(frozen=True, eq=False)
class FourierTrajectory:
    """Angles of the driven joints as finite Fourier series, joint side.

    With w = 2 pi ``fundamental_hz``, ``q = centre + sum_l (sine_l sin(l w t) - cosine_l
    cos(l w t)) / (l w)``. ``sine`` and ``cosine``, both (n_axes, n_harmonics), are amplitudes of
    velocity [rad/s]; ``centre_rad`` is (n_axes,).
    """

    fundamental_hz: float
    centre_rad: Array
    sine: Array
    cosine: Array

    @property
    def period_s(self) -> float:
        """Period [s]."""
        return 1.0 / self.fundamental_hz

    @property
    def n_axes(self) -> int:
        """Number of driven axes."""
        return len(self.centre_rad)

    @property
    def n_harmonics(self) -> int:
        """Number of harmonics of every axis."""
        return int(self.sine.shape[1])

    def motion(self, time_s: ArrayLike) -> tuple[Array, Array, Array]:
        """Return angles, velocities, accelerations (n, n_axes) at ``time_s`` (n,) [s]."""
        t = np.atleast_1d(np.asarray(time_s, dtype=np.float64))
        q, v, a = series(self.fundamental_hz, self.n_harmonics, t)
        both = np.concatenate([self.sine, self.cosine], axis=1).T
        return self.centre_rad + q @ both, v @ both, a @ both

    def references(
        self,
        robot: Robot,
        *,
        coupling: MotorCoupling | None = None,
        design: dict[str, Any] | None = None,
    ) -> References:
        """Return one period of motor velocity references at the robot's sample time.

        ``coupling`` are the gears, by default those of the robot. The references keep ``design``
        together with the coefficients and ``start_rad``, the joint angles at t = 0. Raises InputError
        for another number of axes, and if the period is not a whole number of samples.
        """
        if robot.n_axes != self.n_axes:
            raise InputError(f"robot: expected {self.n_axes} axes, got {robot.n_axes}")
        n = whole_samples("period_s", self.period_s, robot.sample_time_s)
        q, v, _ = self.motion(np.arange(n) * robot.sample_time_s)
        gears = gear_coupling(robot) if coupling is None else coupling
        made = {
            "kind": "fourier_series",
            "robot": robot.name,
            "fundamental_hz": self.fundamental_hz,
            "start_rad": q[0].tolist(),
            "centre_rad": self.centre_rad.tolist(),
            "sine_rad_s": self.sine.tolist(),
            "cosine_rad_s": self.cosine.tolist(),
        }
        return References(
            sample_time_s=robot.sample_time_s,
            period=gears.motor_motion(v)[None],
            lines=np.arange(1, self.n_harmonics + 1, dtype=np.int64),
            design=made | (design or {}),
        )

    def write(
        self, path: Path | str, robot: Robot, *, design: dict[str, Any] | None = None
    ) -> list[Path]:
        """Write the references of ``robot`` with ``design`` to ``path``, and return the files written.

        Formats (.csv, .mat, .parquet) and errors are those of
        :func:`axisight.excitation.write_references`.
        """
        return write_references(self.references(robot, design=design), path)


def series(fundamental_hz: float, harmonics: int, time_s: Array) -> tuple[Array, Array, Array]:
    """Return the matrices (n, 2 h) from velocity amplitudes (sine, then cosine) to q, v, a."""
    w = 2.0 * np.pi * fundamental_hz * np.arange(1, harmonics + 1)
    s, c = np.sin(time_s[:, None] * w), np.cos(time_s[:, None] * w)
    return np.hstack([s / w, -c / w]), np.hstack([c, s]), np.hstack([-w * s, w * c])
