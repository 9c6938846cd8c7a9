"""What to know about the runs before the figures are believed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.repeats.alignment import AlignedRuns
from axisight.repeats.temperature import TemperatureSlope, temperature_slope
from axisight.statistics.holm import holm
from axisight.statistics.one_way import OneWay

Array = NDArray[np.float64]
Whole = NDArray[np.intp]

# Fewest runs beyond one a day; with fewer, variances within days are known to a factor of two or worse.
_FEW = 4
# Temperatures of days count as equal below this difference [degC].
_SAME_C = 0.5
_FRICTION = ("coulomb_friction", "viscous_friction")


def findings_of(
    aligned: AlignedRuns,
    table: xr.Dataset | None,
    dropped: Sequence[str],
    days: Sequence[str],
    day: Whole,
    level: float,
) -> tuple[str, ...]:
    """Return sentences on shifts, days, columns, drift within days, and temperature."""
    found = [*_days(days, day), *_shifts(aligned)]
    if dropped:
        found.append(
            f"this motion does not separate {', '.join(dropped)} from the other parameters: their changes show "
            "in those; move every axis both ways at several speeds"
        )
    if table is not None:
        found += _drift(table, day, level)
        found += _temperature(aligned, table, day, level)
    return tuple(found)


def _days(days: Sequence[str], day: Whole) -> list[str]:
    more = len(day) - len(days)
    if len(days) == 1:
        return ["all runs are of one day: they show the floor, and no change. Name days with --by"]
    if more < _FEW:
        return [
            f"there are {more} runs more than days: only large changes show; record three runs or more a day"
        ]
    return []


def _shifts(aligned: AlignedRuns) -> list[str]:
    late = aligned.shift - aligned.shift.min()
    if not late.any():
        return []
    return [
        f"starts differ by up to {late.max() * aligned.sample_time_s:.3g} s; runs are aligned to whole samples "
        f"and compared over the {aligned.logs[0].duration_s:.3g} s that they share"
    ]


def _drift(table: xr.Dataset, day: Whole, level: float) -> list[str]:
    """Return a finding on parameters that follow the order of the runs within days."""
    order = np.zeros(len(day))
    for one in range(int(day.max()) + 1):
        order[day == one] = np.arange(np.count_nonzero(day == one))
    names = table["parameter"].values
    values = table["run_value"].values
    slopes = [temperature_slope(values[:, i], order, day) for i in range(len(names))]
    p = holm(np.array([np.nan if s is None else s.p_value for s in slopes]))
    drifting = [
        f"{name} ({s.per_c:+.2g} {unit} a run)"
        for name, unit, s, one in zip(names, table["unit"].values, slopes, p, strict=True)
        if s is not None and one < level
    ]
    if not drifting:
        return []
    return [
        f"within days, {', '.join(drifting)} follows the order of the runs: the machine warms up. Warm it up "
        "before the first run, or record the same number of runs from cold every day"
    ]


def _temperature(aligned: AlignedRuns, table: xr.Dataset, day: Whole, level: float) -> list[str]:
    logged = [log.temperature_c for log in aligned.logs]
    moved = np.flatnonzero(table["moved"].values)
    friction = [
        i for i in moved if str(table["parameter"].values[i]).rpartition(".")[2] in _FRICTION
    ]
    if any(t is None for t in logged):
        if not friction:
            return []
        return [
            "no temperature was logged: friction follows it, so the days may differ in temperature only"
        ]
    mean = np.array([np.mean(t, axis=0) for t in logged if t is not None])
    return [
        text
        for i in moved
        if np.isfinite(mean[:, int(table["axis"].values[i]) - 1]).all()
        for text in _words(table, int(i), mean[:, int(table["axis"].values[i]) - 1], day, level)
    ]


def _words(table: xr.Dataset, i: int, celsius: Array, day: Whole, level: float) -> list[str]:
    """Return what the temperature says about a parameter that moved."""
    name, unit = table["parameter"].values[i], table["unit"].values[i]
    apart = float(np.ptp(OneWay(celsius[:, None], day).means))
    if apart < _SAME_C:
        return []
    text = f"{name}: the days differ in temperature by {apart:.2g} degC"
    slope = temperature_slope(table["run_value"].values[:, i], celsius, day)
    if slope is None:
        return [
            f"{text}, and runs of one day are equally warm: which of both moved it does not show"
        ]
    return [f"{text}; {_attributed(slope, str(unit), level)}"]


def _attributed(slope: TemperatureSlope, unit: str, level: float) -> str:
    per = f"{slope.per_c:.3g} [{slope.lower:.3g}, {slope.upper:.3g}] {unit} per degC within days"
    if slope.p_days < level:
        return f"at equal temperature it moved too ({per})"
    if slope.p_value < level:
        return f"it follows the temperature ({per}), which explains the change"
    return (
        f"runs of one day differ too little in temperature to say whether that explains it ({per}); "
        "record runs from cold to warm on one day"
    )
