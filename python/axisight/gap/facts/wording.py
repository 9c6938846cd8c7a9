"""Shares and lists in words."""

from __future__ import annotations

import math
from collections.abc import Sequence

LARGEST = 10.0
"""Share of the torque from which a gap is no measure: units, gravity or the controller are wrong then."""


def listed(items: Sequence[str], last: str = "and") -> str:
    """Return items in a row: "a, b and c", with another ``last`` word between the last two."""
    return f" {last} ".join([", ".join(items[:-1]), items[-1]]) if len(items) > 1 else items[0]


def percent(x: float) -> str:
    """Return a share in per cent with three digits; "more than 1,000 %" above `LARGEST`."""
    if not math.isfinite(x):
        return "no share"
    return f"{100 * x:.3g} %" if x <= LARGEST else f"more than {100 * LARGEST:,.0f} %"


def removed_in_words(share: float) -> str:
    """Return which share of the loss above noise a candidate removes [1], in per cent.

    "at its floor" above `LARGEST`: there the axis had next to nothing above noise, so that a share says nothing.
    """
    return "at its floor" if share > LARGEST else percent(share)
