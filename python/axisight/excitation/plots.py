"""Figures of excitations: in time, over frequency, and how the samples are spread."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from axisight.arguments import Lines, Real, instance
from axisight.excitation.multisine import Multisine
from axisight.excitation.optimal import OptimalSpectrum
from axisight.excitation.references import References
from axisight.excitation.signals import PeriodicSignal
from axisight.palette import AFTER, BEFORE, MEASURED, SERIES

_MANY = 60  # with more lines, stems would cover the panel
_DENSE = 4000  # samples drawn across a panel


def plot_signal(signal: Multisine | PeriodicSignal, *, unit: str = "rad/s") -> Figure:
    """Plot one period, the amplitudes of its lines and the histogram of its samples.

    Excited, snow and detection lines have different colours. The histogram shows the peak and the
    effective rms, whose ratio is the crest factor. ``unit`` is that of the signal. Returns a Figure;
    raises InputError for anything but a signal.
    """
    instance("signal", signal, Multisine, PeriodicSignal)
    figure = Figure(figsize=(7.2, 4.4), layout="constrained")
    panels = figure.subplot_mosaic([["time", "spread"], ["lines", "lines"]], width_ratios=(3, 1))
    top, histogram, below = (panels[name] for name in ("time", "spread", "lines"))
    histogram.sharey(top)
    histogram.tick_params(labelleft=False)
    _time(top, signal, unit)
    _histogram(histogram, signal)
    _spectrum(below, signal, unit)
    _dress([top, histogram, below])
    return figure


def plot_references(references: References) -> Figure:
    """Plot one period, inputs over rows and experiments over columns, and return a Figure."""
    instance("references", references, References)
    rows, columns = references.n_inputs, references.n_experiments
    size = (min(2.4 * columns, 16) + 0.6, min(1.3 * rows, 16) + 0.6)
    figure = Figure(figsize=size, layout="constrained")
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    time = np.arange(references.n_samples) * references.sample_time_s
    step = max(1, references.n_samples // _DENSE)
    for i, row in enumerate(grid):
        for e, axes in enumerate(row):
            axes.plot(time[::step], references.period[e, ::step, i], color=AFTER, lw=0.5)
            axes.yaxis.set_major_locator(MaxNLocator(4))
        row[0].set_ylabel(f"input {i + 1} [{references.unit}]", fontsize=8)
    for e, axes in enumerate(grid[0]):
        axes.set_title(f"experiment {e + 1}", fontsize=8, pad=2)
    for axes in grid[-1]:
        axes.set_xlabel("time [s]", fontsize=8)
    _dress(list(grid.flat))
    return figure


def plot_optimal_spectrum(found: OptimalSpectrum) -> Figure:
    """Plot where an optimal spectrum puts the power, against the flat one, and return a Figure.

    Above: share of the limited power of every line, logarithmic. Below: the dispersion of the
    equivalence theorem, which reaches one where the optimum puts power; empty for responses, which have
    a closed form. Raises InputError for anything but an optimal spectrum.
    """
    instance("found", found, OptimalSpectrum)
    figure = Figure(figsize=(7.2, 4.4), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    frequency = found.lines / found.signal.period_s
    for shares, color, name in (
        (found.flat_shares, BEFORE, "flat"),
        (found.shares, AFTER, "optimal"),
    ):
        shown = shares > 0
        above.semilogy(
            frequency[shown], shares[shown], color=color, lw=0.8, marker="o", ms=2, label=name
        )
    above.set_ylabel("share of the power", fontsize=8)
    above.legend(fontsize=7, frameon=False, loc="upper right")
    above.set_title(f"{found.criterion}, gain {found.gain:.3g}", fontsize=8, pad=2)
    below.plot(frequency, found.dispersion, color=AFTER, lw=0.8)
    below.axhline(1.0, color=MEASURED, lw=0.8, ls="--")
    below.set_ylabel("dispersion", fontsize=8)
    below.set_ylim(0, 1.1)
    below.set_xlabel("frequency [Hz]", fontsize=8)
    _dress([above, below])
    return figure


def _time(axes: Axes, signal: Multisine | PeriodicSignal, unit: str) -> None:
    step = max(1, signal.n_samples // _DENSE)
    time = np.arange(signal.n_samples) * signal.sample_time_s
    axes.plot(time[::step], signal.period[::step], color=AFTER, lw=0.5)
    axes.margins(x=0.01)
    axes.set_xlabel("time [s]", fontsize=8)
    axes.set_ylabel(f"signal [{unit}]", fontsize=8)


def _histogram(axes: Axes, signal: Multisine | PeriodicSignal) -> None:
    axes.hist(signal.period, bins=41, orientation="horizontal", density=True, color="#b7d4ea")
    for value, style, name in ((signal.peak, "-", "peak"), (signal.rms, "--", "rms")):
        axes.axhline(value, color=MEASURED, lw=0.8, ls=style, label=name)
        axes.axhline(-value, color=MEASURED, lw=0.8, ls=style)
    axes.set_title(f"crest factor {signal.crest_factor:.3f}", fontsize=8, pad=2)
    axes.set_xlabel("density", fontsize=8)
    axes.legend(fontsize=7, frameon=False, loc="center right")


def _spectrum(axes: Axes, signal: Multisine | PeriodicSignal, unit: str) -> None:
    nothing = np.empty(0, np.int64)
    amplitude = 2 * np.abs(np.fft.rfft(signal.period)) / signal.n_samples
    excited = signal.lines if signal.lines.size else np.arange(1, (signal.n_samples + 1) // 2)
    free: Lines = getattr(signal, "detection_lines", nothing)
    snow: Lines = getattr(signal, "snow_lines", nothing)
    for lines, color, marker, name in (
        (excited, AFTER, "o", "excited" if signal.lines.size else "all lines"),
        (snow, SERIES[2], "s", "snow"),
        (free, BEFORE, "x", "left free for detection"),
    ):
        if lines.size:
            _stems(axes, lines / signal.period_s, amplitude[lines], color, marker, name)
    shown = np.concatenate([excited, snow, free])
    last = shown.max()
    axes.set_xlim(0, 1.05 * last / signal.period_s)
    axes.set_ylim(bottom=-0.04 * amplitude.max(), top=1.3 * amplitude.max())
    axes.set_xlabel("frequency [Hz]", fontsize=8)
    axes.set_ylabel(f"amplitude [{unit}]", fontsize=8)
    axes.legend(fontsize=7, frameon=False, ncols=3, loc="upper right")


def _stems(
    axes: Axes, frequency_hz: Real, amplitude: Real, color: str, marker: str, name: str
) -> None:
    if len(frequency_hz) <= _MANY:
        axes.vlines(frequency_hz, 0, amplitude, color=color, lw=0.6)
    size = 3.5 if len(frequency_hz) <= _MANY else 1.8
    style = {"ls": "none", "ms": size, "mew": 0.8 if marker == "x" else 0}
    axes.plot(frequency_hz, amplitude, marker=marker, color=color, label=name, **style)  # type: ignore[arg-type]


def _dress(panels: list[Axes]) -> None:
    for axes in panels:
        axes.grid(True, color="#e4e4e4", lw=0.5)
        axes.set_axisbelow(True)
        axes.tick_params(labelsize=7)
        axes.spines[["top", "right"]].set_visible(False)
