"""The result of a comparison of days."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.arguments import not_negative
from axisight.display.summary import summarized
from axisight.repeats.alignment import AlignedRuns
from axisight.repeats.columns import OF_AXIS
from axisight.repeats.parameter_changes import power_of_change

SCHEMA = "axisight.repeat/1"
RELATIVE = ("coulomb_friction", "viscous_friction", "inertia")
"""Quantities whose changes are also given as shares."""


@summarized
@dataclass(frozen=True, eq=False)
class DayComparison:
    """What differs between days of runs of one motion.

    runs, days
        Names of the runs, and of the days in the order of their first runs.
    day_of_run
        Number of the day of each run (n_runs,), from 0.
    reference
        The day that changes refer to.
    level
        Probability of any false finding.

    Parameters
    ----------
        Dataset over (day, parameter): ``value``, ``lower``, ``upper``, ``change``, ``change_lower``,
        ``change_upper``; over (run, parameter): ``run_value``; over (parameter): ``std_within_run`` from
        noise within a run, ``std_between_runs`` beyond it, ``std_of_run`` of both, ``std_between_days``,
        ``torque_share`` (the largest difference between days as a torque that no other
        parameter could give, a share of the torque), ``believed``
        (values, not only changes, are known), ``p_value``, ``p_adjusted``, ``echo``, ``moved``, and
        ``least_change``, which is found with 95 % probability. Coordinates ``unit`` and ``axis`` (from 1).
    torque
        Dataset over axis: ``within_nm`` and ``between_nm`` (standard deviations within and between days),
        ``torque_nm``, ``floor``, ``floor_lower``, ``floor_upper``, ``floor_any_day`` [shares of the torque],
        ``smooth_within_nm``, ``smooth_between_nm`` of the low-passed torque, ``unexplained``: what the model
        leaves in all runs together [share of the torque]; ``p_value``, ``p_adjusted``, ``echo``, ``moved``.
    places
        Dataset over (place, axis): ``within_nm``, ``between_nm`` by direction, speed, time and band.
    findings
        What to know before the figures are believed.
    aligned
        The runs with a common start.

    """

    runs: tuple[str, ...]
    days: tuple[str, ...]
    day_of_run: NDArray[np.intp]
    reference: str
    level: float
    parameters: xr.Dataset
    torque: xr.Dataset
    places: xr.Dataset
    findings: tuple[str, ...]
    aligned: AlignedRuns

    @property
    def moved(self) -> tuple[str, ...]:
        """Parameters that moved, and axes whose torque differs, as ``torque of axis 2``."""
        names = self.parameters["parameter"].values[self.parameters["moved"].values]
        axes = self.torque["axis"].values[self.torque["moved"].values]
        return (*map(str, names), *(f"torque of axis {axis}" for axis in axes))

    @property
    def shares(self) -> xr.DataArray:
        """Changes relative to the value of the reference day, (day, parameter) [1].

        NaN for offsets and load parameters, which may be near zero, and where values are not ``believed``.
        """
        table = self.parameters
        own = [str(name).rpartition(".")[2] in RELATIVE for name in table["parameter"].values]
        value = table["value"].sel(day=self.reference)
        known = table["believed"].values & np.array(own) & (value.values > 0)
        return (table["change"] / value).where(xr.DataArray(known, dims=("parameter",)))

    @property
    def of_load(self) -> tuple[str, ...]:
        """Parameters of the last link, which show a load."""
        names = [str(name) for name in self.parameters["parameter"].values]
        return tuple(n for n in names if n.rpartition(".")[2] not in OF_AXIS)

    @property
    def tested(self) -> bool:
        """Whether there are two days or more, and repeats."""
        return bool(np.isfinite(self.parameters["p_value"].values).any())

    def power(self, share: float) -> xr.DataArray:
        """Return the probability (parameter,) of finding that one day's value changed by ``share`` [1].

        It assumes the scatter that these runs have, and is NaN where `shares` are. Raises InputError for a
        share that is not a number above zero.
        """
        at = self.days.index(self.reference)
        counts = np.bincount(self.day_of_run)
        limit = float(self.parameters.attrs["significance"])
        share = not_negative("share", share)
        found = power_of_change(self.parameters, counts, limit, share, at)
        found = np.where(np.isnan(self.shares.isel(day=at).values), np.nan, found)
        return xr.DataArray(found, {"parameter": self.parameters["parameter"]}, ("parameter",))

    def to_dict(self) -> dict[str, Any]:
        """Return the comparison as a document for JSON; numbers that are not finite become None."""
        table = self.parameters
        return {
            "schema": SCHEMA,
            "level": self.level,
            "tested": self.tested,
            "moved": list(self.moved),
            "reference": self.reference,
            "runs": [
                {"name": run, "day": self.days[day], "shift_samples": int(shift)}
                for run, day, shift in zip(
                    self.runs, self.day_of_run, self.aligned.shift, strict=True
                )
            ],
            "parameters": [
                _parameter(table.isel(parameter=i)) for i in range(table.sizes["parameter"])
            ],
            "torque": [
                _numbers(self.torque.isel(axis=i)) for i in range(self.torque.sizes["axis"])
            ],
            "places": [
                {"place": str(name), "axis": int(axis)}
                | _numbers(self.places.sel(place=name, axis=axis), coords=False)
                for name in self.places["place"].values
                for axis in self.places["axis"].values
            ],
            "findings": list(self.findings),
        }


def _parameter(one: xr.Dataset) -> dict[str, Any]:
    days = one.drop_dims("run")
    by_day = [name for name in days.data_vars if "day" in days[name].dims]
    return {
        "name": str(one["parameter"].item()),
        "unit": str(one["unit"].item()),
        "axis": int(one["axis"].item()),
        **_numbers(days.drop_vars(by_day), coords=False),
        "days": [
            {"day": str(day)}
            | {str(name): _plain(days[name].sel(day=day).item()) for name in by_day}
            for day in days["day"].values
        ],
        "runs": [_plain(x) for x in one["run_value"].values.tolist()],
    }


def _numbers(one: xr.Dataset, *, coords: bool = True) -> dict[str, Any]:
    names = [*(one.coords if coords else ()), *one.data_vars]
    return {str(name): _plain(one[name].item()) for name in names}


def _plain(value: Any) -> Any:
    """Return a value for JSON."""
    return None if isinstance(value, float) and not np.isfinite(value) else value
