"""The palette as style sheet: a page whose policy is strict has colours by class only."""

from __future__ import annotations

from axisight.palette import AFTER, BEFORE, MEASURED, cell_colors

# Finer than neighbouring colours can be told apart.
_STEPS = 40


def palette_css() -> str:
    """Return the colours of curves as variables, those of the cells of maps as classes."""
    curves = f":root {{ --measured: {MEASURED}; --before: {BEFORE}; --after: {AFTER}; }}"
    shades = []
    for step in range(_STEPS + 1):
        background, ink = cell_colors(step / _STEPS, 1.0)
        shades.append(f".shade-{step} {{ background: {background}; color: {ink}; }}")
    return "\n".join([curves, *shades])


def shade(share: float, limit: float) -> str:
    """Return the class of a finite share [1] on a scale from 0 to ``limit``."""
    return f"shade-{round(_STEPS * min(1.0, max(0.0, share / limit)))}"
