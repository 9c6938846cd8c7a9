"""The modelled remainder in the report: a sentence, and a figure for each term."""

from __future__ import annotations

from typing import Any

import numpy as np

from axisight.remainder import ModelledRemainder, Term
from axisight.remainder.variables import VARIABLES
from axisight.report.curves import path
from axisight.report.scale import Scale
from axisight.report.wording import percent
from axisight.statistics.intervals import NORMAL_DEVIATIONS

# Drawing units as in the other figures: width of a panel, units per pixel of height, and the height.
_WIDTH, _FINE, _HEIGHT = 8_000, 10, 150


def modelled_remainder(modelled: ModelledRemainder | None) -> dict[str, Any] | None:
    """Return what the page says of a modelled remainder; None without one."""
    if modelled is None:
        return None
    before, after = percent(modelled.gap_before), percent(modelled.gap_after)
    moving = f"{percent(modelled.moving_before)} to {percent(modelled.moving_after)}"
    text = (
        f"By inverse dynamics it lowers the gap on the validation logs from {before} to {after}; in motion alone "
        f"from {moving}."
        if modelled.model.terms
        else "The remainder follows no variable that a model could carry to other motions."
    )
    return {"text": text, "terms": [_figure(term) for term in modelled.model.terms]}


def _figure(term: Term) -> dict[str, Any]:
    """Return the picture of a term: its function with a 95 % band, along the range of the data."""
    margin = NORMAL_DEVIATIONS * term.standard_error
    # A constant is drawn as a level line.
    x = term.x if len(term.x) > 1 else np.array([0.0, 1.0])
    low, value, high = (
        np.broadcast_to(y, x.shape) for y in (term.value - margin, term.value, term.value + margin)
    )
    across, up = Scale.around(x), Scale.around(np.concatenate([low, high, [0.0]]), margin=0.06)

    def drawn(at: np.ndarray[Any, Any], y: np.ndarray[Any, Any]) -> str:
        return path(_WIDTH * across.share(at), _FINE * _HEIGHT * (1 - up.share(y)))

    variable = VARIABLES[term.variable]
    of = "" if term.variable in ("time", "constant") else f" of axis {term.of_axis}"
    return {
        "title": f"Axis {term.axis}: {term.words} ({100 * term.gain:.0f} % on held-out data)",
        "hint": f"{term.hint[:1].upper()}{term.hint[1:]}." if term.hint else "",
        "height": _HEIGHT,
        "width": _WIDTH,
        "fine": _FINE,
        "x_ticks": across.ticks(6) if len(term.x) > 1 else [],
        "y_ticks": up.ticks(4),
        "x_title": f"{variable.words}{of} ({variable.unit})" if len(term.x) > 1 else "",
        "y_title": f"function ({term.unit})",
        "line": drawn(x, value),
        "band": drawn(np.concatenate([x, x[::-1]]), np.concatenate([low, high[::-1]])) + "z",
    }
