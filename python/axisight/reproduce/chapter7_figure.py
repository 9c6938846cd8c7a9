"""Figures and tables of 3 x 3 frequency responses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, MultipleLocator, NullFormatter, StrMethodFormatter
from numpy.typing import NDArray

from axisight.palette import AFTER, BEFORE

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

REFERENCE = "#b0b0b0"
UNIT = "rad s$^{-2}$/Nm"


@dataclass(frozen=True)
class Curve:
    """One or several responses under one label, (n_freq, 3, 3) or (n, n_freq, 3, 3)."""

    label: str
    frequency_hz: Real
    response: Complex
    color: str = AFTER
    width: float = 0.8
    marker: str = ""


def reference(frequency_hz: Real, response: Complex) -> Curve:
    """Return the response of the machine without dry friction, to be drawn below the others."""
    return Curve("without dry friction", frequency_hz, response, REFERENCE, 2.2)


def thin(label: str, frequency_hz: Real, response: Complex) -> Curve:
    """Return a curve as the thesis draws thin."""
    return Curve(label, frequency_hz, response, AFTER, 0.7)


def thick(label: str, frequency_hz: Real, response: Complex) -> Curve:
    """Return a curve as the thesis draws thick."""
    return Curve(label, frequency_hz, response, BEFORE, 1.1)


def matrix_figure(curves: Sequence[Curve]) -> Figure:
    """Return magnitudes of all elements, output down and input across, on common axes."""
    figure = Figure(figsize=(7.1, 5.9), layout="constrained")
    grid = figure.subplots(3, 3, sharex=True, sharey=True)
    for i in range(3):
        for j in range(3):
            axes = grid[i, j]
            _draw(axes, curves, i, j)
            axes.set_yticks([0.1, 1, 10, 100, 1000])
            axes.set_xlim(1, 40)
            axes.set_ylim(0.05, 4000)
            axes.text(
                0.04, 0.95, f"({i + 1},{j + 1})", transform=axes.transAxes, va="top", fontsize=8
            )
    for axes in grid[-1]:
        axes.set_xlabel("frequency [Hz]", fontsize=8)
    for axes in grid[:, 0]:
        axes.set_ylabel(f"magnitude [{UNIT}]", fontsize=8)
    _legend(figure, grid[0, 0])
    return figure


def zoom_figure(
    curves: Sequence[Curve], windows: Mapping[tuple[int, int], tuple[float, float]]
) -> Figure:
    """Return magnitudes of some elements (from 1) within windows [Hz], side by side."""
    figure = Figure(figsize=(3.54 * len(windows), 2.9), layout="constrained")
    grid = figure.subplots(1, len(windows), squeeze=False)[0]
    for axes, ((i, j), (low, high)) in zip(grid, windows.items(), strict=True):
        _draw(axes, curves, i - 1, j - 1)
        inside = [
            np.abs(
                c.response[..., (c.frequency_hz >= low) & (c.frequency_hz <= high), i - 1, j - 1]
            )
            for c in curves
        ]
        axes.set_xscale("linear")
        axes.set_xlim(low, high)
        axes.xaxis.set_major_locator(MultipleLocator(1))
        axes.set_ylim(0.8 * min(m.min() for m in inside), 1.25 * max(m.max() for m in inside))
        axes.set_title(f"({i},{j})", fontsize=8)
        axes.set_xlabel("frequency [Hz]", fontsize=8)
    grid[0].set_ylabel(f"magnitude [{UNIT}]", fontsize=8)
    _legend(figure, grid[0])
    return figure


def _draw(axes: Axes, curves: Sequence[Curve], i: int, j: int) -> None:
    for curve in curves:
        several = curve.response if curve.response.ndim == 4 else curve.response[None]
        for k, response in enumerate(several):
            axes.plot(
                curve.frequency_hz,
                np.abs(response[:, i, j]),
                color=curve.color,
                lw=0 if curve.marker else curve.width,
                marker=curve.marker,
                ms=5,
                mew=0.5,
                mec="white",
                label=curve.label if k == 0 else None,
            )
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.xaxis.set_major_locator(FixedLocator([1, 2, 5, 10, 20, 40]))
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.tick_params(labelsize=7.5)
    axes.grid(color="#e6e6e6", lw=0.5)
    axes.set_axisbelow(True)


def _legend(figure: Figure, axes: Axes) -> None:
    handles, labels = axes.get_legend_handles_labels()
    legend = figure.legend(
        handles,
        labels,
        loc="outside upper center",
        ncols=min(len(labels), 3),
        fontsize=8,
        frameon=False,
    )
    for line in legend.get_lines():
        line.set_linewidth(max(line.get_linewidth(), 1.4) if line.get_linestyle() != "None" else 0)


def response_table(frequency_hz: Real, responses: Mapping[str, Complex]) -> pd.DataFrame:
    """Return a row per line and element: magnitude and phase [deg] of every response.

    A response of axes (n, n_freq, 3, 3) fills columns ``name_1`` to ``name_n``.
    """
    row, output, input_ = np.indices((len(frequency_hz), 3, 3)).reshape(3, -1)
    columns: dict[str, Real | NDArray[np.int64]] = {
        "frequency_hz": frequency_hz[row],
        "output": output + 1,
        "input": input_ + 1,
    }
    for name, response in responses.items():
        several = {name: response}
        if response.ndim == 4:
            several = {f"{name}_{k}": one for k, one in enumerate(response, 1)}
        for label, one in several.items():
            columns[f"{label}_magnitude"] = np.abs(one).ravel()
            columns[f"{label}_phase_deg"] = np.degrees(np.angle(one)).ravel()
    return pd.DataFrame(columns)
