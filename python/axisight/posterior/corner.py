"""Corner plot of a posterior: every parameter alone and with every other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.arguments import several, whole
from axisight.errors import InputError
from axisight.palette import AFTER
from axisight.posterior.result import Posterior

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

MOST = 8
"""Parameters of a plot whose parameters were not chosen."""
# Mahalanobis distance of the contours of a Gaussian that hold 39 % and 86 % in two dimensions: one and two deviations.
_RINGS = (1.0, 2.0)
_BINS = 40


def plot_corner(
    posterior: Posterior,
    parameters: Sequence[str] | None = None,
    *,
    number: int = 2000,
    seed: int | None = None,
) -> Figure:
    """Plot samples of a posterior by pairs of parameters, with the Gaussian of the leading hypothesis; a Figure.

    The diagonal has the density of each parameter and its 95 % interval. Rings hold 39 % and 86 % of the Gaussian. Each
    panel below the diagonal states the correlation of its pair.

    ``parameters``: names, two to twelve. By default the parameters of causes, then those correlated most with another,
    eight at most. ``number``, ``seed``: samples, as in `Posterior.samples`.

    Raises InputError for an unknown parameter, and for fewer than two.
    """
    from matplotlib.figure import Figure  # noqa: PLC0415 - diagnoses load no plots

    names = _chosen(posterior) if parameters is None else several("parameters", parameters)
    for name in names:
        posterior.parameter(name)
    if not 2 <= len(names) <= 12:
        raise InputError(f"parameters: expected two to twelve names, got {len(names)}")
    drawn = posterior.samples(whole("number", number), seed=seed)
    known = posterior.gaussian()
    size = 1.6 * len(names) + 0.8
    figure = Figure(figsize=(size, size), layout="constrained")
    grid = figure.subplots(len(names), len(names), squeeze=False)
    for row, below in enumerate(names):
        for column, across in enumerate(names):
            axes = grid[row, column]
            if column > row:
                axes.set_axis_off()
            elif column == row:
                _alone(axes, drawn[below].values, known, below)
            else:
                _pair(axes, drawn, known, across, below)
            _labelled(axes, posterior, (row, column), names)
    return figure


def _chosen(posterior: Posterior) -> list[str]:
    """Return the parameters of causes, then the own parameters with the strongest correlations."""
    best = posterior.best.names
    causes = [n for n in best if posterior.parameter(n).kind == "cause"]
    strength = np.abs(posterior.gaussian().correlation.values)
    np.fill_diagonal(strength, 0.0)
    strongest = [best[i] for i in np.argsort(-strength.max(axis=1, initial=0.0), kind="stable")]
    return [*causes, *(n for n in strongest if n not in causes)][:MOST]


def _alone(axes: Any, values: Array, known: xr.Dataset, name: str) -> None:
    axes.hist(values, bins=_BINS, color=AFTER, alpha=0.5, density=True)
    if name in known.parameter.values:
        one = known.sel(parameter=name)
        for edge in (float(one.low), float(one.high)):
            axes.axvline(edge, color="0.3", lw=0.8, ls="--")
    axes.set_yticks([])


def _pair(axes: Any, drawn: xr.Dataset, known: xr.Dataset, across: str, below: str) -> None:
    axes.plot(drawn[across], drawn[below], ".", ms=1.2, color=AFTER, alpha=0.25, rasterized=True)
    if not {across, below} <= set(known.parameter.values.tolist()):
        return
    both = known.sel(parameter=[across, below], other=[across, below])
    centre = both.value.values
    values, vectors = np.linalg.eigh(both.covariance.values)
    turn = np.linspace(0.0, 2 * np.pi, 100)
    ring = (vectors * np.sqrt(np.maximum(values, 0.0))) @ np.stack([np.cos(turn), np.sin(turn)])
    for distance in _RINGS:
        axes.plot(*(centre[:, None] + distance * ring), color="0.2", lw=0.8)
    correlation = float(both.correlation.values[0, 1])
    axes.text(0.04, 0.94, f"{correlation:+.2f}", transform=axes.transAxes, va="top", fontsize=7)


def _labelled(axes: Any, posterior: Posterior, at: tuple[int, int], names: Sequence[str]) -> None:
    from matplotlib.ticker import FuncFormatter, MaxNLocator  # noqa: PLC0415

    row, column = at
    axes.tick_params(labelsize=6)
    for side in (axes.xaxis,) if row == column else (axes.xaxis, axes.yaxis):
        side.set_major_locator(MaxNLocator(3))
        # No offset or power beside the axis, which would cover the label of the next panel.
        side.set_major_formatter(FuncFormatter(lambda x, _: f"{x:.8g}"))
    if row == len(names) - 1:
        axes.set_xlabel(_title(posterior, names[column]), fontsize=7)
        axes.tick_params(axis="x", rotation=45)
    else:
        axes.set_xticklabels([])
    if column == 0 and row > 0:
        axes.set_ylabel(_title(posterior, names[row]), fontsize=7)
    else:
        axes.set_yticklabels([])


def _title(posterior: Posterior, name: str) -> str:
    """Return a name in lines, with its unit."""
    unit = posterior.parameter(name).unit
    lines = name.replace(".", "\n").replace("@", "@\u200b")
    return lines if unit == "1" else f"{lines} [{unit}]"
