"""Models that do not hold: an answer of a fit, and an error only where one has to hold."""

from __future__ import annotations

from typing import TypeVar

from axisight._core import Diverged
from axisight.errors import InputError

__all__ = ["Diverged", "must_hold"]

A = TypeVar("A")


def must_hold(found: A | Diverged) -> A:
    """Return what was found where nothing goes on without; raises InputError where the model does not hold."""
    if isinstance(found, Diverged):
        raise InputError(str(found))
    return found
