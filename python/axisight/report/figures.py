"""The interactive figures of the report, as plotly JSON that is safe inside a page."""

from __future__ import annotations

import html
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.io.json import to_json_plotly
from plotly.subplots import make_subplots

from axisight.gap.result import Diagnosis, Overlay
from axisight.palette import AFTER, BEFORE, MEASURED
from axisight.report.wording import (
    after_words,
    percent,
    probability,
    ranked,
    shortened,
    standard_errors,
    title_of,
    torque_unit,
    torque_word,
)

Floats = NDArray[np.float64]

TOP = 10
MAX_OVERLAYS = 150
_POINTS_PER_REPORT = 40_000
_POINTS_PER_OVERLAY = 4_000
_LEAST_POINTS = 200


_FONT = 'system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif'
_GRID = "#e6e6e6"


def ranking_figure(diagnosis: Diagnosis) -> go.Figure:
    """Horizontal bars of the most probable candidates, probability in per cent."""
    top = ranked(diagnosis)[:TOP]
    values = [100 * c.probability if np.isfinite(c.probability) else 0.0 for c in top]
    hover = [
        f"<b>{_safe(shortened(title_of(c), 80))}</b><br>probability {_safe(probability(c.probability))}"
        f"<br>held-out score {_safe(percent(c.score))}"
        f"<br>significance {_safe(standard_errors(c.significance))} standard errors"
        f"<br>{_safe(shortened(c.status, 80))}"
        for c in top
    ]
    figure = go.Figure(
        go.Bar(
            x=values,
            y=list(range(len(top))),
            orientation="h",
            marker={"color": AFTER},
            width=0.62,
            text=[_safe(probability(c.probability)) for c in top],
            textposition="outside",
            cliponaxis=False,
            hovertext=hover,
            hoverinfo="text",
        )
    )
    figure.update_layout(
        **_layout(height=70 + 30 * len(top)),
        showlegend=False,
        margin={"l": 10, "r": 20, "t": 8, "b": 48},
    )
    figure.update_xaxes(title="probability (%)", range=[0, 112], tickvals=[0, 20, 40, 60, 80, 100])
    figure.update_yaxes(
        tickvals=list(range(len(top))),
        ticktext=[_safe(shortened(title_of(c))) + "  " for c in top],
        range=[len(top) - 0.4, -0.6],
        showgrid=False,
        automargin=True,
    )
    return figure


def overlay_figure(diagnosis: Diagnosis, overlay: Overlay, points: int) -> go.Figure:
    """Measured and simulated torque over time, and below it what the simulations miss."""
    unit = torque_unit(diagnosis, overlay.axis)
    hover_unit = "" if ";" in unit else f" {unit}"
    after = after_words(diagnosis)
    figure = make_subplots(
        rows=2, cols=1, shared_xaxes=True, row_heights=[0.62, 0.38], vertical_spacing=0.07
    )
    lines = (
        (1, "measured", MEASURED, 1.6, overlay.measured_nm),
        (1, "before, simulator as given", BEFORE, 1.2, overlay.before_nm),
        (1, after, AFTER, 1.2, overlay.after_nm),
        (2, "before", BEFORE, 1.0, overlay.before_nm - overlay.measured_nm),
        (2, "after", AFTER, 1.0, overlay.after_nm - overlay.measured_nm),
    )
    for row, name, color, width, values in lines:
        time_s, kept = thin(overlay.time_s, values, points)
        figure.add_scatter(
            x=time_s.astype(np.float32),
            y=kept.astype(np.float32),
            mode="lines",
            name=_safe(name),
            line={"color": color, "width": width},
            showlegend=row == 1,
            hovertemplate=f"%{{y:.4g}}{hover_unit}<extra>{_safe(name)}</extra>",
            row=row,
            col=1,
        )
    figure.update_layout(
        **_layout(height=460),
        hovermode="x",
        legend={"orientation": "h", "x": 0, "y": 1.02, "yanchor": "bottom"},
        margin={"l": 70, "r": 16, "t": 36, "b": 48},
    )
    figure.update_xaxes(title="time (s)", row=2, col=1)
    figure.update_yaxes(title=f"{torque_word(unit)} ({unit})", title_standoff=8, row=1, col=1)
    figure.update_yaxes(title=f"error ({unit})", title_standoff=8, row=2, col=1)
    return figure


def overlay_items(diagnosis: Diagnosis) -> tuple[list[str], list[dict[str, Any]], int]:
    """Log names, figures as ``{"log": index, "axis": axis, "figure": ...}``, and how many were left out.

    The points of each figure are thinned so that all of them fit in a few megabytes.
    """
    shown = diagnosis.overlays[:MAX_OVERLAYS]
    logs = list(dict.fromkeys(overlay.log for overlay in shown))
    points = points_per_overlay(len(shown))
    items = [
        {
            "log": logs.index(overlay.log),
            "axis": overlay.axis,
            "figure": overlay_figure(diagnosis, overlay, points).to_plotly_json(),
        }
        for overlay in shown
    ]
    return logs, items, len(diagnosis.overlays) - len(shown)


def points_per_overlay(n_overlays: int) -> int:
    """Points each line of an overlay may keep when there are ``n_overlays`` of them."""
    share = _POINTS_PER_REPORT // max(1, n_overlays)
    return int(min(_POINTS_PER_OVERLAY, max(_LEAST_POINTS, share)))


def first_overlay(diagnosis: Diagnosis) -> int:
    """Index of the overlay to open with: the axis with the largest place or cause, else the first."""
    axes: Sequence[int | None] = [c.axis for c in diagnosis.causes] + [
        w.axis for w in sorted(diagnosis.where, key=lambda w: -w.share)
    ]
    shown = [overlay.axis for overlay in diagnosis.overlays[:MAX_OVERLAYS]]
    return next((shown.index(axis) for axis in axes if axis in shown), 0)


def thin(time_s: Floats, values: Floats, points: int) -> tuple[Floats, Floats]:
    """Keep about ``points`` samples: the least and the largest of each stretch, so no peak is lost.

    ``time_s`` and ``values`` have shape (n,); both results have the same shape (m,), m <= points
    when n is larger, in time order. A stretch without finite values keeps one NaN as a gap.
    """
    n = values.size
    if n <= points:
        return time_s, values
    edges = np.linspace(0, n, points // 2 + 1).astype(int)
    keep: list[int] = []
    for start, stop in pairwise(edges):
        part = values[start:stop]
        finite = np.isfinite(part)
        if not finite.any():
            keep.append(int(start))
            continue
        low = start + int(np.argmin(np.where(finite, part, np.inf)))
        high = start + int(np.argmax(np.where(finite, part, -np.inf)))
        keep.extend(sorted({low, high}))
    return time_s[keep], values[keep]


def page_json(value: Any) -> str:
    """JSON that can stand inside a script element: no character opens or closes a tag."""
    text: str = to_json_plotly(value)
    return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")


def _layout(height: int) -> dict[str, Any]:
    axis = {
        "gridcolor": _GRID,
        "zerolinecolor": "#bbbbbb",
        "linecolor": "#888888",
        "ticks": "outside",
        "tickcolor": "#888888",
    }
    return {
        "template": {"layout": {"xaxis": axis, "yaxis": axis}},
        "height": height,
        "autosize": True,
        "font": {"family": _FONT, "size": 13, "color": "#222222"},
        "paper_bgcolor": "rgba(0,0,0,0)",
        "plot_bgcolor": "#ffffff",
        # Without its colours the bar of tools is a dark block: paper is transparent.
        "modebar": {"bgcolor": "rgba(0,0,0,0)", "color": "#9a9aa0", "activecolor": AFTER},
        "hoverlabel": {"font": {"family": _FONT, "size": 13}, "align": "left"},
    }


def _safe(text: str) -> str:
    return html.escape(text, quote=False)
