"""Terms of a fitted remainder: functions in tables, which any program can read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.display.summary import summarized
from axisight.remainder.records import Motion
from axisight.remainder.variables import ACTS, VARIABLES, Acts, factor

Array = NDArray[np.float64]


@summarized
@dataclass(frozen=True, eq=False, kw_only=True)
class Term:
    """One term: on ``axis`` (from 1) a function of one variable times what ``acts`` says.

    - ``acts``: ``torque`` (times 1), ``direction`` (times the smoothed sign of the axis' speed), ``speed`` or ``load``
      (times this quantity of the axis).
    - ``variable``, ``of_axis`` (from 1): what it depends on, and of which axis.
    - ``x`` (m,), ``value`` (m,), ``standard_error`` (m,): the function and its standard error, linear between points.
      Beyond the ends the function keeps its value there. With a ``period`` it repeats.
    - ``corner_rad_s``: speed where the smoothed sign turns [rad/s].
    - ``gain``, ``significance``: share of the squared residual of the axis that the term removes on held-out data
      [1], and this over its standard error.
    """

    axis: int
    acts: Acts
    variable: str
    of_axis: int
    x: Array
    value: Array
    standard_error: Array
    corner_rad_s: float
    gain: float
    significance: float
    period: float | None = None
    hint: str = ""

    @property
    def unit(self) -> str:
        """Unit of ``value``."""
        return ACTS[self.acts][1]

    @property
    def x_unit(self) -> str:
        """Unit of ``x``."""
        return VARIABLES[self.variable].unit

    @property
    def words(self) -> str:
        """How the term acts and what it depends on: ``a torque against the motion, of the load of axis 2``."""
        if self.variable == "constant":
            return ACTS[self.acts][0]
        name = VARIABLES[self.variable].words
        of = "" if self.variable == "time" else f" of axis {self.of_axis}"
        again = "" if self.period is None else f", every {self.period:.3g} {self.x_unit}"
        return f"{ACTS[self.acts][0]}, of the {name}{of}{again}"

    def function(self, x: Array) -> Array:
        """Return the function at values (n,) of its variable."""
        if self.variable == "constant":
            return np.full(len(x), self.value[0])
        at = x if self.period is None else np.mod(x, self.period)
        return np.interp(at, self.x, self.value)

    def torque(self, motion: Motion) -> Array:
        """Return the torque along a motion (n,) [Nm]."""
        acting = factor(self.acts, motion, self.axis - 1, self.corner_rad_s)
        x = VARIABLES[self.variable].read(motion, self.of_axis - 1)
        return np.asarray(acting * self.function(x))
