"""pydiffsol on the robot: the smooth problem in one call, and sample by sample."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pydiffsol

from common import diffsl_plant
from common.loops import Task, sampled
from common.robot_model import Extras, Model
from common.smooth import times
from common.tones import Tones

Array = np.ndarray
NONE = np.array([])


class Smooth:
    """The continuous-time loop; compiled once, solved at any tolerance."""

    def __init__(
        self,
        model: Model,
        tones: Tones,
        feed_forward: Array,
        task: Task,
        solver: str = "tsit45",
        extras: Extras | None = None,
    ) -> None:
        code = diffsl_plant.smooth_loop(model, tones, task.start, feed_forward, task.size, extras)
        self.ode = pydiffsol.Ode(code, ode_solver=getattr(pydiffsol, solver))
        self.times = times(task)

    def set(self, rtol: float) -> None:
        self.ode.rtol, self.ode.atol, self.ode.h0 = rtol, rtol, 1e-5

    def prepare(self, task: Task, rtol: float) -> Callable[[], Array]:
        """Positions at the samples."""
        self.set(rtol)
        return lambda: np.asarray(self.ode.solve_dense(NONE, times(task)).ys).T

    def bare(self) -> int:
        """Solve without outputs in between; returns the number of accepted steps."""
        return len(self.ode.solve(NONE, self.times[-1]).ts) - 1


class Sampled:
    """The sampled loop: one call per sample, its torques and states as inputs."""

    def __init__(
        self, model: Model, task: Task, solver: str = "tsit45", extras: Extras | None = None
    ) -> None:
        code = diffsl_plant.held_torque(model, task.size, extras)
        self.ode = pydiffsol.Ode(code, ode_solver=getattr(pydiffsol, solver))

    def prepare(self, task: Task, rtol: float) -> Callable[[], Array]:
        """Positions at the samples; every sample is tried in one step."""
        ode, size, period = self.ode, task.size, task.sample_time
        ode.rtol, ode.atol, ode.h0 = rtol, rtol, period
        beyond = np.array([period, 1.25 * period])

        def advance(x: Array, u: Array) -> Array:
            inputs = np.concatenate([u, x / size])
            try:
                return np.asarray(ode.solve(inputs, period).ys)[:, -1] * size
            except RuntimeError:
                # Once in a few hundred samples a step ends within rounding of the end, and
                # the solver takes that for misuse; another end gets past it.
                return np.asarray(ode.solve_dense(inputs, beyond).ys)[:, 0] * size

        return lambda: sampled(task, advance)
