"""Where an effect is tried, and what its start values are taken from."""

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
"""Of the weighted residual on an axis (from 0) to an effect there, by its name, at frequencies [Hz]."""


Place = int | tuple[int, int] | None
"""Of an effect: an axis from 1, two of them, or the arm."""


@dataclass(frozen=True)
class StartData:
    """What start values are taken from.

    ``turning[log][axis]``: weighted residual torque of the model, and how the motor turned;
    ``response``: how effects that repeat with the motor angle show in it.
    """

    turning: Sequence[Sequence[Turning]]
    response: Response
    enough: Array
    """Mean square of the residual of each axis up to which no cause is worth naming."""

    def is_left(self, index: int) -> bool:
        """Whether the residual of an axis holds something worth a cause."""
        logs = [axes[index].residual for axes in self.turning]
        square = sum(float(r @ r) for r in logs) / sum(len(r) for r in logs)
        return bool(square > self.enough[index])


@dataclass(frozen=True)
class StartContext:
    """An effect to be tried at a place: ``axis`` from 1, two of them, or None for the arm."""

    info: EffectInfo
    place: Place
    robot: Robot
    logs: Sequence[Log]
    at: StartData

    @property
    def index(self) -> int:
        """Column of the axis, of the first of two."""
        axis = self.place[0] if isinstance(self.place, tuple) else self.place
        return 0 if axis is None else axis - 1

    def effect(self, values: Mapping[str, float]) -> Effect:
        """Return the effect with these parameters."""
        if isinstance(self.place, tuple):
            return Effect(self.info.name, None, values, self.place)
        return Effect(self.info.name, self.place, values)

    def torque(self) -> list[Array]:
        """Return the torque of the axis in every log [Nm]."""
        return [log.torque_nm[:, self.index] for log in self.logs]

    def turned(self) -> tuple[list[Turning], list[Complex]]:
        """Return how the motor of the axis turned in every log, and how the effect shows in its residual."""
        logs = [axes[self.index] for axes in self.at.turning]
        shown = [self.at.response(self.info.name, self.index, log.frequency_hz) for log in logs]
        return logs, shown
