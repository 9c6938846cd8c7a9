"""Residuals of a model along logs, without a fit."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect, core_effects
from axisight.errors import InputError
from axisight.fitting.divergence import Diverged
from axisight.fitting.sensed import n_readings
from axisight.fitting.simulation_error import FitOptions, simulated_logs
from axisight.fitting.weighting import Weighting
from axisight.logs import Log
from axisight.robot import Robot

Array = NDArray[np.float64]


def simulation_residuals(
    robot: Robot,
    logs: Sequence[Log],
    *,
    effects: Iterable[Effect] = (),
    joints: bool = False,
    accelerometers: bool = False,
    options: FitOptions | None = None,
) -> list[Array]:
    """Return simulated minus logged outputs of each log, as `axisight.fit` compares them.

    Arrays are (n, n_axes): motor torque commands [Nm] in closed loop, else motor positions [rad]. With
    ``joints`` they are (n, 2 n_axes): the angles of the driven joints [rad] follow, without their means, and
    zero where no encoder is. With ``accelerometers``, the readings [m/s^2] of all accelerometers of the robot
    follow in the same way. ``effects`` and ``options`` are those of `axisight.fit`. Raises InputError as it
    does.
    """
    chosen = options or FitOptions()
    n, count = robot.n_axes, n_readings(robot)
    ready, every = simulated_logs(
        robot,
        logs,
        robot.placed(effects),
        joint_weighting=Weighting.flat(n) if joints else None,
        acceleration_weighting=Weighting.flat(count) if accelerometers else None,
        options=chosen,
    )
    at = ready.evaluate(core_effects(every), [], chosen)
    if isinstance(at, Diverged):
        raise InputError(f"robot: expected a model that can be simulated along the logs, {at}")
    outputs = n + (n if joints else 0) + (count if accelerometers else 0)
    lengths = [outputs * log.n_samples for log in logs]
    parts = np.split(at.residual, np.cumsum(lengths)[:-1])
    return [part.reshape(outputs, -1).T for part in parts]
