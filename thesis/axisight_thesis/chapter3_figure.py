"""The picture of the claims of chapter 3: predicted and measured bias and variance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from axisight.palette import SERIES
from axisight_thesis.chapter3_loop import LINES, Complex, Real


@dataclass(frozen=True)
class Errors:
    """Measured errors of one method over the lines."""

    label: str
    values: Real


def figure(
    truth: Complex, predicted: Real, bias: list[Errors], expected: Real, variance: list[Errors]
) -> Figure:
    """Return bias (top) and standard deviation (bottom) over frequency, with their predictions.

    ``truth`` is G_0, ``predicted`` the bias by (3.61), and ``expected`` the variance by (3.63), all
    (n_lines,).
    """
    out = Figure(figsize=(6.4, 5.6), layout="constrained")
    top, bottom = out.subplots(2, 1, sharex=True)
    size = np.asarray(np.abs(truth), np.float64)
    _panel(top, size, predicted, "(3.61), (3.62)", bias)
    top.set(ylabel="bias", title="Bias of the methods in closed loop")
    _panel(bottom, size, np.sqrt(expected), "(3.63)", variance)
    bottom.set(
        xlabel="frequency [cycles per sample]",
        ylabel="standard deviation",
        title="Scatter of models of order 30",
    )
    return out


def _panel(axes: Axes, size: Real, predicted: Real, name: str, measured: list[Errors]) -> None:
    axes.semilogy(LINES, size, color="#b4b4b4", lw=2.0, label="$|G_0|$")
    axes.semilogy(LINES, predicted, color=SERIES[4], lw=1.2, ls="--", label=name)
    # Curves of methods that agree lie on each other.
    for color, line, errors in zip(SERIES, ("-", ":", "-."), measured, strict=False):
        axes.semilogy(LINES, errors.values, color=color, lw=1.2, ls=line, label=errors.label)
    axes.grid(True, lw=0.3)
    axes.legend(fontsize=8, ncols=2)
