"""Example 5.1 and Figure 5.1: a transient of a first-order system, exactly.

The thesis prints y' = y + u, which is unstable and has no steady state. Its figure is that of
y' = -y + u, which is used here.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from axisight.palette import SERIES
from axisight_thesis.context import Context
from axisight_thesis.item import Claim, Item, item

Real = NDArray[np.float64]

SAMPLES = 100
"""Samples per period of 1 s."""
PERIODS = 5
OMEGA = 2 * np.pi
TIME_CONSTANT_S = 1.0


def outputs(periods: int = PERIODS) -> tuple[Real, Real, Real]:
    """Return time [s], output from rest, and steady-state response to sin(2 pi t)."""
    t = np.arange(periods * SAMPLES) / SAMPLES
    gain = 1 / (1 + 1j * OMEGA)
    steady = np.imag(gain * np.exp(1j * OMEGA * t))
    return t, steady - np.imag(gain) * np.exp(-t / TIME_CONSTANT_S), steady


def spectra(output: Real) -> Real:
    """Return the magnitude of the DFT of each period, (period, line), scaled to amplitudes."""
    whole = output.reshape(-1, SAMPLES)
    return np.asarray(np.abs(np.fft.rfft(whole, axis=1)) * 2 / SAMPLES)


def outside(output: Real) -> Real:
    """Return the share of the output's rms that is not at 1 Hz, by period."""
    lines = spectra(output)
    lines[:, 0] /= np.sqrt(2)  # a mean counts once, a sinusoid half
    total = np.sum(lines**2, axis=1)
    others = np.sum(np.delete(lines, 1, axis=1) ** 2, axis=1)
    return np.asarray(np.sqrt(others / total))


@item("figure-5.1")
def figure_5_1(context: Context) -> Item:
    """Return Figure 5.1 with its statements."""
    t, output, steady = outputs()
    lines = spectra(output)
    table = pd.DataFrame({"time_s": t, "output": output, "steady_state": steady})
    spectrum = pd.DataFrame(
        {"frequency_hz": np.arange(lines.shape[1], dtype=np.float64)}
        | {f"period_{k}": row for k, row in enumerate(lines, 1)}
    )
    return Item(
        "figure-5.1",
        "A transient: output and its spectrum by period",
        {"": table, "spectrum": spectrum},
        {"": _figure(t, output, steady, lines)},
        _claims(output, steady),
    )


def _claims(output: Real, steady: Real) -> tuple[Claim, ...]:
    rms = np.sqrt(np.mean(steady**2))
    apart = np.sqrt(np.mean((output - steady).reshape(PERIODS, -1) ** 2, axis=1)) / rms
    share = outside(output)
    late = outside(outputs(20)[1])[-1]
    return (
        Claim(
            "5.6-first-periods",
            "5.6",
            "The output differs much from the steady-state response in the first periods.",
            bool(apart[0] > 0.5),
            "distance from the steady state, periods 1 to 5: "
            + ", ".join(f"{100 * a:.0f} %" for a in apart)
            + " of its rms, with y' = -y + u (the printed y' = y + u is unstable)",
        ),
        Claim(
            "5.6-one-line",
            "5.6",
            "In steady state there is output power at 1 Hz only.",
            bool(late < 1e-6),
            f"share of the rms at other lines: {100 * share[0]:.0f} % in period 1, "
            f"{100 * share[-1]:.1f} % in period 5, {late:.0e} in period 20",
        ),
    )


def _figure(t: Real, output: Real, steady: Real, lines: Real) -> Figure:
    figure = Figure(figsize=(6.4, 5.0), layout="constrained")
    top, bottom = figure.subplots(2, 1)
    top.plot(t, output, color=SERIES[0], lw=1.2, label="output")
    top.plot(t, steady, color=SERIES[4], lw=1.0, ls=":", label="steady state")
    top.set(xlabel="time [s]", ylabel="output", xlim=(0, PERIODS))
    top.legend(loc="upper right", ncols=2, fontsize=8)
    shown = slice(0, 31)
    frequency = np.arange(lines.shape[1])[shown]
    for k, row in enumerate(lines, 1):
        shade = 1 - 0.16 * (k - 1)
        bottom.semilogy(
            frequency, row[shown], ".-", color=SERIES[0], alpha=shade, lw=0.9, ms=4, label=f"{k}"
        )
    bottom.set(xlabel="frequency [Hz]", ylabel="amplitude", xlim=(0, 30))
    bottom.legend(title="period", ncols=5, fontsize=8, title_fontsize=8)
    for axes in (top, bottom):
        axes.grid(True, lw=0.3)
    return figure
