"""The place where an effect is tried, and the data that its start values come from."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect, EffectInfo
from axisight.gap.hypotheses.ripple_orders import Complex, Turning
from axisight.logs import Log
from axisight.robot import Robot

Array = NDArray[np.float64]

Response = Callable[[str, int, Array], Complex]
"""Response of an axis's weighted residual to an effect, by effect name, axis (from 0) and frequencies [Hz]."""


Place = int | tuple[int, int] | None
"""Place of an effect: an axis (from 1), two axes, or None for the whole arm."""


@dataclass(frozen=True)
class StartData:
    """Data for start values.

    ``turning[log][axis]``: weighted residual torque of the model and motion of the motor; ``response``: how effects
    that repeat with the motor angle show in that residual.
    """

    turning: Sequence[Sequence[Turning]]
    response: Response
    enough: Array
    """Mean square of the residual of each axis (n_axes,) up to which no cause is worth naming."""

    def is_left(self, index: int) -> bool:
        """Whether the residual of an axis (from 0) is large enough for a cause."""
        logs = [axes[index].residual for axes in self.turning]
        square = sum(float(r @ r) for r in logs) / sum(len(r) for r in logs)
        return bool(square > self.enough[index])


@dataclass(frozen=True)
class StartContext:
    """An effect to be tried, and its ``place``: an axis (from 1), two axes, or None for the arm."""

    info: EffectInfo
    place: Place
    robot: Robot
    logs: Sequence[Log]
    at: StartData

    @property
    def index(self) -> int:
        """Column of the axis, or of the first of two axes; 0 for the arm."""
        axis = self.place[0] if isinstance(self.place, tuple) else self.place
        return 0 if axis is None else axis - 1

    def effect(self, values: Mapping[str, float]) -> Effect:
        """Return the effect at this place with these parameters."""
        if isinstance(self.place, tuple):
            return Effect(self.info.name, None, values, self.place)
        return Effect(self.info.name, self.place, values)

    def torque(self) -> list[Array]:
        """Return the torque (n,) of the axis in every log [Nm]."""
        return [log.torque_nm[:, self.index] for log in self.logs]

    def turned(self) -> tuple[list[Turning], list[Complex]]:
        """Return residual and motor motion of the axis in every log, and the response of the residual to the effect."""
        logs = [axes[self.index] for axes in self.at.turning]
        shown = [self.at.response(self.info.name, self.index, log.frequency_hz) for log in logs]
        return logs, shown
