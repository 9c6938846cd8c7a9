"""Pictures of the terms of a remainder."""

from __future__ import annotations

from matplotlib.figure import Figure

from axisight.palette import AFTER
from axisight.remainder.model import Remainder
from axisight.remainder.terms import Term
from axisight.remainder.variables import VARIABLES
from axisight.statistics.intervals import NORMAL_DEVIATIONS

_COLUMNS = 2


def plot_remainder(remainder: Remainder) -> Figure:
    """Plot each term of a remainder with its 95 % band over its variable; returns a Figure.

    A remainder without terms gives an empty figure that says so.
    """
    terms = remainder.terms
    rows = max(1, -(-len(terms) // _COLUMNS))
    figure = Figure(figsize=(10.0, 2.8 * rows), layout="constrained")
    if not terms:
        figure.text(0.5, 0.5, "no term carries to held-out data", ha="center")
        return figure
    panels = figure.subplots(rows, _COLUMNS, squeeze=False).ravel()
    for axes, term in zip(panels, terms, strict=False):
        margin = NORMAL_DEVIATIONS * term.standard_error
        if len(term.x) == 1:
            axes.axhline(term.value[0], color=AFTER)
            axes.axhspan(*(term.value + margin * sign for sign in (-1, 1)), color=AFTER, alpha=0.15)
        else:
            axes.plot(term.x, term.value, color=AFTER)
            low, high = term.value - margin, term.value + margin
            axes.fill_between(term.x, low, high, color=AFTER, alpha=0.15)
        axes.axhline(0.0, color="0.7", lw=0.7, zorder=0)
        axes.set_xlabel(_variable(term))
        axes.set_ylabel(f"[{term.unit}]")
        axes.set_title(f"axis {term.axis}: {term.acts}, {100 * term.gain:.0f} %", fontsize="small")
    for axes in panels[len(terms) :]:
        axes.set_axis_off()
    return figure


def _variable(term: Term) -> str:
    variable = VARIABLES[term.variable]
    of = "" if term.variable in ("time", "constant") else f" of axis {term.of_axis}"
    return f"{variable.words}{of} [{variable.unit}]"
