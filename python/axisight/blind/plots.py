"""Figures of a benchmark's score: confusion matrix and calibration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from axisight.blind.score import Share
from axisight.palette import AFTER, cell_colors


def plot_confusion(score: Mapping[str, Any]) -> Figure:
    """Plot the confusion matrix of a score (`summary`): rows are truths, columns the first named causes.

    The colour of a cell shows the share of its row, its number the count. Returns a Figure.
    """
    rows: Mapping[str, Mapping[str, int]] = score["confusion"]
    truths = list(rows)
    # Truths first, so that right answers stand on the diagonal.
    others = sorted({n for row in rows.values() for n in row} - set(truths))
    names = [*truths, *others]
    figure = Figure(
        figsize=(2.5 + 0.27 * len(names), 2.2 + 0.27 * len(truths)), layout="constrained"
    )
    axes = figure.subplots()
    for i, truth in enumerate(truths):
        total = sum(rows[truth].values())
        for named, count in rows[truth].items():
            j = names.index(named)
            background, ink = cell_colors(count / total, 1.0)
            axes.add_patch(Rectangle((j + 0.03, i + 0.03), 0.94, 0.94, facecolor=background))
            axes.text(j + 0.5, i + 0.5, str(count), ha="center", va="center", color=ink, fontsize=7)
    words = [name.replace("_", " ") for name in names]
    axes.set_xticks(np.arange(len(names)) + 0.5, words, rotation=90, fontsize=7)
    axes.set_yticks(np.arange(len(truths)) + 0.5, words[: len(truths)], fontsize=7)
    axes.set(xlim=(0, len(names)), ylim=(len(truths), 0), xlabel="named first", ylabel="withheld")
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    axes.grid(True, color="0.93", lw=0.5)
    axes.set_axisbelow(True)
    return figure


def plot_calibration(score: Mapping[str, Any]) -> Figure:
    """Plot how often causes were right over their stated probability; returns a Figure.

    Each dot is a tenth of the probability range, with an area for its count and Wilson's interval at 95 %.
    Dots on the line are calibrated.
    """
    figure = Figure(figsize=(4.5, 4.2), layout="constrained")
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], color="0.7", lw=1)
    bins = score["calibration"]["bins"]
    most = max((b["count"] for b in bins), default=1)
    for b in bins:
        at = b["probability"], b["right"]
        axes.plot(
            [at[0]] * 2, Share(round(at[1] * b["count"]), b["count"]).interval(), color=AFTER, lw=1
        )
        axes.scatter(*at, s=12 + 90 * b["count"] / most, color=AFTER, zorder=3)
        axes.annotate(str(b["count"]), at, (7, -3), textcoords="offset points", fontsize=7)
    error = score["calibration"]["error"]
    if error is not None:
        axes.set_title(f"expected calibration error {error:.3f}", fontsize=10)
    axes.set(
        xlim=(-0.03, 1.04),
        ylim=(-0.03, 1.04),
        xlabel="probability said [1]",
        ylabel="share that was right [1]",
    )
    axes.spines[["top", "right"]].set_visible(False)
    return figure
