"""The multivariable frequency-response estimate ``Y U^-1``."""

from __future__ import annotations

from typing import Literal

import xarray as xr

from axisight.arguments import one_of
from axisight.frf._covariance import with_covariance
from axisight.frf._lines import Quantity, expect_experiments, expect_options, spectra
from axisight.frf._multivariable import estimate
from axisight.records.periodic import PeriodicRecords


def mfrf(
    records: PeriodicRecords,
    *,
    quantity: Quantity = "position",
    remove_drift: bool = True,
    covariance: Literal["elements", "full"] = "elements",
    threads: int = 1,
) -> xr.Dataset:
    """Estimate G = Y U^-1 on the excited lines, periods averaged first.

    Columns of Y and U are experiments: Wernholt (2004), (3.52) and (3.53). With more
    experiments than inputs U^-1 is the pseudo-inverse, that is least squares over all
    experiments; it wants synchronized realizations no more than (3.52) does.

    quantity
        Response to the recorded output ("position") or its first or second derivative: the
        spectrum times i w or (i w)^2.
    remove_drift
        Remove from each output of each experiment the linear drift that the means of its
        periods show (one period shows none).
    covariance
        "full" adds ``covariance`` (frequency_hz, element, element_2), complex and Hermitian:
        ``E dG_a conj(dG_b)`` of the elements (output, input), counted as in
        ``response.reshape(n_freq, -1)`` and named "output,input". Its diagonal is
        ``variance``. ``noise_covariance`` is the same for ``noise_variance``, with several
        periods. Of full rank only with at least n_out degrees of freedom: n_out + 1 periods,
        or n_out more experiments than inputs.
    threads
        Threads for the transforms, 0 for every core; the result does not depend on it.

    Returns the Dataset of `axisight.frf.frequency_response` with ``degrees_of_freedom``.
    ``noise_variance`` comes from the scatter of the periods, through
    vec(dG) = (U^-T kron I) vec(dY - G dU). ``variance`` is the same with as many experiments
    as inputs: nonlinear distortion repeats with the period and is then invisible. With more
    experiments ``variance`` comes from what they leave of Y - G U and holds both. One period
    and as many experiments as inputs: NaN.

    Bias: exact without noise and distortion. In closed loop, noise that the controller feeds
    back correlates with U: to second order G is pulled towards minus the inverse of the
    controller, by about the noise-to-signal power ratio of U; averaging periods divides that
    ratio by their number.

    Raises InputError for fewer experiments than inputs.
    """
    expect_options(records, quantity, remove_drift, threads)
    expect_experiments(records, "Y U^-1 has no unique solution at any line")
    one_of("covariance", covariance, ("elements", "full"))
    dataset = estimate(
        records,
        "mfrf",
        by_reference=False,
        quantity=quantity,
        remove_drift=remove_drift,
        threads=threads,
    )
    if covariance == "full":
        u, y = spectra(records, quantity, remove_drift=remove_drift, threads=threads)
        return with_covariance(dataset, u, y)
    return dataset
