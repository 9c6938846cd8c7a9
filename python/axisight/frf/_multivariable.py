"""The compiled estimate ``G = Y V`` as the Dataset of `frequency_response`."""

from __future__ import annotations

import numpy as np
import xarray as xr

from axisight import _core
from axisight.frf._lines import Quantity, line_factor, output_unit, provenance
from axisight.frf.response import frequency_response
from axisight.records.periodic import PeriodicRecords


def estimate(
    records: PeriodicRecords,
    estimator: str,
    *,
    by_reference: bool,
    quantity: Quantity,
    remove_drift: bool,
    threads: int,
) -> xr.Dataset:
    """Return ``G = Y V`` with ``V = U^+``, or ``V = R^+ (U R^+)^-1`` if ``by_reference``."""
    found = _core.multivariable(
        records.input,
        records.output,
        records.reference if by_reference else None,
        records.lines.tolist(),
        line_factor(records.frequency_hz, quantity),
        remove_drift=remove_drift,
        threads=threads,
    )
    noise = found["noise_variance"] if records.n_periods > 1 else None
    spare = records.n_experiments - records.n_inputs
    variance, freedom = noise, found["noise_freedom"]
    if spare:
        variance = found["residual_variance"]
        freedom = np.full(variance.shape, float(spare))
    return frequency_response(
        records.frequency_hz,
        found["response"],
        estimator=estimator,
        variance=variance,
        noise_variance=noise,
        condition=found["condition"],
        flag=found["flag"],
        degrees_of_freedom=freedom,
        input_unit=records.input_unit,
        output_unit=output_unit(records, quantity),
        attrs=provenance(records, quantity),
    )
