"""Write the signals of all logs as a recording of Rerun, with a blueprint that shows the largest gap first."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import xarray as xr

from axisight.errors import MissingExtraError
from axisight.signal_files.about import about
from axisight.signal_files.first_view import FirstView, first_view
from axisight.signal_files.plots import Plot, front_title, in_order, log_title, plots_of
from axisight.signal_files.topics import prefixes

TIMELINE = "time"
_APPLICATION = "axisight"


def rerun_file(signals: Sequence[xr.Dataset]) -> bytes:
    """Return the bytes of an RRD file of the signals; raise MissingExtraError without rerun-sdk."""
    try:
        rr = import_module("rerun")
        views = import_module("rerun.blueprint")
    except ImportError as error:
        raise MissingExtraError(
            "Rerun files are written by rerun-sdk: pip install 'axisight[rerun]'"
        ) from error
    paths = prefixes(signals)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "signals.rrd"
        with rr.RecordingStream(_APPLICATION) as stream:
            stream.save(file, default_blueprint=_blueprint(views, signals, paths))
            stream.log("axisight", rr.TextDocument(about(signals)), static=True)
            for data, prefix in zip(signals, paths, strict=True):
                for axis in range(data.sizes["axis"]):
                    for plot in plots_of(data, axis):
                        _write(rr, stream, data, axis, prefix, plot)
            stream.flush()
            stream.disconnect()
        return file.read_bytes()


def _write(rr: Any, stream: Any, data: xr.Dataset, axis: int, prefix: str, plot: Plot) -> None:
    """Write the curves of a plot, one entity each."""
    times = rr.TimeColumn(TIMELINE, duration=data["time_s"].values)
    for entity, curve in zip(_entities(plot, axis, prefix), plot.curves, strict=True):
        style = rr.SeriesLines(names=curve.label, colors=[tuple(bytes.fromhex(curve.color[1:]))])
        stream.log(entity, style, static=True)
        values = rr.Scalars.columns(scalars=data[curve.name].values[:, axis])
        stream.send_columns(entity, indexes=[times], columns=values)


def _entities(plot: Plot, axis: int, prefix: str) -> list[str]:
    """Return the paths of a plot's curves, such as ``/validation/run3/axis_1/torque/measured``."""
    return [f"{prefix}/axis_{axis + 1}/{plot.kind}/{curve.base}" for curve in plot.curves]


def _blueprint(views: Any, signals: Sequence[xr.Dataset], paths: Sequence[str]) -> Any:
    """Return tabs: the largest gap, then all axes of each log, one row per axis."""
    front = first_view(signals)
    tabs = [_first_tab(views, signals[front.log], paths[front.log], front)]
    tabs += [_tab(views, signals[k], paths[k]) for k in in_order(signals, front.log)]
    return views.Blueprint(
        views.Tabs(*tabs, active_tab=0),
        views.SelectionPanel(state="collapsed"),
        views.TimePanel(state="collapsed", timeline=TIMELINE),
    )


def _first_tab(views: Any, data: xr.Dataset, prefix: str, front: FirstView) -> Any:
    edges = (views.TimeRangeBoundary.absolute(seconds=s) for s in (front.start_s, front.stop_s))
    shown = views.TimeRange(*edges)
    return views.Vertical(
        *(
            views.TimeSeriesView(
                name=plot.title,
                contents=_entities(plot, front.axis, prefix),
                axis_x=views.TimeAxis(view_range=shown),
            )
            for plot in plots_of(data, front.axis)
        ),
        name=front_title(data, front.axis),
    )


def _tab(views: Any, data: xr.Dataset, prefix: str) -> Any:
    return views.Vertical(
        *(
            views.Horizontal(
                *(
                    views.TimeSeriesView(
                        name=plot.title,
                        contents=_entities(plot, axis, prefix),
                        axis_x=views.TimeAxis(link="LinkToGlobal"),
                    )
                    for plot in plots_of(data, axis)
                ),
                name=str(data["joint"].values[axis]),
            )
            for axis in range(data.sizes["axis"])
        ),
        name=log_title(data),
    )
