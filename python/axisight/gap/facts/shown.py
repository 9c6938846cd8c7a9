"""Causes with their values, and shares, as a terminal and a notebook show them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Protocol

from axisight.display import html
from axisight.display.summary import MOST


class Ranged(Protocol):
    """A value with its 95 % interval."""

    @property
    def value(self) -> float:
        """The value."""

    @property
    def low(self) -> float:
        """The lower end."""

    @property
    def high(self) -> float:
        """The upper end."""


class Named(Protocol):
    """A cause with its values."""

    @property
    def label(self) -> str:
        """``effect@axis``."""

    @property
    def probability(self) -> float:
        """Probability [1]."""

    @property
    def parameters(self) -> Mapping[str, Ranged]:
        """Values by name."""

    @property
    def units(self) -> Mapping[str, str]:
        """Units by name."""


def cause_rows(cause: Named) -> list[tuple[str, ...]]:
    """Return a row for a cause, and one for each of its values: name, value, interval, probability."""
    values = [
        (
            f"  {name}",
            f"{html.number(p.value)} {cause.units.get(name, '1')}",
            f"{html.number(p.low)} to {html.number(p.high)}",
            "",
        )
        for name, p in cause.parameters.items()
    ]
    return [(cause.label, "", "", f"{cause.probability:.3f}"), *values]


def cause_in_words(cause: Named) -> str:
    """Return probability and the first values of a cause in one line."""
    found = list(cause.parameters.items())[:MOST]
    texts = (f"{n} {html.number(p.value)} {cause.units.get(n, '')}".strip() for n, p in found)
    return f"{percent(cause.probability)}: {', '.join(texts)}"


def percent(share: float) -> str:
    """Return a share [1] in per cent; a dash where it is not finite."""
    return f"{100 * share:.3g} %" if math.isfinite(share) else "-"
