"""Weights of step 3: motors, joint encoders and accelerometers by the spectrum of their residuals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect
from axisight.fitting import FitOptions, Weighting, simulation_residuals, spectral_weighting
from axisight.logs import Log
from axisight.robot import Robot

Real = NDArray[np.float64]


@dataclass(frozen=True)
class Sensors:
    """The kinds of sensors on the arm that at least one log has."""

    joints: bool
    accelerometers: bool

    @classmethod
    def of(cls, logs: Sequence[Log]) -> Sensors:
        """Return the sensors of logs."""
        return cls(
            joints=any(log.joint_position_rad is not None for log in logs),
            accelerometers=any(log.acceleration_m_s2 for log in logs),
        )

    def residuals(
        self, robot: Robot, logs: Sequence[Log], effects: Sequence[Effect], options: FitOptions
    ) -> list[Real]:
        """Return the residuals of motors and of these sensors, as `axisight.simulation_residuals`."""
        return simulation_residuals(
            robot,
            logs,
            effects=effects,
            joints=self.joints,
            accelerometers=self.accelerometers,
            options=options,
        )

    def weightings(
        self, robot: Robot, logs: Sequence[Log], residuals: Sequence[Real]
    ) -> tuple[Weighting, Weighting | None, Weighting | None]:
        """Return the weightings of motors, joint encoders and accelerometers; None for absent sensors."""
        step, n = logs[0].sample_time_s, robot.n_axes
        behind = n + (n if self.joints else 0)
        motors = spectral_weighting([r[:, :n] for r in residuals], step)
        pairs = list(zip(residuals, logs, strict=True))
        joints = [r[:, n:behind] for r, log in pairs if log.joint_position_rad is not None]
        readings = [r[:, behind:] for r, log in pairs if log.acceleration_m_s2]
        return (
            motors,
            _of_present(joints, step) if joints else None,
            _of_present(readings, step) if readings else None,
        )


def _of_present(residuals: Sequence[Real], step: float) -> Weighting:
    """Return the spectral weighting of readings (n, n_readings), each from the logs that have it.

    A reading that a log lacks is zero throughout, and would make the others look too exact.
    """
    common = spectral_weighting(residuals, step)
    weight = common.weight.copy()
    for place, row in enumerate(weight):
        present = [r[:, [place]] for r in residuals if r[:, place].any()]
        if 0 < len(present) < len(residuals):
            own = spectral_weighting(present, step)
            row[:] = np.interp(common.frequency_hz, own.frequency_hz, own.weight[0])
    return replace(common, weight=weight)
