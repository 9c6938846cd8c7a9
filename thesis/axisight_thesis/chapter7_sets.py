"""Sets of experiments that several items of chapter 7 draw on, and their sizes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight_thesis.chapter7_figure import reference
from axisight_thesis.chapter7_machine import REAL, Machine, small_signal_response
from axisight_thesis.chapter7_measures import LOW_HZ
from axisight_thesis.chapter7_records import Records, periods, records
from axisight_thesis.chapter7_setting import FIRST_LINE, LAST_LINE, PERIOD_S, PERIODS, Design
from axisight_thesis.context import Context
from axisight_thesis.element_plot import Curve

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

FREQUENCY_HZ: Real = np.arange(FIRST_LINE, LAST_LINE + 1) / PERIOD_S
LOW = FREQUENCY_HZ <= LOW_HZ
STANDARD = Design()


def repeats(context: Context) -> int:
    """Return the number of experiments in an average, five as in the thesis."""
    return 3 if context.quick else 5


def four_periods(context: Context, design: Design = STANDARD, machine: Machine = REAL) -> Records:
    """Return four periods of one experiment."""
    return records(context, design, (0,), periods(PERIODS), machine)


def different(
    context: Context,
    design: Design = STANDARD,
    machine: Machine = REAL,
    count: int | None = None,
) -> Complex:
    """Return one estimate from each of several realizations, (realization, n_freq, 3, 3).

    Each comes from one period, because more periods change nothing (figure 7.3).
    """
    taken = records(context, design, range(count or repeats(context)), machine=machine)
    return taken.responses()[:, 0]


def many(context: Context, design: Design = STANDARD, machine: Machine = REAL) -> Complex:
    """Return estimates of twenty realizations (quick: six), (realization, n_freq, 3, 3)."""
    return different(context, design, machine, 6 if context.quick else 20)


def linear(context: Context) -> Complex:
    """Return the response of the machine without dry friction, (n_freq, 3, 3)."""
    return context.shared("chapter7 linear", lambda: small_signal_response(context, FREQUENCY_HZ))


def linear_curve(context: Context) -> Curve:
    """Return the curve of the response of `linear`."""
    return reference(FREQUENCY_HZ, linear(context))
