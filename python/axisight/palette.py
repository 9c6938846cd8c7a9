"""The colours of figures and pages, safe for colour-blind readers and in grey print."""

from __future__ import annotations

import math

BEFORE, AFTER, MEASURED = "#d55e00", "#0072b2", "#222222"
MUTED = "#eeeeee"
SERIES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#222222")
"""Colours of curves of equal rank, in this order (Okabe and Ito 2008)."""

# Light to dark in one hue, even steps of lightness
_STOPS = (
    (0xE3, 0xEE, 0xF9),
    (0xB7, 0xD4, 0xEA),
    (0x6A, 0xAE, 0xD6),
    (0x2E, 0x7E, 0xBC),
    (8, 64, 129),
)


def scale_hex() -> list[str]:
    """Return the stops of the sequential scale as ``#rrggbb``, light to dark."""
    return [_hex(stop) for stop in _STOPS]


def cell_colors(share: float, limit: float) -> tuple[str, str]:
    """Return background and text colour of a cell, for a share [1] on a scale from 0 to ``limit``."""
    if math.isnan(share):
        return MUTED, "#595959"
    position = min(1.0, max(0.0, share / limit)) * (len(_STOPS) - 1)
    index = min(int(position), len(_STOPS) - 2)
    mix = position - index
    low, high = _STOPS[index], _STOPS[index + 1]
    color = tuple(round(a + mix * (b - a)) for a, b in zip(low, high, strict=True))
    # On every background, either black or white has a contrast above 4.5:1.
    ink = max("#000000", "#ffffff", key=lambda ink: contrast(_hex(color), ink))
    return _hex(color), ink


def contrast(one: str, other: str) -> float:
    """Return the contrast of two colours ``#rrggbb``, 1 to 21, as WCAG 2 defines it."""
    low, high = sorted(_luminance(_parts(color)) for color in (one, other))
    return (high + 0.05) / (low + 0.05)


def _parts(color: str) -> tuple[int, ...]:
    return tuple(bytes.fromhex(color[1:]))


def _hex(color: tuple[int, ...]) -> str:
    return "#" + "".join(f"{part:02x}" for part in color)


def _luminance(color: tuple[int, ...]) -> float:
    """Return the relative luminance, as the contrast rule of WCAG 2 defines it."""
    red, green, blue = (
        c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4
        for c in (part / 255 for part in color)
    )
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue
