"""Models whose simulation diverges: a possible result of a fit, or an error."""

from __future__ import annotations

from typing import TypeVar

from axisight._core import Diverged
from axisight.errors import InputError

__all__ = ["Diverged", "must_hold"]

A = TypeVar("A")


def must_hold(found: A | Diverged) -> A:
    """Return ``found``, or raise InputError if the model diverges."""
    if isinstance(found, Diverged):
        raise InputError(str(found))
    return found
