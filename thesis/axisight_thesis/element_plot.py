"""Figures with one panel per element of a 3 x 3 matrix over frequency."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, MultipleLocator, NullLocator
from numpy.typing import NDArray

from axisight.palette import AFTER, BEFORE, MEASURED

Real = NDArray[np.float64]

TRUE = {"color": MEASURED, "lw": 1.6, "alpha": 0.9}
ESTIMATE = {"color": AFTER, "lw": 0.7}
DISTURBANCE = {"color": BEFORE, "lw": 0.7}
SINGLE = {"color": BEFORE, "ls": "none", "marker": "D", "ms": 5, "mec": "white", "mew": 0.5}
FAINT = {"color": AFTER, "lw": 0.4, "alpha": 0.6}
MEAN = {"color": MEASURED, "lw": 0.6}
MARKED = {"color": BEFORE, "ls": "none", "marker": "o", "ms": 1.8, "mew": 0}


@dataclass(frozen=True)
class Curve:
    """Values (n_freq, n_rows, n_columns) over ``frequency_hz`` with a label and a style."""

    frequency_hz: Real
    values: Real
    label: str
    style: dict[str, object]


def element_figure(
    curves: Sequence[Curve],
    ylabel: str,
    *,
    ylim: tuple[float, float] | None = None,
    log: bool = True,
    every: float | None = None,
) -> Figure:
    """Return a Figure of elements, with outputs or channels over rows, inputs or experiments over columns.

    All panels share both axes, so that elements can be compared by eye. ``every`` is the step
    of the vertical ticks.
    """
    n_rows, n_columns = curves[0].values.shape[1:]
    figure = Figure(figsize=(7.2, 5.4), layout="constrained")
    grid = figure.subplots(n_rows, n_columns, sharex=True, sharey=True, squeeze=False)
    for i in range(n_rows):
        for j in range(n_columns):
            _panel(grid[i, j], curves, i, j, log)
    _frequency_axis(grid[0, 0], curves[0].frequency_hz)
    if every is not None:
        grid[0, 0].yaxis.set_major_locator(MultipleLocator(every))
    # Minor ticks are not needed over several decades, and take most of the time of drawing.
    grid[0, 0].yaxis.set_minor_locator(NullLocator())
    if ylim is not None:
        grid[0, 0].set_ylim(*ylim)
    for axes in grid[:, 0]:
        axes.set_ylabel(ylabel, fontsize=8)
    for axes in grid[-1]:
        axes.set_xlabel("frequency [Hz]", fontsize=8)
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside upper center", ncols=len(labels), fontsize=8, frameon=False
    )
    return figure


def element_table(**columns: tuple[Real, Real]) -> pd.DataFrame:
    """Return curves as a table: ``frequency_hz`` and one column per curve and element.

    Each curve is (frequency_hz, values); columns are called ``name_11``, ``name_12``, ... Curves at
    other frequencies than those of the first are empty at the frequencies that they lack.
    """
    tables = []
    for name, (frequency, values) in columns.items():
        rows, across = values.shape[1:]
        table = pd.DataFrame({"frequency_hz": np.round(frequency, 9)})
        for i in range(rows):
            for j in range(across):
                table[f"{name}_{i + 1}{j + 1}"] = values[:, i, j]
        tables.append(table.set_index("frequency_hz"))
    return pd.concat(tables, axis=1).sort_index().reset_index()


def decibel(power: Real) -> Real:
    """Return 10 log10 of a power."""
    return np.asarray(10 * np.log10(power))


def _panel(axes: Axes, curves: Sequence[Curve], i: int, j: int, log: bool) -> None:
    for curve in curves:
        axes.plot(curve.frequency_hz, curve.values[:, i, j], label=curve.label, **curve.style)  # type: ignore[arg-type]
    axes.set_xscale("log")
    if log:
        axes.set_yscale("log")
    axes.grid(True, color="#e4e4e4", lw=0.5)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=7)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_title(f"({i + 1},{j + 1})", fontsize=8, pad=2)


def _frequency_axis(axes: Axes, frequency: Real) -> None:
    axes.set_xlim(frequency.min() / 1.05, frequency.max() * 1.05)
    axes.xaxis.set_major_locator(FixedLocator([1, 2, 5, 10, 20, 40, 100]))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda f, _: f"{f:g}"))
    axes.xaxis.set_minor_locator(NullLocator())
