"""Covariance between the elements of ``Y U^-1``."""

from __future__ import annotations

import numpy as np
import xarray as xr

from axisight.arguments import Complex
from axisight.frf._lines import lost_lines

_DIMS = ("frequency_hz", "element", "element_2")


def with_covariance(dataset: xr.Dataset, u: Complex, y: Complex) -> xr.Dataset:
    """Return an estimate of `mfrf` with the covariances of its elements.

    ``u`` and ``y`` are spectra (n_freq, channel, experiment, period). To first order ``dG = E V`` with
    V = U^+ and the errors E, the columns of ``Y - G U``, which are independent between experiments:
    ``E dG_oi conj(dG_pj) = sum_e C_e[o, p] V_ei conj(V_ej)``. C_e comes from the scatter of the
    periods. With more experiments than inputs, one C for all comes from the residuals ``Y - G U``.
    """
    usable = ~lost_lines(dataset["flag"].values)
    g = dataset["response"].values[usable]
    u, y = u[usable], y[usable]
    v = np.linalg.pinv(u.mean(axis=3))
    residual = y - np.einsum("foi,fiep->foep", g, u)
    experiments, periods = u.shape[2:]
    mean = residual.mean(axis=3)
    found: dict[str, Complex] = {}
    if periods > 1:
        off = residual - mean[..., None]
        each = np.einsum("foep,fqep->feoq", off, off.conj()) / (periods * (periods - 1))
        found["noise_covariance"] = np.einsum("feoq,fei,fej->foiqj", each, v, v.conj())
    spare = experiments - u.shape[1]
    if spare:
        all_ = np.einsum("foe,fqe->foq", mean, mean.conj()) / spare
        found["covariance"] = np.einsum("foq,fei,fej->foiqj", all_, v, v.conj())
    elif periods > 1:
        found["covariance"] = found["noise_covariance"]
    size = g.shape[1] * g.shape[2]
    unit = dataset["variance"].attrs["units"]
    names = [f"{o},{i}" for o in dataset["output"].values for i in dataset["input"].values]
    variables = {}
    for name in ("covariance", "noise_covariance"):
        if name == "covariance" or name in found:
            values = np.full((len(usable), size, size), np.nan, np.complex128)
            if name in found:
                values[usable] = found[name].reshape(-1, size, size)
            variables[name] = (_DIMS, values, {"units": unit})
    return dataset.assign(variables).assign_coords(element=names, element_2=names)
