"""Joint input-output estimate from the reference."""

from __future__ import annotations

import xarray as xr

from axisight.errors import InputError
from axisight.frf._lines import Quantity, expect_experiments, expect_options
from axisight.frf._multivariable import estimate
from axisight.records.periodic import PeriodicRecords


def joint_input_output(
    records: PeriodicRecords,
    *,
    quantity: Quantity = "position",
    remove_drift: bool = True,
    threads: int = 1,
) -> xr.Dataset:
    """Return G = G_yr G_ur^-1, from the responses of output and input to the reference.

    G_yr = Y R^+ and G_ur = U R^+ with the pseudo-inverse over all experiments. With as many
    experiments as inputs R cancels, and the result is that of `mfrf`. With many experiments, noise
    that does not come from R averages out of both responses. Wernholt (2004), section 3.4.2;
    Pintelon and Schoukens (2001), section 2.6.

    ``quantity``, ``remove_drift``, ``threads`` and the Dataset are those of `mfrf`. ``condition``
    is that of U.

    Bias: the bias from noise vanishes as the number of realizations of R grows, also in closed loop.
    With few experiments it is that of `mfrf`. For a nonlinear robot the estimate tends to the quotient
    of two best linear approximations, which is not the best linear approximation of the quotient.

    Raises InputError if the reference is missing or does not have one channel per input, and for
    fewer experiments than inputs.
    """
    expect_options(records, quantity, remove_drift, threads)
    if records.reference is None:
        raise InputError("records.reference: expected the recorded reference, got None")
    if records.reference.shape[3] != records.n_inputs:
        raise InputError(
            f"records.reference: expected one channel per input ({records.n_inputs}), "
            f"got {records.reference.shape[3]}"
        )
    expect_experiments(records, "the response from the reference has no unique solution")
    return estimate(
        records,
        "joint_input_output",
        by_reference=True,
        quantity=quantity,
        remove_drift=remove_drift,
        threads=threads,
    )
