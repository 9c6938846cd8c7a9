"""A layout of Foxglove for a recording of signals: the largest gap first, then one tab per log."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import xarray as xr

from axisight.signal_files.first_view import FirstView, first_view
from axisight.signal_files.plots import Plot, front_title, in_order, log_title, plots_of
from axisight.signal_files.topics import POSITION, TORQUE, prefixes

ENDING = ".foxglove.json"
"""Ending of a layout's file name, in place of that of the recording."""

# Fields of sensor_msgs/JointState.
_FIELDS = {TORQUE: "effort", POSITION: "position"}
_ROOT = "Tab!axisight"


def layout(signals: Sequence[xr.Dataset]) -> str:
    """Return the layout as JSON, for *Import from file* in Foxglove and in Lichtblick.

    The format is what both apps export: the type ``LayoutData`` of Lichtblick, the open continuation of Foxglove
    Studio, with the configurations ``TabPanelConfig`` and ``PlotConfig`` of its panels.
    """
    front, paths = first_view(signals), prefixes(signals)
    panels: dict[str, Any] = {}
    tabs = [_first_tab(panels, signals[front.log], paths[front.log], front)]
    tabs += [_tab(panels, signals[k], paths[k]) for k in in_order(signals, front.log)]
    made = {
        "configById": {_ROOT: {"activeTabIdx": 0, "tabs": tabs}, **panels},
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": _ROOT,
    }
    return json.dumps(made, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _first_tab(
    panels: dict[str, Any], data: xr.Dataset, prefix: str, front: FirstView
) -> dict[str, Any]:
    """Add the panels of the first view, which show its time only; return its tab."""
    names = []
    for plot in plots_of(data, front.axis):
        name = f"Plot!front.{plot.kind}"
        # A synchronized plot would pass its range on to the plots of other tabs.
        shown = {"isSynced": False, "minXValue": front.start_s, "maxXValue": front.stop_s}
        panels[name] = _plot(plot, prefix, front.axis) | shown
        names.append(name)
    return {"title": front_title(data, front.axis), "layout": _split(names, "column")}


def _tab(panels: dict[str, Any], data: xr.Dataset, prefix: str) -> dict[str, Any]:
    """Add the panels of all axes of a log, one row per axis; return its tab."""
    rows = []
    for axis in range(data.sizes["axis"]):
        names = []
        for plot in plots_of(data, axis):
            name = f"Plot!{prefix.strip('/').replace('/', '.')}.{axis + 1}.{plot.kind}"
            panels[name] = _plot(plot, prefix, axis)
            names.append(name)
        rows.append(_split(names, "row"))
    return {"title": log_title(data), "layout": _split(rows, "column")}


def _plot(plot: Plot, prefix: str, axis: int) -> dict[str, Any]:
    """Return the configuration of a plot; the two apps read its title under names of their own."""
    return {
        "foxglovePanelTitle": plot.title,
        "lichtblickPanelTitle": plot.title,
        "paths": [
            {
                "value": f"{prefix}/{curve.base}.{_FIELDS[curve.quantity]}[{axis}]",
                "enabled": True,
                "timestampMethod": "receiveTime",
                "label": curve.label,
                "color": curve.color,
            }
            for curve in plot.curves
        ],
        "showLegend": True,
        "legendDisplay": "floating",
        "showPlotValuesInLegend": False,
        "showXAxisLabels": True,
        "showYAxisLabels": True,
        "isSynced": True,
        "xAxisVal": "timestamp",
        "sidebarDimension": 240,
    }


def _split(parts: Sequence[Any], direction: str) -> Any:
    """Return parts of equal size beside (``row``) or below (``column``) each other, as a tree of pairs."""
    if len(parts) == 1:
        return parts[0]
    return {
        "direction": direction,
        "first": parts[0],
        "second": _split(parts[1:], direction),
        "splitPercentage": 100 / len(parts),
    }
