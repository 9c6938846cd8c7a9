"""Local rational method."""

from __future__ import annotations

import xarray as xr

from axisight.arguments import whole
from axisight.frf import local_window
from axisight.frf._lines import Quantity
from axisight.frf.local_window import Lines, Records


def local_rational(
    records: Records,
    *,
    order: int = 2,
    denominator_order: int | None = None,
    half_width: int | None = None,
    lines: Lines | None = None,
    quantity: Quantity = "position",
    remove_drift: bool = False,
    threads: int = 0,
) -> xr.Dataset:
    """Return the frequency response by the local rational method, transients removed.

    Over ``2 half_width + 1`` lines of the record each output obeys ``D Y = N U + C`` with
    polynomials N (one per input), C (the transient, one per experiment) and D, equal to one
    at the line estimated; linear least squares, no iteration. A resonance inside the window
    costs no bias. Source: McKelvey and Guérin (2012), Non-parametric frequency response
    estimation using a local rational model, IFAC SYSID.

    records
        :class:`~axisight.records.ArbitraryRecords`, or
        :class:`~axisight.records.PeriodicRecords` with consecutive periods, possibly not yet
        in steady state: the periods are joined and all lines of the record used, those
        between the harmonics for transient and D. Any number of experiments, also fewer than
        inputs.
    order
        Order R of N and C, 0 to 8. Over windows short against the record 2 is usually best.
    denominator_order
        Order of D, 0 to 8; None for ``order``; 0 is the local polynomial method. One more than needed
        does no harm without noise and costs variance with it.
    half_width
        Half of the window, in lines of the record; None takes the least that leaves 12
        degrees of freedom counted on excited lines.
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

    ``variance`` follows from the local residuals, which are ``D V`` for noise V white over
    the window; it is right to first order in the noise. They have
    ``attrs["degrees_of_freedom"]`` ``q = m e - (R + 1) (n_inputs + e) - denominator_order``
    complex degrees of freedom for e experiments and windows of m lines; the band of
    probability p has radius ``sqrt(q ((1 - p) ** (-1 / q) - 1) variance)``. For several
    periods it holds the noise only (``noise_variance`` is equal to it): nonlinear distortion
    repeats with the period and lies on the harmonics, few of the window's lines.

    Bias: none without noise where the sampled system has no more than R poles; else
    curvature of what the orders cannot follow, which is small. With noise, of second order:
    Y stands among the regressors. Where the signal-to-noise ratio of single lines falls
    below about 10 prefer a wider window, or :func:`local_polynomial`. In closed loop noise
    at the input biases G as it does H1.

    ``condition`` is that of the scaled regressors of N. Lines around which the inputs are
    not excited independently are NaN and flagged.

    Raises InputError for too few lines for the orders and lines out of range.
    """
    order = whole("order", order, 0, local_window.HIGHEST_ORDER)
    if denominator_order is None:
        denominator_order = order
    data = local_window.whole(
        records, lines, quantity=quantity, remove_drift=remove_drift, threads=threads
    )
    return local_window.regression(
        records,
        data,
        estimator="local_rational",
        order=order,
        denominator_order=whole(
            "denominator_order", denominator_order, 0, local_window.HIGHEST_ORDER
        ),
        half_width=half_width,
        threads=threads,
    )
