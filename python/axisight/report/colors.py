"""The palette as a style sheet: pages with a strict content policy take colours from classes only."""

from __future__ import annotations

from axisight.palette import AFTER, BEFORE, MEASURED, cell_colors

# Finer steps than the eye can separate.
_STEPS = 40


def palette_css() -> str:
    """Return CSS: curve colours as variables, map cell colours as classes."""
    curves = f":root {{ --measured: {MEASURED}; --before: {BEFORE}; --after: {AFTER}; }}"
    shades = []
    for step in range(_STEPS + 1):
        background, ink = cell_colors(step / _STEPS, 1.0)
        shades.append(f".shade-{step} {{ background: {background}; color: {ink}; }}")
    return "\n".join([curves, *shades])


def shade(share: float, limit: float) -> str:
    """Return the class of a finite share [1] on a scale from 0 to ``limit``."""
    return f"shade-{round(_STEPS * min(1.0, max(0.0, share / limit)))}"
