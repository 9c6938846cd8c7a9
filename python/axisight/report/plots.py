"""Figures of logs, simulations and diagnoses; every function returns a matplotlib Figure."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from axisight.arguments import one_of
from axisight.errors import InputError
from axisight.gap.facts.axis_names import axis_label
from axisight.gap.facts.result import Diagnosis, Overlay
from axisight.logs import Log
from axisight.palette import AFTER, BEFORE, MEASURED, cell_colors
from axisight.report.wording import (
    GapMap,
    after_words,
    filter_words,
    gap_maps,
    number,
    percent,
    ranked,
    share_limit,
    title_of,
    torque_unit,
    torque_word,
)
from axisight.robot.axis_names import axis_number


def _panels(
    rows: int, columns: int, *, width: float = 10.0, height: float = 2.2
) -> tuple[Figure, list[list[Axes]]]:
    figure = Figure(figsize=(width, height * rows), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False, sharex="col")
    return figure, [list(row) for row in grid]


def plot_log(log: Log) -> Figure:
    """Plot torque and position of every axis of a log over time; returns a Figure."""
    figure, grid = _panels(log.n_axes, 2)
    units = [("N", "m") if kind == "prismatic" else ("Nm", "rad") for kind in log.axis_kinds]
    for i, (left, right) in enumerate(grid):
        left.plot(log.time_s, log.torque_nm[:, i], color=MEASURED, lw=0.7)
        right.plot(log.time_s, log.position_rad[:, i], color=MEASURED, lw=0.7)
        left.set_ylabel(f"torque {i + 1} [{units[i][0]}]")
        right.set_ylabel(f"position {i + 1} [{units[i][1]}]")
    for axes in grid[-1]:
        axes.set_xlabel("time [s]")
    figure.suptitle(log.name)
    return figure


def plot_simulation(run: xr.Dataset) -> Figure:
    """Plot commanded torque and measured position of a simulation; returns a Figure.

    ``run`` is the Dataset of `axisight.simulate`. Raises InputError if a variable is missing.
    """
    for name in ("torque_cmd_nm", "position_rad"):
        if name not in run:
            raise InputError(f"run: expected variable {name!r}, got {', '.join(map(str, run))}")
    time = run["time"].values
    figure, grid = _panels(run.sizes["axis"], 2)
    for i, (left, right) in enumerate(grid):
        axis = int(run["axis"].values[i])
        left.plot(time, run["torque_cmd_nm"].values[:, i], color=AFTER, lw=0.7)
        right.plot(time, run["position_rad"].values[:, i], color=AFTER, lw=0.7)
        left.set_ylabel(f"torque {axis} [Nm]")
        right.set_ylabel(f"position {axis} [rad]")
    for axes in grid[-1]:
        axes.set_xlabel("time [s]")
    return figure


def plot_gap_map(diagnosis: Diagnosis) -> Figure:
    """Plot the share of the gap by axis, in frequency bands and regimes; returns a Figure.

    Grey cells are not significant, or belong to an axis without a gap.
    """
    maps = gap_maps(diagnosis)
    rows = 1 + (len(maps)) // 2
    n_axes = diagnosis.band_map.sizes["axis"]
    figure = Figure(figsize=(11, rows * (0.9 + 0.36 * n_axes)), layout="constrained")
    grid = figure.add_gridspec(rows, 2)
    limit = share_limit(maps)
    for k, item in enumerate(maps):
        cell = grid[0, :] if k == 0 else grid[1 + (k - 1) // 2, (k - 1) % 2]
        _draw_map(figure.add_subplot(cell), item, limit)
    figure.suptitle("Share of the gap above the floor, per axis [%]")
    return figure


def _draw_map(axes: Axes, item: GapMap, limit: float) -> None:
    n_axes, n_cells = item.share.shape
    for i in range(n_axes):
        for j in range(n_cells):
            share = float(item.share[i, j]) if item.significant[i, j] else float("nan")
            background, ink = cell_colors(share, limit)
            axes.add_patch(_cell(i, j, background))
            text = f"{100 * item.share[i, j]:.0f}" if np.isfinite(item.share[i, j]) else "-"
            axes.text(j + 0.5, i + 0.5, text, ha="center", va="center", color=ink, fontsize=9)
    axes.set(xlim=(0, n_cells), ylim=(n_axes, 0), title=item.title)
    axes.set_xticks(np.arange(n_cells) + 0.5, item.columns, fontsize=8)
    axes.set_yticks(np.arange(n_axes) + 0.5, [f"axis {a}" for a in item.axes], fontsize=8)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)


def _cell(row: int, column: int, color: str) -> Rectangle:
    return Rectangle((column + 0.02, row + 0.04), 0.96, 0.92, facecolor=color)


def plot_ranking(diagnosis: Diagnosis, count: int = 10) -> Figure:
    """Plot the probabilities of the ``count`` most probable candidates; returns a Figure."""
    best = ranked(diagnosis)[:count]
    figure = Figure(figsize=(8, 0.9 + 0.32 * max(len(best), 1)), layout="constrained")
    axes = figure.subplots()
    names = [title_of(c) for c in best]
    values = [100 * c.probability for c in best]
    bars = axes.barh(names, values, color=AFTER)
    axes.bar_label(bars, [f"{v:.1f}" for v in values], padding=3, fontsize=8)
    axes.invert_yaxis()
    axes.set(xlim=(0, 110), xlabel="probability [%]")
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def plot_overlay(
    diagnosis: Diagnosis, log: str | None = None, axis: int | str | None = None
) -> Figure:
    """Plot measured torque and the simulator before and after, on a validation log; returns a Figure.

    ``log`` and ``axis`` choose the data; ``axis`` is a number from 1 or a joint name. The default is the
    first log and the axis of the first cause. All curves passed the same filter, which the title states. The
    rms errors in the legend are those of the gap. Raises InputError for a log or an axis that the diagnosis
    does not have.
    """
    item = _chosen(diagnosis, log, axis)
    unit = torque_unit(diagnosis, item.axis)
    curves, errors, rms = item.curves_nm, item.errors_nm, item.rms_nm
    word = torque_word(unit)
    unit = "Nm or N" if ";" in unit else unit.partition(",")[0]
    said = [
        f"rms {number(x, 2)} {unit}, gap {percent(gap)}"
        for x, gap in zip(rms, (item.gap_before, item.gap_after), strict=True)
    ]
    figure = Figure(figsize=(10, 4.5), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    names = ("measured", "before, simulator as given", after_words(diagnosis))
    for values, color, name in zip(curves, (MEASURED, BEFORE, AFTER), names, strict=True):
        top.plot(item.time_s, values, color=color, lw=0.8, label=name)
    bottom.plot(item.time_s, errors[0], color=BEFORE, lw=0.8, label=f"before, {said[0]}")
    bottom.plot(item.time_s, errors[1], color=AFTER, lw=0.8, label=f"after, {said[1]}")
    top.set_ylabel(f"{word} [{unit}]")
    bottom.set(xlabel="time [s]", ylabel=f"error [{unit}]")
    axis_name = f"axis {axis_label(item.axis, diagnosis.joints)}"
    filtered = filter_words(diagnosis.gap.compared, item.lowpass_hz)
    # Names come from users; a dollar sign would start a formula.
    figure.suptitle(f"{item.log}, {axis_name}\n{filtered}", fontsize=10, parse_math=False)
    for panel in (top, bottom):
        # Above the panel, where it hides no curve.
        panel.legend(
            loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, fontsize=8, frameon=False
        )
    return figure


def _chosen(diagnosis: Diagnosis, log: str | None, axis: int | str | None) -> Overlay:
    logs = list(dict.fromkeys(o.log for o in diagnosis.overlays))
    axes = sorted({o.axis for o in diagnosis.overlays})
    if not logs:
        raise InputError("diagnosis: expected overlays, got none")
    named = next((c.axis for c in diagnosis.causes if c.axis is not None), axes[0])
    log, axis = log or logs[0], named if axis is None else axis
    one_of("log", log, logs)
    axis = axis_number(axis, diagnosis.joints or max(axes))
    if axis not in axes:
        raise InputError(f"axis: expected one of {', '.join(map(str, axes))}, got {axis}")
    return next(o for o in diagnosis.overlays if o.log == log and o.axis == axis)
