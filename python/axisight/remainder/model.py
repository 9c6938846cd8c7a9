"""A fitted remainder: its terms, its torque along any motion, and its tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.remainder.records import Motion
from axisight.remainder.terms import Term

Array = NDArray[np.float64]


@summarized
@dataclass(frozen=True, eq=False)
class Remainder:
    """The modelled remainder of all axes: a sum of terms, bounded by what the data showed.

    ``terms``: in the order of choice, axis by axis. ``limits_nm`` (n_axes,): largest size of the sum along the
    estimation data [Nm]; a larger torque is cut to it.
    ``held_out_nm`` (n_axes,): rms error on held-out data, weighted as the records [Nm].
    """

    terms: tuple[Term, ...]
    limits_nm: Array
    held_out_nm: Array

    @property
    def n_axes(self) -> int:
        """Number of axes."""
        return len(self.limits_nm)

    def of_axis(self, axis: int) -> tuple[Term, ...]:
        """Return the terms of an axis (from 1)."""
        return tuple(t for t in self.terms if t.axis == axis)

    def torque(self, motion: Motion) -> Array:
        """Return the torque (n, n_axes) [Nm], motor side, that the simulator lacks along a motion.

        Raises InputError if the motion has other axes, or lacks a temperature on which a term depends.
        """
        if motion.n_axes != self.n_axes:
            raise InputError(f"motion: expected {self.n_axes} axes, got {motion.n_axes}")
        if motion.temperature_c is None and any(t.variable == "temperature" for t in self.terms):
            raise InputError("temperature_c: expected the temperatures of the axes, got none")
        out = np.zeros((len(motion.time_s), self.n_axes))
        for term in self.terms:
            out[:, term.axis - 1] += term.torque(motion)
        return np.clip(out, -self.limits_nm, self.limits_nm)

    def dataset(self) -> xr.Dataset:
        """Return the terms as a Dataset with dims (term, point).

        ``x``, ``value`` and ``standard_error`` (term, point); shorter tables end with NaN. ``gain`` [1] and
        ``significance`` (term,), and what a term is as coordinates of ``term``.
        """
        longest = max((len(t.x) for t in self.terms), default=0)
        terms: Sequence[Term] = self.terms

        def padded(name: str) -> Array:
            out = np.full((len(terms), longest), np.nan)
            for row, term in zip(out, terms, strict=True):
                row[: len(term.x)] = getattr(term, name)
            return out

        return xr.Dataset(
            {name: (("term", "point"), padded(name)) for name in ("x", "value", "standard_error")}
            | {
                name: ("term", [getattr(t, name) for t in terms], {"units": "1"})
                for name in ("gain", "significance")
            },
            coords={
                name: ("term", [getattr(t, name) for t in terms])
                for name in (
                    "axis",
                    "acts",
                    "variable",
                    "of_axis",
                    "unit",
                    "x_unit",
                    "words",
                    "hint",
                )
            },
            attrs={"side": "motor"},
        )
