"""Which parameters moved between days: means, changes with intervals, tests, and the smallest change that shows."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.repeats.columns import Columns
from axisight.repeats.run_parameters import RunParameters
from axisight.statistics.intervals import student_factor
from axisight.statistics.one_way import OneWay, least_shift, power_of_shift

Array = NDArray[np.float64]

SHOWN = 0.95
"""Probability with which the smallest change is found."""


def parameter_table(
    found: RunParameters,
    runs: OneWay,
    days: list[str],
    reference: int,
    level: float,
    weight: Array,
    torque_nm: Array,
) -> xr.Dataset:
    """Return parameters by day, and their scatter within runs, between runs and between days.

    ``runs`` holds the values of the parameters, ``reference`` is the day (from 0) that changes refer to, and
    ``level`` the probability of any false finding. Intervals of day means hold with 1 - ``level`` each, those
    of the changes of one parameter together (Bonferroni). ``torque_share`` is the largest difference between
    two days as a torque that no other parameter could give, relative to ``torque_nm`` (n_axes,). Samples count
    by ``weight`` (n_samples, n_axes).
    """
    between, within = runs.components
    _, freedom = runs.freedom
    error = np.sqrt(within / runs.counts[:, None])
    change = runs.means - runs.means[reference]
    change_error = np.sqrt(within * (1.0 / runs.counts + 1.0 / runs.counts[reference])[:, None])
    change_error[reference] = 0.0
    one = student_factor(1.0 - level, max(freedom, 1)) if freedom else np.inf
    each = level / max(len(days) - 1, 1)
    together = student_factor(1.0 - each, max(freedom, 1)) if freedom else np.inf
    noise = np.mean(found.variance, axis=0)
    by_day = {
        "value": runs.means,
        "lower": runs.means - one * error,
        "upper": runs.means + one * error,
        "change": change,
        "change_lower": change - together * change_error,
        "change_upper": change + together * change_error,
    }
    widest = np.ptp(runs.means, axis=0)
    by_parameter = {
        "torque_share": widest * torque_per_unit(found.columns, weight, torque_nm),
        "std_within_run": np.sqrt(noise),
        "std_between_runs": np.sqrt(np.maximum(within - np.nan_to_num(noise), 0.0)),
        "std_of_run": np.sqrt(within),
        "std_between_days": np.sqrt(between),
        "p_value": runs.p_value if min(runs.freedom) else np.full(len(within), np.nan),
    }
    return xr.Dataset(
        {name: (("day", "parameter"), x) for name, x in by_day.items()}
        | {name: ("parameter", x) for name, x in by_parameter.items()}
        | {"run_value": (("run", "parameter"), found.values)},
        coords={
            "parameter": list(found.columns.names),
            "unit": ("parameter", list(found.columns.units)),
            "axis": ("parameter", list(found.columns.axis)),
            "day": days,
        },
    )


def torque_per_unit(columns: Columns, weight: Array, torque_nm: Array) -> Array:
    """Return the rms torque (n_parameters,) of one unit of each parameter that no other parameter could give.

    It is relative to the torque of the axis, ``torque_nm`` (n_axes,). Parameters with similar columns change
    together, each against the other: their columns alone would make such changes look large.
    """
    scaled = (weight / torque_nm)[..., None] * columns.matrix[0]
    k = scaled.shape[-1]
    r = np.linalg.qr(scaled.reshape(-1, k), mode="r")
    # Norm of a column less its projection on the others.
    own = 1.0 / np.linalg.norm(np.linalg.inv(r), axis=1)
    samples = weight.sum(axis=0)
    return np.asarray(own / np.sqrt(samples[samples > 0].mean()))


def with_power(table: xr.Dataset, counts: NDArray[np.intp], significance: float) -> xr.Dataset:
    """Return the table with ``least_change``: the smallest change of one day that is found with 95 % probability.

    ``counts``: runs of each day (n_days,). ``significance``: level of a single test, that of the first step
    of Holm's procedure.
    """
    variance = table["std_of_run"].values ** 2
    least = least_shift(counts, variance, significance, SHOWN)
    return table.assign(least_change=("parameter", least)).assign_attrs(
        significance=significance, probability=SHOWN
    )


def power_of_change(
    table: xr.Dataset, counts: NDArray[np.intp], significance: float, share: float, reference: int
) -> Array:
    """Return the probability (n_parameters,) of finding a change by ``share`` [1] of the reference day's value."""
    shift = np.abs(share * table["value"].values[reference])
    return power_of_shift(counts, table["std_of_run"].values ** 2, significance, shift)
