"""Plot parameters over days: runs, day means and their intervals."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from axisight.arguments import between, instance
from axisight.palette import AFTER, BEFORE
from axisight.repeats.result import DayComparison

_WIDEST_IN = 100
_MOST_COLUMNS = 3
_LONGEST = 12


def plot_days(found: DayComparison, *, width_in: float = 7.2) -> Figure:
    """Plot every parameter of the axes over the days: runs, and day means with their intervals.

    Parameters that moved are orange. Load parameters are drawn if one moved. Returns a Figure ``width_in``
    inches wide. Raises InputError for anything but the result of :func:`axisight.repeats.compare_days`.
    """
    found = instance("found", found, DayComparison)
    width_in = between("width_in", width_in, 0, _WIDEST_IN)
    table = found.parameters.sel(parameter=_drawn(found))
    n = table.sizes["parameter"]
    columns = min(n, _MOST_COLUMNS)
    rows = -(-n // columns)
    figure = Figure(figsize=(width_in, 0.9 + 1.55 * rows), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for i, axes in enumerate(grid):
        if i < n:
            _draw(axes, table.isel(parameter=i), found)
        else:
            axes.set_visible(False)
    handles, labels = grid[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), frameon=False)
    return figure


def _drawn(found: DayComparison) -> list[str]:
    """Return the parameters to draw: those of axes, and those of the load if one moved."""
    load = found.of_load
    names = [str(name) for name in found.parameters["parameter"].values]
    return names if set(load) & set(found.moved) else [n for n in names if n not in load]


def _draw(axes: Axes, one: xr.Dataset, found: DayComparison) -> None:
    at = np.arange(len(found.days), dtype=np.float64)
    colour = BEFORE if bool(one["moved"].item()) else AFTER
    axes.plot(
        found.day_of_run - 0.12,
        one["run_value"].values,
        "o",
        ms=3,
        mfc="none",
        mec="0.45",
        label="runs",
    )
    mean = one["value"].values
    error = np.array([mean - one["lower"].values, one["upper"].values - mean])
    axes.errorbar(
        at + 0.12,
        mean,
        yerr=np.where(np.isfinite(error), error, 0.0),
        fmt="s",
        ms=4,
        color=colour,
        capsize=3,
        lw=1.2,
        label=f"mean of the day, {100 * (1 - found.level):g} % interval",
    )
    word = "moved" if bool(one["moved"].item()) else ""
    axes.set_title(
        f"{one['parameter'].item()}  {word}", fontsize=8, color=colour if word else "black"
    )
    axes.set_ylabel(str(one["unit"].item()), fontsize=8)
    axes.set_xticks(at, [_short(day) for day in found.days])
    axes.set_xlim(-0.5, len(at) - 0.5)
    axes.yaxis.set_major_locator(MaxNLocator(4))
    axes.tick_params(labelsize=7)
    axes.grid(True, axis="y", lw=0.4, color="0.85")
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def _short(name: str) -> str:
    return name if len(name) <= _LONGEST else "…" + name[-_LONGEST:]
