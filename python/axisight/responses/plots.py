"""Plot a response with the levels of its noise and distortion."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullFormatter

from axisight.arguments import Real, between
from axisight.frf.response import estimate_of
from axisight.palette import SERIES

_WIDEST_IN = 100
_LABELS = ("response", "noise", "noise and distortion")


def plot_levels(response: xr.Dataset, *, width_in: float = 7.2) -> Figure:
    """Plot the magnitude of every element with the standard deviations of noise and of the estimate.

    ``response`` is a Dataset of :func:`axisight.frf.frequency_response`; outputs are rows, inputs are columns.
    The standard deviation of the estimate holds noise and, if several realizations or free lines show it,
    distortion. Crosses at the bottom mark lines without an estimate. Returns a Figure ``width_in`` inches wide.
    Raises InputError for another Dataset.
    """
    estimate_of("response", response)
    width_in = between("width_in", width_in, 0, _WIDEST_IN)
    outputs, inputs = response["output"].values, response["input"].values
    height = width_in * (0.28 * len(outputs) + 0.16)
    figure = Figure(figsize=(width_in, height), layout="constrained")
    grid = figure.subplots(len(outputs), len(inputs), sharex=True, sharey=True, squeeze=False)
    for i, output in enumerate(outputs):
        for j, input_ in enumerate(inputs):
            _draw(grid[i, j], response.isel(output=i, input=j))
            if i == 0:
                grid[i, j].set_title(f"torque of axis {input_}", fontsize=9)
        grid[i, 0].set_ylabel(f"motion of axis {output}", fontsize=9)
    for axes in grid[-1]:
        axes.set_xlabel("frequency [Hz]", fontsize=9)
    _range(grid[0, 0], response)
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), frameon=False)
    figure.supylabel(f"magnitude [{response['response'].attrs.get('units', '')}]", fontsize=9)
    return figure


def _draw(axes: Axes, element: xr.Dataset) -> None:
    frequency = element["frequency_hz"].values
    size = np.abs(element["response"].values)
    noise = element["noise_variance"].values if "noise_variance" in element else None
    total = element["variance"].values
    axes.plot(frequency, size, color=SERIES[0], lw=1.2, label=_LABELS[0])
    if noise is not None and np.isfinite(noise).any():
        axes.plot(frequency, np.sqrt(noise), "--", color=SERIES[1], lw=0.9, label=_LABELS[1])
    same = noise is not None and np.array_equal(noise, total, equal_nan=True)
    if np.isfinite(total).any() and not same:
        axes.plot(frequency, np.sqrt(total), ":", color=SERIES[2], lw=1.1, label=_LABELS[2])
    lost = ~np.isfinite(size)
    if lost.any():
        axes.plot(
            frequency[lost], np.full(lost.sum(), 0.03), "x", color=SERIES[0], ms=3, transform=axes.get_xaxis_transform()
        )  # fmt: skip
    axes.grid(True, which="major", lw=0.4, color="0.85")
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(labelsize=8)


def _range(axes: Axes, response: xr.Dataset) -> None:
    """Set logarithmic axes: frequencies of the response, magnitudes from the noise to the response."""
    frequency = response["frequency_hz"].values
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(frequency[0] / 1.03, frequency[-1] * 1.03)
    ticks = [m * 10.0**e for e in range(-6, 7) for m in (1, 2, 5)]
    axes.xaxis.set_major_locator(
        FixedLocator([t for t in ticks if frequency[0] / 1.03 <= t <= frequency[-1] * 1.03])
    )
    axes.xaxis.set_major_formatter(lambda x, _: f"{x:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())
    size = np.abs(response["response"].values)
    levels: list[Real] = [size]
    for name in ("variance", "noise_variance"):
        if name in response:
            levels.append(np.sqrt(response[name].values))
    known = [x[np.isfinite(x) & (x > 0)] for x in levels]
    low = min((float(np.percentile(x, 2)) for x in known if x.size), default=1e-3)
    high = max((float(x.max()) for x in known[:1] if x.size), default=1.0)
    axes.set_ylim(low / 2, high * 2)
