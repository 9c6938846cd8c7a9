"""Sensitivity of the fit to each parameter."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeVar

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from axisight.errors import InputError
from axisight.graybox.validation import fit_percent

D = TypeVar("D")


def sensitivity_table(
    parameters: Mapping[str, float],
    data_sets: Mapping[str, D],
    simulate: Callable[[Mapping[str, float], D], ArrayLike],
    measured: Callable[[D], ArrayLike],
    *,
    change: float = 0.2,
    names: tuple[str, ...] | None = None,
) -> xr.DataArray:
    """Return the change of the fit when single parameters change, as in Table 9.3.

    The function multiplies one parameter at a time by 1 + ``change`` and 1 - ``change``, and holds the
    others. Near the best model the loss of fit grows with the square of the change, and other model
    errors hide part of it. A small entry therefore does not mean that the parameter is poorly known;
    its standard error tells that.

    Parameters
    ----------
    parameters : all parameters of the model by name.
    data_sets, simulate, measured : as for :func:`axisight.graybox.cross_validation`, with the
        parameters in place of the model.
    change : relative, between 0 and 1.
    names : parameters to change; default all that are not zero.

    Returns differences of (3.54) in per cent points, dims (parameter, change, data_set), with the
    fit itself in ``attrs["fit_percent"]``. Raises InputError for unknown names, a
    change out of range and parameters that are zero.

    """
    if not 0 < change < 1:
        raise InputError(f"change: expected a number between 0 and 1, got {change}")
    if not data_sets:
        raise InputError("data_sets: expected at least one, got none")
    chosen = names or tuple(n for n, v in parameters.items() if v != 0)
    for name in chosen:
        if name not in parameters:
            raise InputError(f"names: expected among {', '.join(parameters)}, got {name!r}")
        if parameters[name] == 0:
            raise InputError(f"names: {name} is zero, and a relative change does nothing")

    def fits(values: Mapping[str, float]) -> list[float]:
        return [fit_percent(measured(d), simulate(values, d)) for d in data_sets.values()]

    base = np.array(fits(parameters))
    steps = (change, -change)
    table = [
        [np.array(fits({**parameters, n: parameters[n] * (1 + s)})) - base for s in steps]
        for n in chosen
    ]
    return xr.DataArray(
        np.array(table).reshape(len(chosen), 2, len(data_sets)),
        dims=("parameter", "change", "data_set"),
        coords={"parameter": list(chosen), "change": list(steps), "data_set": list(data_sets)},
        attrs={"units": "%", "fit_percent": base.tolist()},
        name="fit_difference",
    )
