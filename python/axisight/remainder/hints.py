"""What a term looks like: the nearest of a few plain shapes, and what differs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from axisight.remainder.terms import Term

Array = NDArray[np.float64]

SHAPES: Mapping[str, Callable[[Array], Array]] = {
    "constant": np.ones_like,
    "grows in proportion": lambda x: x,
    "grows with the size, in both directions": np.abs,
    "grows with the square": lambda x: x**2,
    "steps at zero": lambda x: np.tanh(20 * x),
    "is largest near zero and falls off": lambda x: np.exp(-20 * np.abs(x)),
    "rises and levels off": lambda x: 1 - np.exp(-5 * np.abs(x)),
    "acts only above zero": lambda x: np.maximum(x, 0.0),
    "acts only below zero": lambda x: np.maximum(-x, 0.0),
}
"""Shapes by their words, as functions of a variable over its largest size; plain shapes come first."""

# Share of a function's variation by which a shape must be nearer than a plainer one.
_CLEARLY = 0.03
# Share of the function's variation from which a shape is named.
_NEAR = 0.7


def hint_of(term: Term) -> Term:
    """Return the term with a hint in words: the nearest shape, and how far the function differs from it."""
    return replace(term, hint=_words(term))


def _words(term: Term) -> str:
    if term.variable == "constant":
        return "it is constant"
    if term.period is not None:
        return f"it repeats every {term.period:.4g} {term.x_unit}"
    name, share = nearest_shape(term.x, term.value)
    if share < _NEAR:
        return "it has a shape of its own"
    return f"it {name if name != 'constant' else 'is nearly constant'} ({100 * share:.0f} % of it)"


def nearest_shape(x: Array, value: Array) -> tuple[str, float]:
    """Return the words of the nearest shape and its share of the mean square of a function (m,) [1].

    A shape other than a constant may have a constant beside it. The points count alike.
    """
    size = max(float(np.abs(x).max()), 1e-300)
    total = max(float(value @ value), 1e-300)
    best, share = "", -np.inf
    for name, shape in SHAPES.items():
        column = shape(x / size)
        columns = np.stack([column] if name == "constant" else [column, np.ones_like(x)], axis=1)
        left = value - columns @ np.linalg.lstsq(columns, value, rcond=None)[0]
        explained = 1 - float(left @ left) / total
        if explained > share + _CLEARLY:
            best, share = name, explained
    return best, share
