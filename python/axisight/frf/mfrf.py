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
    """Return G = Y U^-1 at the excited lines, from averaged periods.

    Columns of Y and U are experiments: Wernholt (2004), (3.52) and (3.53). With more
    experiments than inputs U^-1 is the pseudo-inverse, that is, least squares over all
    experiments. Realizations need not be synchronized.

    quantity
        Output of the response: the recorded output ("position"), or its first or second derivative,
        with the spectrum times i w or (i w)^2.
    remove_drift
        Remove from each output of each experiment the linear drift of the means of its periods
        (a single period has no measurable drift).
    covariance
        "full" adds ``covariance`` (frequency_hz, element, element_2), complex and Hermitian:
        ``E dG_a conj(dG_b)`` of the elements (output, input), counted as in
        ``response.reshape(n_freq, -1)`` and named "output,input". Its diagonal is
        ``variance``. With several periods, ``noise_covariance`` is the same for ``noise_variance``.
        Both have full rank only with at least n_out degrees of freedom: n_out + 1 periods, or n_out
        more experiments than inputs.
    threads
        Number of threads for the transforms, 0 for every core; the result does not depend on it.

    Returns the Dataset of `axisight.frf.frequency_response` with ``degrees_of_freedom``.
    ``noise_variance`` comes from the scatter of the periods, through
    vec(dG) = (U^-T kron I) vec(dY - G dU). With as many experiments as inputs, ``variance`` equals
    it: nonlinear distortion repeats with the period and is then invisible. With more experiments,
    ``variance`` comes from the residuals Y - G U and includes noise and distortion. With one period
    and as many experiments as inputs it is NaN.

    Bias: exact without noise and distortion. In closed loop, noise that the controller feeds back
    correlates with U. To second order it pulls G towards minus the inverse of the controller, by
    about the noise-to-signal power ratio of U. Averaging divides that ratio by the number of periods.

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
