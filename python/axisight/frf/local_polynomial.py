"""Local polynomial method."""

from __future__ import annotations

import xarray as xr

from axisight import _core
from axisight.arguments import whole
from axisight.frf import local_window
from axisight.frf._lines import Quantity
from axisight.frf.local_window import Lines, Records
from axisight.records.periodic import PeriodicRecords


def local_polynomial(
    records: Records,
    *,
    order: int = 2,
    half_width: int | None = None,
    lines: Lines | None = None,
    quantity: Quantity = "position",
    remove_drift: bool = False,
    threads: int = 0,
) -> xr.Dataset:
    """Return the frequency response by the local polynomial method, transients removed.

    Source: Pintelon and Schoukens (2012), System Identification: A Frequency Domain
    Approach, chapter 7.

    records
        :class:`~axisight.records.ArbitraryRecords`: over ``2 half_width + 1`` lines of the
        record, ``Y = G U + T + V`` with G and the transient T (one per experiment)
        polynomials; any number of experiments, also fewer than inputs.
        :class:`~axisight.records.PeriodicRecords` of several periods, consecutive and
        possibly not yet in steady state: T is interpolated from ``2 half_width`` lines
        between the harmonics and subtracted from input and output at the harmonic, then
        ``G = Y U^-1`` (pseudo-inverse for more experiments than inputs). A single period is
        treated as an arbitrary record.
    order
        Order R of the polynomials, 0 to 8.
    half_width
        Half of the window, in lines; None takes the least that leaves 12 degrees of freedom.
    lines
        Lines to estimate: of the record for arbitrary records (None: all below half the
        sampling frequency), excited lines of the period for periodic ones (None: all).
    quantity
        Response to the recorded output ("position") or its first or second derivative: the
        estimate times i w or (i w)^2.
    remove_drift
        Remove from each output the linear drift that the means of its periods show
        (:func:`axisight.records.remove_drift`). Only for records in steady state: a transient
        passes for drift in part, and what is left no longer fits the model. A single record
        shows no drift; a ramp is a transient to the method.
    threads
        Threads; 0 for all. They do not change the result.

    ``variance`` is that of the local residuals carried through the estimate. Residuals of
    one output have ``attrs["degrees_of_freedom"]`` q complex degrees of freedom:
    ``m e - (R + 1) (n_inputs + e)`` for e experiments and windows of m lines, and
    ``e (m - R - 1)`` for several periods. As the variance is estimated, the exact band of
    probability p has radius ``sqrt(q ((1 - p) ** (-1 / q) - 1) variance)``. For several
    periods it holds the noise only: nonlinear distortion repeats with the period
    (``noise_variance`` is equal to it).

    Bias: curvature. For arbitrary records G and T must follow a polynomial of order R over
    the window; the bias is of the order ``(window / width of a resonance) ** (R + 1)`` and is
    not in the variance, though residuals grow with it. In closed loop noise at the input
    biases G as it does H1. For several periods only T must follow the polynomial: nothing
    smooths G, and the bias is that of the period-averaged MFRF.

    ``condition`` is that of the scaled regressors (several periods: of U). Lines around
    which the inputs are not excited independently are NaN and flagged.

    Raises InputError for too few lines for the order, lines out of range and, for several
    periods, fewer experiments than inputs.
    """
    order = whole("order", order, 0, local_window.HIGHEST_ORDER)
    data = local_window.whole(
        records, lines, quantity=quantity, remove_drift=remove_drift, threads=threads
    )
    if not isinstance(records, PeriodicRecords) or data.n_periods == 1:
        return local_window.regression(
            records,
            data,
            estimator="local_polynomial",
            order=order,
            denominator_order=0,
            half_width=half_width,
            threads=threads,
        )
    if half_width is None:
        per_experiment = -(-local_window.DEGREES_OF_FREEDOM // records.n_experiments)
        half_width = max(order + 2, -(-(per_experiment + order + 1) // 2))
    half_width = whole("half_width", half_width, 1)
    found = _core.frf_local_periodic(
        data.input,
        data.output,
        data.lines.tolist(),
        n_periods=data.n_periods,
        order=order,
        half_width=half_width,
        threads=threads,
    )
    attrs = {"order": order, "half_width": half_width}
    return local_window.dataset(records, data, found, "local_polynomial", attrs)
