"""Which lines of a response a rational fit uses, and how it weighs them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.blackbox._data import Complex, Real
from axisight.errors import InputError
from axisight.frf.confidence import median_freedom
from axisight.frf.pooled import (
    OwnWeights,
    check_neighbours,
    neighbours_for,
    pooled_variance,
)
from axisight.frf.response import DIMS

Weighting = Literal["variance", "relative", "absolute"]


@dataclass(frozen=True)
class UsableLines:
    """Finite lines of a response, and the data of their weights.

    ``frequency_hz`` (n_freq,) and ``values`` (n_freq, n_out, n_in). ``variance`` is None unless it
    sets the weights. ``degrees_of_freedom`` are complex ones of the variance, None if the variance
    is known. ``neighbours`` is the number of other lines that set the weight of a line; with 0 a line
    is weighted by its own variance.
    """

    frequency_hz: Real
    values: Complex
    weighting: Weighting
    variance: Real | None
    degrees_of_freedom: float | None
    neighbours: int

    @property
    def own(self) -> OwnWeights:
        """Corrections for weights from the lines' own variances; none for known or pooled ones."""
        if self.variance is None or self.neighbours:
            return OwnWeights()
        return OwnWeights.of(self.degrees_of_freedom)

    def weights(self, magnitude: Real) -> tuple[Real, Real]:
        """Return the weights, and the variance of the real or imaginary part of a weighted residual.

        ``magnitude`` is that of the response, from the best model so far.
        """
        if self.variance is None:
            weight = 1 / np.abs(self.values) if self.weighting == "relative" else 1.0
            return np.broadcast_to(weight, self.values.shape), np.ones(self.values.shape)
        weighing = self.variance
        if self.neighbours and self.degrees_of_freedom is not None:
            weighing = pooled_variance(
                magnitude, self.variance, self.degrees_of_freedom, self.neighbours
            )
        # Real and imaginary parts each carry half the variance.
        return np.sqrt(2 / weighing), self.variance / weighing


def usable_lines(response: xr.Dataset, weighting: str, neighbours: int | None) -> UsableLines:
    """Return the finite lines of a response; raises InputError if there are none."""
    check_neighbours(neighbours)
    if neighbours and weighting != "variance":
        raise InputError(
            f"neighbours: expected None or 0 with weighting={weighting!r}, got {neighbours}"
        )
    if weighting not in get_args(Weighting):
        raise InputError(
            f"weighting: expected 'variance', 'relative' or 'absolute', got {weighting!r}"
        )
    found = response.get("response") if isinstance(response, xr.Dataset) else None
    if found is None or set(found.dims) != set(DIMS):
        raise InputError(f"response: expected a Dataset with a variable response over {DIMS}")
    g = np.asarray(found.transpose(*DIMS).values, np.complex128)
    f = np.asarray(response["frequency_hz"].values, np.float64)
    good: NDArray[np.bool_] = np.asarray(np.isfinite(g).all(axis=(1, 2)))
    lines = UsableLines(f, g, weighting, None, None, 0)  # type: ignore[arg-type]
    if weighting == "variance":
        variance = _variance(response)
        good &= np.asarray(np.isfinite(variance).all(axis=(1, 2)) & (variance > 0).all(axis=(1, 2)))
        if not good.any():
            raise InputError(
                "response: expected a positive variance at some line, got none; or choose "
                "weighting='relative'"
            )
        freedom = median_freedom(response)
        if neighbours and freedom is None:
            raise InputError(
                f"neighbours: expected a response with degrees_of_freedom to pool {neighbours} "
                "lines, got one without"
            )
        count = neighbours_for(freedom, int(good.sum()), neighbours)
        lines = replace(
            lines, variance=variance[good], degrees_of_freedom=freedom, neighbours=count
        )
    elif weighting == "relative":
        good &= np.asarray((g != 0).all(axis=(1, 2)))
    if not good.any():
        raise InputError("response: expected a line with numbers, got NaN or zero at all of them")
    return replace(lines, frequency_hz=f[good], values=g[good])


def _variance(response: xr.Dataset) -> Real:
    known = response.get("variance")
    if known is None:
        raise InputError("response: expected a variance; or choose weighting='relative'")
    return np.asarray(known.transpose(*DIMS).values, np.float64)
