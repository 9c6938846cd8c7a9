"""Confidence bands of estimated frequency responses."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.arguments import between
from axisight.errors import InputError
from axisight.frf.response import DIMS, estimate_of


def confidence_radius(dataset: xr.Dataset, probability: float = 0.95) -> xr.DataArray:
    """Return the radius of the disc about each element of G that holds the truth with ``probability``.

    The error is assumed circular complex normal. An estimated variance with nu complex degrees of
    freedom widens the disc, because |dG|^2 / variance is F(2, 2 nu):

        radius^2 = variance nu ((1 - probability)^(-1/nu) - 1)

    Here nu is ``degrees_of_freedom``, a variable or an attribute of the Dataset. For a known variance
    the radius^2 tends to ``-variance ln(1 - probability)``. With eight periods and one experiment
    (nu = 7) the disc is 12 % wider, with two periods (nu = 1) 2.5 times as wide.

    Returns a DataArray shaped as ``variance``, NaN where the variance is unknown. Raises InputError for
    a probability outside (0, 1) or a Dataset without variance.
    """
    probability = between("probability", probability, 0, 1)
    estimate_of("dataset", dataset)
    variance = dataset["variance"]
    scale = np.full(variance.shape, -np.log1p(-probability))
    freedom = dataset.get("degrees_of_freedom", dataset.attrs.get("degrees_of_freedom"))
    if freedom is not None:
        freedom = np.broadcast_to(np.asarray(freedom, float), scale.shape)
        known = np.isfinite(freedom) & (freedom > 0)
        nu = freedom[known]
        scale[known] = nu * np.expm1(-np.log1p(-probability) / nu)
    units = dataset["response"].attrs.get("units", "")
    radius: xr.DataArray = variance.copy(data=np.sqrt(variance.values * scale))
    radius.attrs = {"units": units, "probability": probability}
    return radius.rename("confidence_radius")


def with_freedom(dataset: xr.Dataset, freedom: NDArray[np.float64]) -> xr.Dataset:
    """Return the Dataset with complex degrees of freedom of ``variance``, (n_freq, n_out, n_in)."""
    return dataset.assign(degrees_of_freedom=(DIMS, freedom, {"units": "1"}))


def median_freedom(dataset: xr.Dataset) -> float | None:
    """Return the median over the lines of the complex degrees of freedom of ``variance``.

    None without degrees of freedom or with infinite ones, because the variance then counts as known,
    and None without a variance. Raises InputError for numbers that are not positive.
    """
    found = dataset.get("degrees_of_freedom", dataset.attrs.get("degrees_of_freedom"))
    if found is None or "variance" not in dataset or dataset["variance"].isnull().all():
        return None
    values = np.asarray(found, float)
    values = values[~np.isnan(values)]
    if not values.size or (values <= 0).any():
        got = values.min() if values.size else np.nan
        raise InputError(f"degrees_of_freedom: expected positive numbers, got {got}")
    middle = float(np.median(values))
    return middle if np.isfinite(middle) else None
