"""Whether what moved between days follows the temperature."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from axisight.statistics.intervals import student_factor
from axisight.statistics.one_way import OneWay

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TemperatureSlope:
    """A parameter against the temperature of its axis (analysis of covariance).

    per_c, lower, upper
        Change per degree within days, with its 95 % interval [unit of the parameter per degC].
    p_value
        Probability of so large a slope by chance.
    p_days
        P-value of the difference between days at equal temperature.
    """

    per_c: float
    lower: float
    upper: float
    p_value: float
    p_days: float


def temperature_slope(
    values: Array, temperature_c: Array, group: NDArray[np.intp]
) -> TemperatureSlope | None:
    """Return how ``values`` (n_runs,) follow ``temperature_c`` (n_runs,) within days; None if that does not show.

    ``group`` (n_runs,) numbers the days from 0. It shows with two runs more than days, and temperatures that
    differ within days.
    """
    both = OneWay(np.column_stack([values, temperature_c]), group)
    freedom = both.freedom[1] - 1
    y, t = both.residuals.T
    squares = float(t @ t)
    if freedom < 1 or not squares > 0.0:
        return None
    slope = float(t @ y) / squares
    left = float(((y - slope * t) ** 2).sum())
    error = np.sqrt(left / freedom / squares)
    half = float(student_factor(0.95, freedom)) * error
    p_value = float(2.0 * scipy.special.stdtr(freedom, -abs(slope) / max(error, 1e-300)))
    return TemperatureSlope(
        slope,
        slope - half,
        slope + half,
        p_value,
        _days(values, temperature_c, group, left, freedom),
    )


def _days(
    values: Array, temperature_c: Array, group: NDArray[np.intp], left: float, freedom: int
) -> float:
    """Return the p-value of days, with the temperature as a covariate."""
    above = int(group.max())
    common = np.column_stack([np.ones(len(values)), temperature_c])
    rest = values - common @ np.linalg.lstsq(common, values, rcond=None)[0]
    gained = max(float(rest @ rest) - left, 0.0) / max(above, 1)
    return float(scipy.special.fdtrc(max(above, 1), freedom, gained * freedom / max(left, 1e-300)))
