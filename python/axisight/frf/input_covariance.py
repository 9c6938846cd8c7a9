"""Covariance between the elements of a response, from the measured input."""

from __future__ import annotations

import numpy as np
import xarray as xr

from axisight.arguments import instance, whole
from axisight.errors import InputError
from axisight.frf._lines import SMALLEST, line_factor, line_spectra
from axisight.frf._reference_window import windows_of
from axisight.frf.confidence import median_freedom, with_freedom
from axisight.frf.quantity import quantity_of
from axisight.frf.response import estimate_of
from axisight.records.periodic import PeriodicRecords

_DIMS = ("frequency_hz", "element", "element_2")


def with_input_covariance(
    dataset: xr.Dataset, records: PeriodicRecords, *, half_width: int = 10
) -> xr.Dataset:
    """Return an estimate ``Y U^+`` with the covariance of its elements.

    An error V of the output reaches the estimate as ``V U^+``. If the noise is independent between
    outputs and between experiments, the elements of one output have the covariance
    ``E|V_o|^2 sum_e (U^+)_ei conj((U^+)_ej)``. With coupled axes the correlation is close to one at
    resonances, so a fit that leaves it out wastes most of what an experiment tells there. The power of
    the noise is taken to be smooth over the lines, other than the amplitudes. Wernholt (2004), Lemma 6.1.

    dataset
        Estimate of `local_polynomial` or `mfrf` from ``records``, with its variance.
    records
        The records, with as many experiments as inputs, or more.
    half_width
        Lines on either side over which the power of the noise is averaged.

    ``covariance`` is (frequency_hz, element, element_2), elements row by row; ``variance`` is its
    diagonal, and ``degrees_of_freedom`` count the averaged lines. For a fit:
    ``MeasuredResponse.of(angles, found, covariance=found["covariance"])``.

    Raises InputError if the dataset does not fit the records.
    """
    estimate_of("dataset", dataset)
    instance("records", records, PeriodicRecords)
    half = whole("half_width", half_width, 0)
    n, outputs, inputs = dataset["variance"].shape
    places = np.searchsorted(records.frequency_hz, dataset["frequency_hz"].values * (1 - 1e-9))
    fits = inputs == records.n_inputs and outputs == records.n_outputs
    if not fits or places.max(initial=0) >= len(records.lines):
        raise InputError(
            f"dataset: expected a response of these records, {records.n_outputs} by "
            f"{records.n_inputs} at {len(records.lines)} lines, got {outputs} by {inputs} at {n}"
        )
    u = line_spectra(records.input, records.lines[places]).mean(axis=3)
    columns = np.linalg.pinv(u, rcond=SMALLEST)
    shared = np.einsum("kei,kej->kij", columns, columns.conj())
    own = np.einsum("kii->ki", shared).real
    count = min(2 * half + 1, n)
    squared = np.abs(line_factor(dataset["frequency_hz"].values, quantity_of(dataset))) ** 2
    power = np.mean(dataset["variance"].values / own[:, None, :], axis=2) / squared[:, None]
    power = np.nanmean(power[windows_of(np.arange(n), count)], axis=1) * squared[:, None]
    lost = np.isnan(dataset["variance"].values).any(axis=(1, 2))
    power[lost] = np.nan
    covariance = np.einsum("ko,op,kij->koipj", power, np.eye(outputs), shared)
    variance = power[:, :, None] * own[:, None, :]
    size = outputs * inputs
    names = [f"{o},{i}" for o in dataset["output"].values for i in dataset["input"].values]
    unit = dataset["variance"].attrs.get("units", "")
    found = dataset.assign(
        variance=dataset["variance"].copy(data=variance),
        covariance=(_DIMS, covariance.reshape(n, size, size), {"units": unit}),
    ).assign_coords(element=names, element_2=names)
    freedom = median_freedom(dataset)
    if freedom is None:
        return found
    return with_freedom(found, np.full(variance.shape, freedom * count))
