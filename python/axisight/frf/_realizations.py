"""Responses of single realizations, and averages with variances from their scatter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.arguments import one_of, several, switch, threads_of
from axisight.errors import InputError
from axisight.frf._lines import ORDER, Quantity, expect_experiments
from axisight.frf.confidence import with_freedom
from axisight.frf.mfrf import mfrf
from axisight.frf.response import Flag, estimate_of, frequency_response
from axisight.records.periodic import PeriodicRecords

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]
Realizations = PeriodicRecords | xr.Dataset | Sequence[xr.Dataset] | Sequence[PeriodicRecords]


@dataclass
class Stack:
    """Responses (realization, n_freq, n_out, n_in); a lost line of a realization is NaN."""

    frequency_hz: Real
    response: Complex
    noise: Real
    freedom: Real
    condition: Real
    flag: NDArray[np.int8]
    attrs: dict[str, Any]

    @property
    def usable(self) -> NDArray[np.bool_]:
        """Where a realization has an estimate, (realization, n_freq, 1, 1)."""
        return np.asarray(np.isfinite(self.response).all(axis=(2, 3), keepdims=True))

    def mean(self, values: Complex) -> Complex:
        """Return the mean over the usable realizations, NaN without any."""
        usable = self.usable
        count = usable.sum(axis=0)
        total = np.where(usable, values, 0).sum(axis=0)
        nothing = np.full(total.shape, np.nan, np.complex128)
        return np.asarray(np.divide(total, count, out=nothing, where=count > 0))


def stack(data: Realizations, quantity: Quantity, remove_drift: bool, threads: int) -> Stack:
    """Return the responses of all realizations; records are first estimated by `mfrf`."""

    def estimated(records: PeriodicRecords) -> xr.Dataset:
        return mfrf(records, quantity=quantity, remove_drift=remove_drift, threads=threads)

    one_of("quantity", quantity, ORDER)
    switch("remove_drift", remove_drift)
    threads_of(threads)
    if isinstance(data, PeriodicRecords):
        return _gather([estimated(r) for r in split(data)])
    if isinstance(data, xr.Dataset):
        if "realization" not in data.dims:
            return _gather([estimate_of("data", data)])
        each = [data.isel(realization=i) for i in range(data.sizes["realization"])]
        return _gather([estimate_of("data", one) for one in each])
    found: list[xr.Dataset] = []
    for item in several("data", data):
        if isinstance(item, PeriodicRecords):
            found += [estimated(r) for r in split(item)]
        else:
            found.append(estimate_of("data", item))
    if not found:
        raise InputError("data: expected at least one realization, got none")
    return _gather(found)


def split(records: PeriodicRecords) -> list[PeriodicRecords]:
    """Return one record set per realization of n_inputs consecutive experiments."""
    n = records.n_inputs
    expect_experiments(records, "not one whole realization")
    if records.n_experiments % n:
        raise InputError(
            f"records: expected realizations of {n} experiments each, got "
            f"{records.n_experiments} experiments: {records.n_experiments % n} left over"
        )

    def part(first: int) -> PeriodicRecords:
        own = slice(first, first + n)
        reference = None if records.reference is None else records.reference[own]
        return replace(
            records, input=records.input[own], output=records.output[own], reference=reference
        )

    if records.n_experiments == n:
        return [records]
    return [part(first) for first in range(0, records.n_experiments, n)]


def _gather(datasets: Sequence[xr.Dataset]) -> Stack:
    first = datasets[0]
    frequency = first["frequency_hz"].values
    for i, other in enumerate(datasets):
        same = other["response"].shape == first["response"].shape and np.allclose(
            other["frequency_hz"].values, frequency, rtol=1e-9, atol=0
        )
        kinds = ("quantity", "input_unit", "output_unit")
        unlike = [k for k in kinds if other.attrs.get(k) != first.attrs.get(k)]
        if unlike:
            raise InputError(
                f"data: expected {unlike[0]} {first.attrs.get(unlike[0])!r} as in realization 1, "
                f"got {other.attrs.get(unlike[0])!r} in realization {i + 1}"
            )
        if not same:
            raise InputError(
                f"data: expected the frequencies and channels of realization 1 everywhere, "
                f"realization {i + 1} differs"
            )

    def each(name: str, otherwise: str | None = None) -> NDArray[Any]:
        def of(d: xr.Dataset) -> NDArray[Any]:
            if name in d:
                return np.asarray(d[name].values)
            return np.full(d["response"].shape, np.nan) if not otherwise else of_other(d)

        def of_other(d: xr.Dataset) -> NDArray[Any]:
            return np.asarray(d[otherwise].values)

        return np.stack([of(d) for d in datasets])

    return Stack(
        frequency,
        each("response"),
        each("noise_variance", "variance"),
        each("degrees_of_freedom"),
        each("condition"),
        each("flag"),
        dict(first.attrs),
    )


def averaged(
    found: Stack, estimator: str, response: Complex, deviation: Complex, **attrs: Any
) -> xr.Dataset:
    """Return the Dataset of an average whose error is the mean of ``deviation`` over realizations.

    ``deviation`` (realization, n_freq, n_out, n_in) is the linearized difference of each realization
    from the average. A single realization keeps the variance of its periods.
    """
    usable = found.usable
    count = usable.sum(axis=0) * np.ones(response.shape, int)
    with np.errstate(divide="ignore", invalid="ignore"):
        # Subtracting the mean, zero to first order, leaves the scatter only.
        centre = found.mean(deviation)
        square = np.where(usable, np.abs(deviation - centre) ** 2, 0.0).sum(axis=0)
        scatter = square / (count * (count - 1.0))
        noise = np.where(usable, found.noise, 0.0).sum(axis=0) / count**2.0
        freedom = np.where(usable, found.freedom, 0.0).sum(axis=0)
    several = count > 1
    lost = count == 0
    flag = np.where(usable[:, :, 0, 0], found.flag, Flag.GOOD).max(axis=0)
    flag = np.where(lost[:, 0, 0], found.flag.max(axis=0), flag)
    # The worst condition over the usable realizations.
    condition = np.where(usable[:, :, 0, 0], found.condition, -np.inf).max(axis=0)
    dataset = frequency_response(
        found.frequency_hz,
        response,
        estimator=estimator,
        variance=np.where(lost, np.nan, np.where(several, scatter, noise)),
        noise_variance=np.where(lost, np.nan, noise),
        condition=np.where(np.isfinite(condition), condition, np.nan),
        flag=flag.astype(np.int8),
        attrs=found.attrs | {"estimator": estimator, "n_realizations": len(found.response)} | attrs,
        input_unit=found.attrs.get("input_unit", "Nm"),
        output_unit=found.attrs.get("output_unit", "rad"),
    )
    return with_freedom(dataset, np.where(several, count - 1.0, np.where(lost, np.nan, freedom)))
