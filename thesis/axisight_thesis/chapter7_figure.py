"""Figures and tables of 3 x 3 frequency responses in chapter 7."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatter, MultipleLocator
from numpy.typing import NDArray

from axisight.palette import AFTER, BEFORE, MEASURED
from axisight_thesis.element_plot import Curve, element_figure, element_table

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

LABEL = "magnitude [rad s$^{-2}$/Nm]"
# Common limits, in which all responses of the chapter fit, make the figures comparable.
_LIMITS = (0.02, 8000.0)

_REFERENCE: dict[str, object] = {"color": "#b4b4b4", "lw": 2.2}
_THIN: dict[str, object] = {"color": AFTER, "lw": 0.7}
_THICK: dict[str, object] = {"color": BEFORE, "lw": 1.1}
_SEVERAL: dict[str, object] = {"color": AFTER, "lw": 0.45}
_MARKERS: dict[str, object] = {
    "color": MEASURED,
    "ls": "none",
    "marker": "D",
    "ms": 4.5,
    "mec": "white",
    "mew": 0.5,
}


def reference(frequency_hz: Real, response: Complex) -> Curve:
    """Return the curve of the machine without dry friction, which is drawn below the others."""
    return Curve(frequency_hz, np.abs(response), "without dry friction", _REFERENCE)


def thin(label: str, frequency_hz: Real, response: Complex) -> Curve:
    """Return a response that the thesis draws thin, (n_freq, 3, 3)."""
    return Curve(frequency_hz, np.abs(response), label, _THIN)


def thick(label: str, frequency_hz: Real, response: Complex) -> Curve:
    """Return a response that the thesis draws thick, (n_freq, 3, 3)."""
    return Curve(frequency_hz, np.abs(response), label, _THICK)


def markers(label: str, frequency_hz: Real, response: Complex) -> Curve:
    """Return values at single frequencies, (n_freq, 3, 3)."""
    return Curve(frequency_hz, np.abs(response), label, _MARKERS)


def several(label: str, frequency_hz: Real, responses: Complex) -> list[Curve]:
    """Return responses of equal rank under one label, (n, n_freq, 3, 3)."""
    labels = [label, *(f"_{label}" for _ in responses[1:])]
    return [
        Curve(frequency_hz, np.abs(one), text, _SEVERAL)
        for one, text in zip(responses, labels, strict=True)
    ]


def matrix_figure(curves: Sequence[Curve]) -> Figure:
    """Return magnitudes of all elements, output down and input across, on common axes."""
    return element_figure(curves, LABEL, ylim=_LIMITS)


def zoom_figure(
    curves: Sequence[Curve], windows: Mapping[tuple[int, int], tuple[float, float]]
) -> Figure:
    """Return magnitudes of some elements (from 1) within windows [Hz], side by side."""
    figure = Figure(figsize=(7.2, 2.9), layout="constrained")
    grid = figure.subplots(1, len(windows), squeeze=False, sharey=True)[0]
    for axes, ((i, j), (low, high)) in zip(grid, windows.items(), strict=True):
        for curve in curves:
            near = (curve.frequency_hz >= low) & (curve.frequency_hz <= high)
            values = curve.values[near, i - 1, j - 1]
            axes.plot(curve.frequency_hz[near], values, label=curve.label, **curve.style)
        axes.set_yscale("log")
        axes.set_xlim(low, high)
        axes.xaxis.set_major_locator(MultipleLocator(1))
        axes.yaxis.set_major_formatter(LogFormatter())
        axes.grid(True, color="#e4e4e4", lw=0.5)
        axes.set_axisbelow(True)
        axes.tick_params(labelsize=7)
        axes.spines[["top", "right"]].set_visible(False)
        axes.set_title(f"({i},{j})", fontsize=8, pad=2)
        axes.set_xlabel("frequency [Hz]", fontsize=8)
    grid[0].set_ylabel(LABEL, fontsize=8)
    handles, labels = grid[0].get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside upper center", ncols=len(labels), fontsize=8, frameon=False
    )
    return figure


def response_table(frequency_hz: Real, responses: Mapping[str, Complex]) -> pd.DataFrame:
    """Return magnitude and phase [deg] of every response, a column per element.

    A response of axes (n, n_freq, 3, 3) is numbered from ``name1``.
    """
    columns = {}
    for name, response in responses.items():
        single = {name: response}
        if response.ndim == 4:
            single = {f"{name}{k}": one for k, one in enumerate(response, 1)}
        for label, one in single.items():
            columns[label] = frequency_hz, np.abs(one)
            columns[f"{label}_phase_deg"] = frequency_hz, np.degrees(np.angle(one))
    return element_table(**columns)
