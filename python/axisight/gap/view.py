"""What a way of comparing simulator and logs has to say; `axisight.gap.modes` chooses one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.gap.candidates import all_candidates, situation
from axisight.gap.model import Evidence, FreeEffect, ModelFitter
from axisight.gap.noise import Floor
from axisight.gap.result import Mode
from axisight.gap.settings import Settings
from axisight.gap.torques import Variant
from axisight.logs import Log
from axisight.robot import Robot

Array = NDArray[np.float64]

# A torque ripple is followed by the controller one to one up to about here.
_RIPPLE_BANDWIDTH_HZ = 20.0


@dataclass
class View(ABC):
    """One way of comparing simulator and logs: what to fit, what error it leaves, what floor."""

    mode: Mode
    robot: Robot
    logs: list[Log]
    settings: Settings
    fitter: ModelFitter
    floor: Floor
    cutoff_hz: float | None = None
    """Of the low-pass on both sides; None where there is none."""

    def candidates(self, model: Evidence) -> list[FreeEffect]:
        """Return the candidates, with start values from the residual of a model."""
        at = situation(
            self.robot, self.logs, model, self.fitter.weighting.decimation, _RIPPLE_BANDWIDTH_HZ
        )
        inverse = self.mode == "inverse_dynamics"
        return all_candidates(self.robot, self.logs, at, inverse_dynamics=inverse)

    @abstractmethod
    def measured(self, log: Log) -> Array:
        """Return the torque errors are taken from (n, n_axes) [Nm]."""

    @abstractmethod
    def torques(self, variant: Variant, logs: Sequence[Log]) -> list[Array]:
        """Return the torque of a simulator on each log (n, n_axes) [Nm]."""

    @abstractmethod
    def noises(self, logs: Sequence[Log], first_run: int) -> list[Array]:
        """Return the torque error of noise alone on each log (n, n_axes) [Nm].

        The noise of log ``i`` is that of run ``first_run + i``.
        """
