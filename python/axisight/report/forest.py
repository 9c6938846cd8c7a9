"""A forest plot: all values of all causes with their intervals, each relative to its value."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.figure import Figure
from matplotlib.transforms import blended_transform_factory

from axisight.errors import InputError
from axisight.gap.facts.result import Cause, Diagnosis, Interval
from axisight.palette import AFTER
from axisight.report.wording import title_of

# Drawn range, relative to the value [1]: an interval beyond it ends in an arrow; below zero the sign changes.
_DRAWN = (0.0, 2.0)


@dataclass(frozen=True)
class _Row:
    name: str
    said: str
    interval: Interval


def plot_parameters(diagnosis: Diagnosis) -> Figure:
    """Plot every value of every cause with its 95 % interval, relative to the value; returns a Figure.

    Labels give each value in its unit. Values without an interval (shapes that were not fitted) and zeros are
    left out. Raises InputError if there are no causes with intervals.
    """
    rows = [row for cause in diagnosis.causes for row in _rows(cause)]
    if not rows:
        raise InputError("diagnosis: expected causes with intervals, got none")
    figure = Figure(figsize=(9, 1.0 + 0.34 * len(rows)), layout="constrained")
    axes = figure.subplots()
    axes.axvline(1.0, color="0.8", lw=1)
    beside = blended_transform_factory(axes.transAxes, axes.transData)
    for place, row in enumerate(rows):
        low, value, high = _shares(row.interval)
        axes.plot([low, high], [place, place], color=AFTER, lw=2, solid_capstyle="butt")
        axes.plot(value, place, "o", color=AFTER, ms=5)
        for end, edge, mark in zip((low, high), _DRAWN, "<>", strict=True):
            if end == edge:
                axes.plot(end, place, mark, color=AFTER, ms=5)
        axes.text(1.02, place, row.said, transform=beside, va="center", fontsize=8)
    axes.set_yticks(range(len(rows)), [row.name for row in rows], fontsize=8)
    axes.set(
        xlim=(-0.05, 2.05),
        ylim=(len(rows) - 0.4, -0.6),
        xlabel="value and 95 % interval, over the value [1]",
    )
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def _rows(cause: Cause) -> Sequence[_Row]:
    """Return a row for each fitted value; the first row has the name of the cause."""
    found = []
    for name, x in cause.parameters.items():
        if x.value and x.low < x.high:
            unit = cause.units.get(name, "").partition(" (")[0]
            said = f"{x.value:.4g} [{x.low:.4g}, {x.high:.4g}] {'' if unit == '1' else unit}"
            found.append(_Row(f"{title_of(cause)}: {_word(name)}", said.rstrip(), x))
    return found


def _word(name: str) -> str:
    """Return a parameter's name in words, without its unit."""
    for unit in ("_nm_s_rad", "_nm_s2_rad2", "_nm_rad3", "_nm_rad", "_rad_s", "_nm", "_rad", "_hz"):
        name = name.removesuffix(unit)
    return name.removesuffix("_s").removesuffix("_m").removesuffix("_kg").replace("_", " ")


def _shares(x: Interval) -> tuple[float, float, float]:
    """Return an interval's ends and value, relative to the value, with the ends clipped for drawing."""
    low, high = sorted((x.low / x.value, x.high / x.value))
    return max(low, _DRAWN[0]), 1.0, min(high, _DRAWN[1])
