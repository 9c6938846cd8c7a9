"""The plots of an axis: which signals stand in one plot, under which labels and in which colours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import xarray as xr

from axisight.palette import AFTER, BEFORE
from axisight.signal_files.topics import POSITION, TORQUE

MEASURED = "#808080"
"""Colour of measured signals: viewers have a light and a dark background."""

# Signals without the ending of their quantity, with label and colour.
_COMPARED = (
    ("measured", "measured", MEASURED),
    ("simulated_before", "simulated as given", BEFORE),
    ("simulated_after", "simulated with causes", AFTER),
)
_RESIDUALS = (
    ("residual_before", "as given", BEFORE),
    ("residual_after", "with causes", AFTER),
)


@dataclass(frozen=True)
class Curve:
    """One signal in a plot: its ``name`` in the Dataset, ``base`` (that without the quantity), label and colour."""

    base: str
    quantity: str
    label: str
    color: str

    @property
    def name(self) -> str:
        """Name of the signal in the Dataset."""
        return self.base + self.quantity


@dataclass(frozen=True)
class Plot:
    """``kind``: torque, residual or angle; ``title`` with joint and unit; ``curves``, in the order of drawing."""

    kind: str
    title: str
    curves: tuple[Curve, ...]


def plots_of(data: xr.Dataset, axis: int) -> list[Plot]:
    """Return the plots of an axis (from 0) of a log: torques, residuals and positions, as far as the log has them."""
    joint, unit = str(data["joint"].values[axis]), str(data["unit"].values[axis])
    slides = unit == "N"
    torque, angle = ("force", "position") if slides else ("torque", "angle")
    rows = (
        ("torque", f"{torque} [{unit}]", TORQUE, _COMPARED),
        ("residual", f"simulated less measured {torque} [{unit}]", TORQUE, _RESIDUALS),
        ("angle", f"motor {angle} [{'m' if slides else 'rad'}]", POSITION, _COMPARED),
    )
    return [
        Plot(
            kind,
            f"{joint}: {what}",
            tuple(Curve(b, ending, label, c) for b, label, c in of if b + ending in data),
        )
        for kind, what, ending, of in rows
    ]


def front_title(data: xr.Dataset, axis: int) -> str:
    """Return the title of the first view."""
    return f"Largest gap: {data['joint'].values[axis]} in {data.attrs['log']}"


def log_title(data: xr.Dataset) -> str:
    """Return the title of a log's tab."""
    return f"{data.attrs['log']} ({data.attrs['role']})"


def in_order(signals: Sequence[xr.Dataset], front: int) -> list[int]:
    """Return the places of logs in the order of their tabs: that of the first view, validation logs, the others."""
    return sorted(
        range(len(signals)), key=lambda k: (k != front, signals[k].attrs["role"] != "validation")
    )
