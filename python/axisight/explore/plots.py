"""The figures of the page: curves keep their peaks however long the log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from bokeh.models import ColumnDataSource, HoverTool, Legend, LegendItem, Range1d
from bokeh.plotting import figure
from numpy.typing import NDArray

from axisight import palette
from axisight.gap.facts.axis_names import axis_label

Array = NDArray[np.float64]

# About two for each pixel of a wide screen.
_POINTS = 2400
# Share of the visible range drawn beyond its ends, so that small moves show curves at once.
_MARGIN = 0.2
_TOOLS = "xpan,xwheel_zoom,xbox_zoom,reset,save"
_TALL, _LOW = 260, 190

CURVES = {
    "measured": ("measured", palette.MEASURED, "solid"),
    "given": ("as given", palette.BEFORE, "solid"),
    "now": ("as chosen", palette.AFTER, "solid"),
    "A": ("pin A", palette.SERIES[2], "dashed"),
    "B": ("pin B", palette.SERIES[3], "dashed"),
}


class Curves:
    """One figure over time, with curves by the keys of `CURVES`."""

    def __init__(self, name: str, keys: Sequence[str], height: int, x_range: Range1d) -> None:
        self._full: dict[str, tuple[Array, Array]] = {}
        self._of: dict[str, tuple[object, int]] = {}
        self.figure = figure(
            height=height,
            sizing_mode="stretch_width",
            tools=_TOOLS,
            active_scroll="xwheel_zoom",
            active_drag="xbox_zoom",
            x_range=x_range,
            name=f"figure-{name}",
            output_backend="canvas",
        )
        self.figure.toolbar.logo = None
        self.figure.min_border_left = 70
        self.figure.y_range.range_padding = 0.05
        self.sources = {}
        self._items = {}
        for key in keys:
            label, color, dash = CURVES[key]
            source = ColumnDataSource({"x": [], "y": []}, name=f"{name}-{key}")
            line = self.figure.line("x", "y", source=source, color=color, line_dash=dash)
            self.sources[key] = source
            self._items[key] = LegendItem(label=label, renderers=[line])
        self.figure.add_layout(_legend(list(self._items.values())), "above")
        self.figure.add_tools(
            HoverTool(tooltips=[("time", "@x{0.000} s"), ("value", "@y")], mode="mouse")
        )

    def show(
        self,
        key: str,
        time_s: Array,
        values: Array | None,
        axis: int,
        counts: NDArray[np.bool_] | None = None,
    ) -> None:
        """Set a curve to one axis (from 0) of values (n, n_axes), or remove it; skip equal values.

        ``counts`` (n,): which samples are drawn; None draws all.
        """
        there = self._of.get(key)
        if there is not None and there[0] is values and there[1] == axis:
            return
        self._of[key] = (values, axis)
        if values is None:
            self._full.pop(key, None)
        else:
            column = values[:, axis]
            self._full[key] = (
                time_s,
                column if counts is None else np.where(counts, column, np.nan),
            )
        self.draw([key])

    def draw(self, keys: Sequence[str] | None = None) -> None:
        """Draw curves (all by default) at the resolution of the zoom."""
        window = (float(self.figure.x_range.start), float(self.figure.x_range.end))
        for key in keys if keys is not None else tuple(self.sources):
            source = self.sources.get(key)
            if source is None:
                continue
            full = self._full.get(key)
            x, y = (np.zeros(0), np.zeros(0)) if full is None else _in_window(*full, window)
            source.data = {"x": x, "y": y}
            if self._items[key].visible != (full is not None):
                self._items[key].visible = full is not None


def _in_window(time_s: Array, values: Array, window: tuple[float, float]) -> tuple[Array, Array]:
    start, stop = window
    margin = _MARGIN * (stop - start)
    first, last = np.searchsorted(time_s, [start - margin, stop + margin])
    return peaks(time_s[first:last], values[first:last], _POINTS)


def peaks(time_s: Array, values: Array, points: int) -> tuple[Array, Array]:
    """Return about ``points`` samples of a curve (n,): minimum and maximum of each stretch.

    Like `axisight.report.curves.thin`, but vectorized, for stretches of one length. A stretch without finite
    values keeps one NaN as a gap.
    """
    n = len(values)
    if n <= points:
        return time_s, values
    length = -(-2 * n // points)
    count = -(-n // length)
    padded = np.full(count * length, np.nan)
    padded[:n] = values
    parts = padded.reshape(count, length)
    known = np.isfinite(parts)
    starts = np.arange(count) * length
    low = starts + np.where(known, parts, np.inf).argmin(axis=1)
    high = starts + np.where(known, parts, -np.inf).argmax(axis=1)
    kept = np.unique(np.concatenate([low, high]))
    return time_s[kept], values[kept]


def time_figures(x_range: Range1d) -> dict[str, Curves]:
    """Return the figures of torque, residual and position, which zoom together."""
    pins = ("A", "B")
    out = {
        "torque": Curves("torque", ("measured", "given", "now", *pins), _TALL, x_range),
        "residual": Curves("residual", ("given", "now", *pins), _LOW, x_range),
        "position": Curves("position", ("measured", "given", "now", *pins), _LOW, x_range),
    }
    out["position"].figure.xaxis.axis_label = "time [s]"
    return out


class Regard:
    """The residual over a quantity: samples as dots, bin means as lines."""

    def __init__(self) -> None:
        self.figure = _plain("figure-against", "", "residual")
        self.dots = ColumnDataSource({"x": [], "y": []}, name="against-dots")
        self.figure.scatter(
            "x", "y", source=self.dots, size=2, alpha=0.25, color=palette.AFTER, line_color=None
        )
        self.means, items = {}, []
        for key in ("given", "now"):
            label, color, _ = CURVES[key]
            source = ColumnDataSource({"x": [], "y": []}, name=f"against-{key}")
            line = self.figure.line("x", "y", source=source, color=color, line_width=2.5)
            self.means[key] = source
            items.append(LegendItem(label=f"mean, {label}", renderers=[line]))
        self._items = dict(zip(self.means, items, strict=True))
        self.figure.add_layout(_legend(items), "above")

    def show(self, key: str, x: Array, y: Array) -> None:
        """Show the bin means (n_bins,) of a version."""
        self.means[key].data = {"x": x, "y": y}
        self._items[key].visible = len(x) > 0


class Orders:
    """Amplitude over order of the motor angle, as given and as chosen."""

    def __init__(self) -> None:
        self.figure = _plain("figure-orders", "order of the motor angle", "amplitude")
        self.sources = {}
        self._items = {}
        for key, shift in (("given", -0.2), ("now", 0.2)):
            label, color, _ = CURVES[key]
            source = ColumnDataSource({"x": [], "y": []}, name=f"orders-{key}")
            bars = self.figure.vbar("x", top="y", width=0.38, source=source, color=color)
            self.sources[key] = (source, shift)
            self._items[key] = LegendItem(label=label, renderers=[bars])
        self.figure.y_range.start = 0
        self.figure.add_layout(_legend(list(self._items.values())), "above")

    def show(self, key: str, orders: Array, amplitude: Array) -> None:
        """Show the finite amplitudes (n_orders,)."""
        source, shift = self.sources[key]
        known = np.isfinite(amplitude)
        source.data = {"x": orders[known] + shift, "y": amplitude[known]}
        self._items[key].visible = bool(known.any())


# Smallest gain that is drawn, relative to the largest of a figure [1]. No sensor resolves less, and the
# rounding errors of an axis that does not move would stretch the scale.
_ROUNDING = 1e-12


class Responses:
    """Gain from one motor's torque to all motor angles.

    Axes differ by colour, versions by line style; the legend has one entry for each.
    """

    def __init__(self, n_axes: int, names: Sequence[str] = ()) -> None:
        self.figure = _plain("figure-responses", "frequency [Hz]", "gain [dB re 1 rad/Nm]", "log")
        self.sources: dict[str, list[ColumnDataSource]] = {"given": [], "now": [], "measured": []}
        lines: dict[str, list[Any]] = {key: [] for key in self.sources}
        for i in range(n_axes):
            color = palette.SERIES[i % len(palette.SERIES)]
            for key, seen in self.sources.items():
                source = ColumnDataSource({"x": [], "y": []}, name=f"response-{key}-{i + 1}")
                seen.append(source)
                lines[key].append(self._drawn(key, source, color))
        self._axes = [
            LegendItem(label=f"axis {axis_label(i + 1, names)}", renderers=[*of])
            for i, of in enumerate(
                zip(lines["now"], lines["given"], lines["measured"], strict=True)
            )
        ]
        self._kinds = {
            key: LegendItem(label=CURVES[key][0], renderers=of) for key, of in lines.items()
        }
        self.figure.add_layout(_legend([*self._axes, *self._kinds.values()]), "above")
        for item in (*self._axes, *self._kinds.values()):
            item.visible = False

    def _drawn(self, key: str, source: ColumnDataSource, color: str) -> Any:
        if key == "measured":
            return self.figure.scatter(
                "x", "y", source=source, size=4, color=color, alpha=0.6, line_color=None
            )
        dash = "dashed" if key == "given" else "solid"
        return self.figure.line(
            "x", "y", source=source, color=color, line_dash=dash, line_width=1.6
        )

    def of(self, axis: int) -> None:
        """Name the axis (from 0) whose torque excites."""
        self.figure.title.text = f"Angle of each motor per torque of motor {axis + 1}"

    def show(self, curves: Mapping[str, tuple[Array, Array]]) -> None:
        """Show frequencies [Hz] (n_freq,) and gains (n_freq, n_outputs) [rad/Nm] by version."""
        for key, sources in self.sources.items():
            frequency_hz, gain = curves.get(key, (np.zeros(0), np.zeros((0, len(sources)))))
            for source, column in zip(sources, levels(gain).T, strict=True):
                source.data = {"x": frequency_hz, "y": column}
            self._kinds[key].visible = any(_seen(source) for source in sources)
        for i, item in enumerate(self._axes):
            item.visible = any(_seen(sources[i]) for sources in self.sources.values())


def levels(gain: Array) -> Array:
    """Return gains (n_freq, n_outputs) in dB; NaN for unknown gains and for rounding errors."""
    if gain.size == 0:
        return gain
    largest = np.max(np.where(np.isfinite(gain), gain, 0.0))
    known = np.where(gain > _ROUNDING * largest, gain, np.nan)
    return np.asarray(20 * np.log10(known))


def _seen(source: ColumnDataSource) -> bool:
    return bool(np.isfinite(np.asarray(source.data["y"], dtype=float)).any())


# Columns of a legend above a figure; a phone has room for no more.
_LEGEND_COLUMNS = 3


def _legend(items: Sequence[LegendItem]) -> Legend:
    return Legend(
        items=list(items),
        ncols=_LEGEND_COLUMNS,
        orientation="horizontal",
        click_policy="hide",
        border_line_color=None,
        margin=0,
        padding=2,
        spacing=8,
        label_text_font_size="9pt",
    )


def _plain(name: str, x_label: str, y_label: str, x_scale: str = "linear") -> figure:
    out = figure(
        height=480,
        sizing_mode="stretch_width",
        tools="pan,box_zoom,wheel_zoom,reset,save",
        x_axis_type=x_scale,
        name=name,
    )
    out.toolbar.logo = None
    out.xaxis.axis_label, out.yaxis.axis_label = x_label, y_label
    return out
