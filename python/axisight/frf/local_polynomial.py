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
    """Return the frequency response by the local polynomial method, which removes transients.

    Source: Pintelon and Schoukens (2012), System Identification: A Frequency Domain
    Approach, chapter 7.

    records
        :class:`~axisight.records.ArbitraryRecords`: over ``2 half_width + 1`` lines of the
        record, ``Y = G U + T + V``, where G and the transient T (one per experiment) are
        polynomials; any number of experiments, also fewer than inputs.
        :class:`~axisight.records.PeriodicRecords` of several consecutive periods, possibly not yet
        in steady state: the method interpolates T from ``2 half_width`` lines between the harmonics
        and subtracts it from input and output at the harmonic. Then ``G = Y U^-1``, with the
        pseudo-inverse for more experiments than inputs. A single period counts as an arbitrary record.
    order
        Order R of the polynomials, 0 to 8.
    half_width
        Half of the window, in lines; None takes the smallest that leaves 12 degrees of freedom.
    lines
        Lines to estimate: of the record for arbitrary records (None: all below half the
        sampling frequency), excited lines of the period for periodic ones (None: all).
    quantity
        Response to the recorded output ("position") or its first or second derivative: the
        estimate times i w or (i w)^2.
    remove_drift
        Remove from each output the linear drift of the means of its periods
        (:func:`axisight.records.remove_drift`). Use it only for records in steady state: part of a
        transient looks like drift, and the rest no longer fits the model. A single record has no
        measurable drift; the method treats a ramp as a transient.
    threads
        Number of threads, 0 for all cores; it does not change the result.

    ``variance`` follows from the local residuals. The residuals of one output have
    ``attrs["degrees_of_freedom"]`` q complex degrees of freedom:
    ``m e - (R + 1) (n_inputs + e)`` for e experiments and windows of m lines, and
    ``e (m - R - 1)`` for several periods. As the variance is estimated, the exact band of
    probability p has radius ``sqrt(q ((1 - p) ** (-1 / q) - 1) variance)``. For several periods the
    variance includes the noise only and equals ``noise_variance``, because nonlinear distortion
    repeats with the period.

    Bias: for arbitrary records it comes from curvature, because G and T must follow a polynomial of
    order R over the window. It is of the order ``(window / width of a resonance) ** (R + 1)``. It is
    not in the variance, though residuals grow with it. In closed loop noise at the input biases G
    like H1. For several periods only T must follow the polynomial; G is not smoothed, and the bias is
    that of the period-averaged MFRF.

    ``condition`` is that of the scaled regressors (several periods: of U). Lines are NaN and flagged
    if the inputs are not excited independently around them.

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
