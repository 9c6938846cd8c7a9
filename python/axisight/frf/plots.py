"""Bode plots and element matrices of frequency responses; every function returns a Figure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, MaxNLocator, MultipleLocator, NullFormatter
from numpy.typing import NDArray

from axisight.arguments import between, switch, whole, words
from axisight.errors import InputError
from axisight.frf.confidence import confidence_radius
from axisight.frf.response import Flag, estimate_of
from axisight.palette import SERIES

Real = NDArray[np.float64]

_WIDEST_IN = 100
_DENSE = 60  # dots of more lines than this would overlap; half of it in small panels
Responses = xr.Dataset | Mapping[str, xr.Dataset]


@dataclass(frozen=True)
class _Curve:
    """One element to draw, in dB and degrees, with bands; NaN where unknown."""

    frequency_hz: Real
    db: Real
    db_band: tuple[Real, Real]
    phase: Real
    phase_band: Real
    flag: NDArray[np.int8]


def plot_bode(
    responses: Responses,
    *,
    output: int = 1,
    input: int = 1,
    unwrap: bool = False,
    width_in: float = 5.0,
) -> Figure:
    """Plot magnitude and phase of one element with 95 % bands, and return a Figure.

    responses
        A Dataset of ``axisight.frf``, or several as {label: Dataset}, drawn in the same axes.
    output, input
        The element, from 1.
    unwrap
        Draw the phase without jumps of 360 degrees, starting within +-180 degrees.
    width_in
        Width of the figure [inches].

    Bands are those of :func:`axisight.frf.confidence_radius`; there are none where the variance is
    unknown. The lower band has no end where the 95 % disc holds zero, because the phase can then be
    anything. Marks on the frequency axis show flagged lines: a triangle for an ill-conditioned
    estimate, a cross for a line without an estimate.

    Raises InputError for an element that does not exist, responses of different units, and
    Datasets without a response.
    """
    named = _named(responses)
    switch("unwrap", unwrap)
    width_in = between("width_in", width_in, 0, _WIDEST_IN)
    for name, value in (("output", output), ("input", input)):
        whole(name, value)
        for dataset in named.values():
            if value not in dataset[name].values:
                raise InputError(
                    f"{name}: expected one of {dataset[name].values.tolist()}, got {value}"
                )
    figure = Figure(figsize=(width_in, 0.8 * width_in), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    curves = [_curve(d, output, input, unwrap) for d in named.values()]
    _draw(top, bottom, curves)
    unit = next(iter(named.values()))["response"].attrs.get("units", "")
    top.set_ylabel(f"magnitude\n[{_decibel(unit)}]")
    bottom.set_ylabel("phase [deg]")
    bottom.set_xlabel("frequency [Hz]")
    _dress(top, bottom, curves, unwrap)
    _legend(figure, named, curves)
    return figure


def plot_response_matrix(
    responses: Responses,
    *,
    phase: bool = True,
    unwrap: bool = False,
    width_in: float = 7.2,
    row_height_in: float = 1.9,
) -> Figure:
    """Plot all elements, outputs over rows and inputs over columns, and return a Figure.

    responses, unwrap
        As in :func:`plot_bode`.
    phase
        Whether to draw the phase under each magnitude.
    width_in, row_height_in
        Width of the figure and height of an output's row [inches]. The default fills the text
        width of a paper or a notebook; 3.5 is one column of two.

    All elements share their axes. Raises InputError as :func:`plot_bode` does, and for responses of
    different sizes.
    """
    named = _named(responses)
    phase, unwrap = switch("phase", phase), switch("unwrap", unwrap)
    width_in = between("width_in", width_in, 0, _WIDEST_IN)
    row_height_in = between("row_height_in", row_height_in, 0, _WIDEST_IN)
    first = next(iter(named.values()))
    outputs, inputs = first["output"].values, first["input"].values
    parts = 2 if phase else 1
    height = row_height_in * (len(outputs) + 0.25) * (1.0 if phase else 0.7)
    engine = ConstrainedLayoutEngine(h_pad=0.02, w_pad=0.02, hspace=0, wspace=0)
    figure = Figure(figsize=(width_in, height), layout=engine)
    small = width_in < 5
    size = 6.5 if small else 8
    ratios = (3, 2)[:parts] * len(outputs)
    grid = figure.subplots(
        parts * len(outputs),
        len(inputs),
        sharex=True,
        squeeze=False,
        height_ratios=ratios,
    )
    cells: dict[tuple[int, int], list[_Curve]] = {}
    for i, o in enumerate(outputs):
        for j, u in enumerate(inputs):
            curves = [_curve(d, int(o), int(u), unwrap) for d in named.values()]
            cells[i, j] = curves
            top = grid[parts * i, j]
            bottom = grid[parts * i + 1, j] if phase else None
            _draw(top, bottom, curves, thin=True)
    _share(grid, cells, parts, unwrap)
    for axes in grid.flat:
        axes.tick_params(labelsize=size, length=2.5, which="major")
    unit = first["response"].attrs.get("units", "")
    for j, u in enumerate(inputs):
        grid[0, j].set_title(f"input {u}", fontsize=size + 0.5)
        grid[-1, j].set_xlabel("frequency [Hz]", fontsize=size)
    for i, o in enumerate(outputs):
        grid[parts * i, 0].set_ylabel(f"output {o}", fontsize=size + 0.5)
    quantity = f"magnitude [{_decibel(unit)}]" + (" and phase [deg]" if phase else "")
    figure.supylabel(quantity, fontsize=size)
    figure.align_ylabels(grid[:, 0])
    _legend(figure, named, [c for curves in cells.values() for c in curves], size)
    return figure


def _named(responses: Responses) -> dict[str, xr.Dataset]:
    if not isinstance(responses, xr.Dataset | Mapping):
        kind = type(responses).__name__
        raise InputError(f"responses: expected a Dataset or {{label: Dataset}}, got {kind}")
    if isinstance(responses, xr.Dataset):
        named = {"": responses}
    else:
        named = {words("responses", k): v for k, v in dict(responses).items()}
    if not named:
        raise InputError("responses: expected at least one, got none")
    for label, dataset in named.items():
        found = estimate_of(
            f"responses[{label!r}]" if label else "responses", dataset, uncertain=False
        )["response"]
        if not np.isfinite(found.values).any():
            raise InputError(f"responses: expected a line with numbers, got only NaN {label!r}")
    first_label, first = next(iter(named.items()))
    for label, dataset in named.items():
        for dim in ("output", "input"):
            if not np.array_equal(dataset[dim].values, first[dim].values):
                raise InputError(
                    f"responses: expected {dim}s {first[dim].values.tolist()} as in "
                    f"{first_label!r}, got {dataset[dim].values.tolist()} in {label!r}"
                )
        a, b = (d["response"].attrs.get("units", "") for d in (first, dataset))
        if a != b:
            raise InputError(f"responses: expected {a} as in {first_label!r}, got {b} in {label!r}")
    return named


def _curve(dataset: xr.Dataset, output: int, input_: int, unwrap: bool) -> _Curve:
    element = dataset.sel(output=output, input=input_)
    frequency = element["frequency_hz"].values
    response = element["response"].values
    magnitude = np.abs(response)
    nothing = np.full(len(frequency), np.nan)
    radius = nothing
    if "variance" in dataset:
        radius = confidence_radius(dataset).sel(output=output, input=input_).values
    phase = np.degrees(np.angle(response))
    if unwrap:
        known = np.isfinite(phase)
        phase[known] = np.unwrap(phase[known], period=360.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        db = np.where(magnitude > 0, 20 * np.log10(magnitude), np.nan)
        low = np.where(magnitude > radius, 20 * np.log10(magnitude - radius), -np.inf)
        low = np.where(np.isfinite(radius), low, np.nan)
        high = 20 * np.log10(magnitude + radius)
        half = np.where(
            radius < magnitude,
            np.degrees(np.arcsin(radius / magnitude)),
            np.where(radius > 0, 180.0, np.nan),
        )
    flag = element["flag"].values if "flag" in element else np.zeros(len(frequency), np.int8)
    return _Curve(frequency, db, (low, high), phase, half, flag)


def _draw(top: Axes, bottom: Axes | None, curves: list[_Curve], *, thin: bool = False) -> None:
    width = 0.9 if thin else 1.3
    for k, curve in enumerate(curves):
        color, style = SERIES[k % len(SERIES)], _STYLES[k // len(SERIES) % len(_STYLES)]
        f = curve.frequency_hz
        dense = _DENSE // 2 if thin else _DENSE
        marker, size = ("o" if len(f) <= dense else ""), (2.0 if thin else 3.0)
        top.plot(f, curve.db, style, color=color, lw=width, marker=marker, ms=size)
        low, high = curve.db_band
        # A disc that holds zero has no lower end in dB, so its band runs to the edge of the axes.
        floor = np.where(np.isneginf(low), -1e4, low)
        top.fill_between(f, floor, high, color=color, alpha=0.25, lw=0)
        if bottom is not None:
            # Line and band break where the phase wraps, because vertical strokes would mislead.
            jump = np.flatnonzero(np.abs(np.diff(curve.phase)) > 180) + 1
            x, half = np.insert(f, jump, f[jump - 1]), np.insert(curve.phase_band, jump, np.nan)
            y = np.insert(curve.phase, jump, np.nan)
            bottom.plot(x, y, style, color=color, lw=width, marker=marker, ms=size)
            bottom.fill_between(x, y - half, y + half, color=color, alpha=0.25, lw=0)
        for mark, chosen in (("^", curve.flag == Flag.ILL_CONDITIONED), ("x", _missing(curve))):
            if chosen.any():
                top.plot(
                    f[chosen],
                    np.full(chosen.sum(), 0.03 + 0.05 * k),
                    mark,
                    color=color,
                    ms=3.5 if thin else 5,
                    mew=0.9,
                    transform=top.get_xaxis_transform(),
                    clip_on=False,
                    zorder=5,
                )


_STYLES = ("-", "--", ":")


def _missing(curve: _Curve) -> NDArray[np.bool_]:
    return np.asarray(
        (curve.flag == Flag.RANK_DEFICIENT)
        | (curve.flag == Flag.NO_EXCITATION)
        | np.isnan(curve.db)
    )


def _dress(top: Axes, bottom: Axes | None, curves: list[_Curve], unwrap: bool) -> None:
    _frequency_axis(top, curves)
    low, high = _db_range(curves)
    top.set_ylim(low, high)
    _style(top)
    if bottom is not None:
        _phase_axis(bottom, curves, unwrap)
        _style(bottom)


def _share(
    grid: NDArray[np.object_],
    cells: dict[tuple[int, int], list[_Curve]],
    parts: int,
    unwrap: bool,
) -> None:
    """Give all panels the same frequency axis, dB range and phase range."""
    everything = [c for curves in cells.values() for c in curves]
    low, high = _db_range(everything)
    for (i, j), _ in cells.items():
        top = grid[parts * i, j]
        top.set_ylim(low, high)
        top.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 4, 5, 10]))
        _frequency_axis(top, everything)
        _style(top)
        top.tick_params(labelleft=j == 0)
        if parts == 2:
            bottom = grid[parts * i + 1, j]
            _phase_axis(bottom, everything, unwrap)
            _style(bottom)
            bottom.tick_params(labelleft=j == 0)


def _frequency_axis(axes: Axes, curves: list[_Curve]) -> None:
    low = min(float(c.frequency_hz[c.frequency_hz > 0].min()) for c in curves)
    high = max(float(c.frequency_hz.max()) for c in curves)
    axes.set_xscale("log")
    axes.set_xlim(low / 1.03, high * 1.03)
    if high / low < 100:  # few decades: round numbers instead of powers of ten
        ticks = [m * 10.0**e for e in range(-6, 7) for m in (1, 2, 5)]
        inside = [t for t in ticks if low / 1.03 <= t <= high * 1.03]
        axes.xaxis.set_major_locator(FixedLocator(inside))
    axes.xaxis.set_major_formatter(lambda x, _: f"{x:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())


def _db_range(curves: list[_Curve]) -> tuple[float, float]:
    """Return the range of the estimates; bands do not count, as one wide band would flatten the rest."""
    values = np.concatenate([c.db for c in curves])
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    margin = max(0.06 * (high - low), 1.0)
    return low - 1.8 * margin, high + margin


def _phase_axis(axes: Axes, curves: list[_Curve], unwrap: bool) -> None:
    if not unwrap:
        axes.set_ylim(-190, 190)
        axes.yaxis.set_major_locator(FixedLocator([-180, 0, 180]))
        axes.yaxis.set_minor_locator(MultipleLocator(90))
        return
    values = np.concatenate([c.phase for c in curves])
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    axes.set_ylim(low - 20, high + 20)
    step = next((s for s in (45, 90, 180, 360, 720) if (high - low) / s <= 5), 1440)
    axes.yaxis.set_major_locator(MultipleLocator(step))


def _style(axes: Axes) -> None:
    axes.grid(True, which="major", lw=0.4, color="0.85")
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def _legend(
    figure: Figure, named: dict[str, xr.Dataset], curves: list[_Curve], size: float = 8
) -> None:
    """Add a legend with the responses, if several, and with the marks, if any."""
    handles = [
        Line2D([], [], color=SERIES[k % len(SERIES)], ls=_STYLES[k // len(SERIES) % len(_STYLES)])
        for k in range(len(named))
    ]
    labels = list(named)
    if labels == [""]:
        handles, labels = [], []
    marks = (
        ("^", "ill-conditioned", any((c.flag == Flag.ILL_CONDITIONED).any() for c in curves)),
        ("x", "no estimate", any(_missing(c).any() for c in curves)),
    )
    for mark, label, present in marks:
        if present:
            handles.append(Line2D([], [], ls="", marker=mark, color="0.3", ms=4))
            labels.append(label)
    if labels:
        figure.legend(
            handles,
            labels,
            loc="outside upper center",
            ncols=len(labels),
            fontsize=size,
            frameon=False,
        )


def _decibel(unit: str) -> str:
    return f"dB re 1 {unit.replace('^2', '²')}" if unit else "dB"
