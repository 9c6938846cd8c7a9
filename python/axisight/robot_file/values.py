"""Shared steps from a result to identified values: propagate the uncertainty, and add notes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight.effects import Effect
from axisight.errors import InputError
from axisight.robot_file.identified import Identified, Provenance, identified

Array = NDArray[np.float64]

UNPLACED = "no_place"
"""Key in the settings for results that a robot file cannot state."""


def values_of(
    values: Mapping[str, float],
    jacobian: Array,
    covariance: Array,
    provenance: Provenance,
    *,
    effects: Iterable[Effect] = (),
    removed: Iterable[Effect] = (),
) -> Identified:
    """Return identified ``values`` with the covariance propagated from the numbers they were computed from.

    ``jacobian`` (len(values), n) holds the derivatives by the n numbers of ``covariance`` (n, n); a row of
    zeros is a fixed value. If the covariance is not finite, the result has no covariance, and only the
    standard errors that do not depend on such elements.
    """
    spread = np.full((len(values), len(values)), np.nan)
    used = [np.flatnonzero(row) for row in jacobian]
    for i, one in enumerate(used):
        for j, other in enumerate(used):
            part = covariance[np.ix_(one, other)]
            spread[i, j] = jacobian[i, one] @ part @ jacobian[j, other]
    spread = (spread + spread.T) / 2
    errors = np.sqrt(np.maximum(np.diag(spread), 0.0))
    known = bool(np.isfinite(spread).all())
    return identified(
        values,
        provenance,
        standard_errors=None
        if known
        else {n: float(e) for n, e in zip(values, errors, strict=True) if np.isfinite(e)},
        covariance=spread if known else None,
        effects=tuple(effects),
        removed=tuple(removed),
    )


def noted(
    provenance: Provenance, notes: Iterable[str], unplaced: Mapping[str, Any] | None = None
) -> Provenance:
    """Return ``provenance`` with more notes, one per line, and the ``unplaced`` results in its settings.

    Raises InputError for an object that is not a `Provenance`.
    """
    if not isinstance(provenance, Provenance):
        raise InputError(f"provenance: expected a Provenance, got {type(provenance).__name__}")
    text = "\n".join([*([provenance.notes] if provenance.notes else []), *notes])
    settings = dict(provenance.settings)
    if unplaced:
        settings[UNPLACED] = dict(unplaced)
    return replace(provenance, notes=text, settings=settings)
