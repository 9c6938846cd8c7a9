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
    """Return the frequency response by the local rational method, which removes transients.

    Over ``2 half_width + 1`` lines of the record each output obeys ``D Y = N U + C``. N (one per
    input), C (the transient, one per experiment) and D are polynomials; D is one at the estimated
    line. Linear least squares finds them without iteration. A resonance inside the window causes no
    bias. Source: McKelvey and Guérin (2012), Non-parametric frequency response estimation using a
    local rational model, IFAC SYSID.

    records
        :class:`~axisight.records.ArbitraryRecords`, or
        :class:`~axisight.records.PeriodicRecords` with consecutive periods, possibly not yet
        in steady state. The method joins the periods and uses all lines of the record; those between
        the harmonics determine transient and D. Any number of experiments, also fewer than inputs.
    order
        Order R of N and C, 0 to 8. For windows that are short relative to the record 2 is usually best.
    denominator_order
        Order of D, 0 to 8; None for ``order``; 0 is the local polynomial method. A higher order than
        needed does no harm without noise; with noise it increases the variance.
    half_width
        Half of the window, in lines of the record; None takes the smallest that leaves 12
        degrees of freedom, counted on excited lines.
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

    ``variance`` follows from the local residuals, which are ``D V`` for noise V that is white over the
    window; it is right to first order in the noise. For e experiments and windows of m lines the
    residuals have ``attrs["degrees_of_freedom"]``
    ``q = m e - (R + 1) (n_inputs + e) - denominator_order`` complex degrees of freedom. The band of
    probability p has radius ``sqrt(q ((1 - p) ** (-1 / q) - 1) variance)``. For several periods the
    variance includes the noise only and equals ``noise_variance``. Nonlinear distortion repeats with
    the period and lies on the harmonics, which are few of the window's lines.

    Bias: without noise there is none if the sampled system has no more than R poles; otherwise a
    small one from curvature beyond the orders. Noise adds a bias of second order, because Y is among
    the regressors. If the signal-to-noise ratio of single lines is below about 10, use a wider window
    or :func:`local_polynomial`. In closed loop noise at the input biases G like H1.

    ``condition`` is that of the scaled regressors of N. Lines are NaN and flagged if the inputs are
    not excited independently around them.

    Raises InputError for too few lines for the orders, and for lines out of range.
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
