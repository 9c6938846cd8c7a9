"""Tables 9.1 to 9.3."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import pandas as pd
import xarray as xr

from axisight.graybox.sensitivity import sensitivity_table
from axisight.graybox.validation import fit_table
from axisight_thesis.chapter9_machine import M3, Machine, chain
from axisight_thesis.chapter9_study import (
    NAMES,
    SETS,
    fitted,
    measured,
    models,
    records,
    simulated,
    three_masses,
)
from axisight_thesis.chapter9_values import change_claims, fit_claims, parameter_claims
from axisight_thesis.context import Context
from axisight_thesis.item import Item, item

STANDARD = Machine()

# Values of the thesis, columns m0 to m3.
TABLE_9_1 = {
    "J_m": (1.23e-2, 1.26e-2, 1.22e-2, 1.21e-2),
    "J_a": (0.79e3, 1.07e3, 1.11e3, 1.13e3),
    "k1": (0.814e6, 1.42e6, 1.46e6, 1.46e6),
    "k3": (5.4e10, 3.77e10, 4.69e10, 3.72e10),
    "d": (0.0, 2.73e3, 3.08e3, 2.63e3),
    "F_v": (1.36e-2, 1.18e-2, 1.36e-2, 1.3e-2),
    "F_c": (0.642, 0.668, 0.623, 0.644),
}
TABLE_9_2 = {
    1: (84.44, 97.12, 97.46, 96.39),
    2: (32.8, 61.54, 60.59, 62.33),
    3: (49.95, 74.43, 74.42, 74.94),
}
# +20 % and -20 % for data sets 1, 2, 3.
TABLE_9_3 = {
    "J_m": ((-4.51, -0.81), (0.77, -8.09), (-0.94, -10.7)),
    "J_a": ((-8.51, -5.34), (5.03, -9.45), (1.08, -7.36)),
    "k1": ((0.13, 0.02), (-2.73, -2.55), (-3.93, -4.14)),
    "k3": ((-0.01, -0.01), (-0.05, 0.06), (-0.11, 0.08)),
    "d": ((0.03, -0.06), (-0.09, 0.02), (0.12, -0.38)),
    "F_v": ((-5.79, -1.65), (2.46, -4.23), (0.70, -1.84)),
    "F_c": ((-14.7, -8.23), (-0.11, -21.5), (-1.25, -9.13)),
}
_MODELS = ("m0", "m1", "m2", "m3")


def truth() -> dict[str, float]:
    """Return the parameters of the machine, by parameter names of the two-mass model.

    J_a is the inertia of both parts of the arm, k1 and d those of the gear.
    """
    links = chain()
    return {
        "J_m": M3["motor_inertia"],
        "J_a": float(links.inertia_kg_m2[1:].sum()),
        "k1": float(links.stiffness_nm_rad[0]),
        "k3": M3["cubic_stiffness"],
        "d": float(links.damping_nm_s_rad[0]),
        "F_v": M3["viscous_friction"],
        "F_c": M3["coulomb_friction"],
    }


def fits(context: Context) -> xr.DataArray:
    """Return the fit of m0 to m3 on the three data sets, dims (data_set, estimated_on) [%]."""
    data = records(context, STANDARD).data
    sets = {str(n): data[n] for n in SETS}
    return fit_table(models(context, STANDARD), sets, simulated, measured)


def sensitivity(context: Context, parameters: Mapping[str, float] | None = None) -> xr.DataArray:
    """Return Table 9.3: dims (parameter, change, data_set)."""
    data = records(context, STANDARD).data
    sets = {str(n): data[n] for n in SETS}
    values = parameters or models(context, STANDARD)["m3"]
    return sensitivity_table(values, sets, simulated, measured, names=NAMES)


@item("table-9.1")
def table_9_1(context: Context) -> Item:
    """Return the estimated parameters next to those of the thesis and the truth."""
    found = models(context, STANDARD)
    rows = []
    for name in NAMES:
        row = {"parameter": name, "truth": truth()[name]}
        row |= {m: found[m][name] for m in _MODELS}
        row |= {f"thesis_{m}": v for m, v in zip(_MODELS, TABLE_9_1[name], strict=True)}
        rows.append(row)
    title = "Estimated parameters; m0 from steps 1 and 2, the others from step 3"
    here = {name: [found[m][name] for m in _MODELS] for name in NAMES}
    one_arm = fitted(context, replace(STANDARD, third_mass=False), max_iterations=100).parameters
    claims = parameter_claims(here, TABLE_9_1, one_arm)
    return Item("table-9.1", title, {"": pd.DataFrame(rows)}, {}, claims)


@item("table-9.2")
def table_9_2(context: Context) -> Item:
    """Return the model fits next to those of the thesis."""
    found = fits(context)
    rows = []
    for n in SETS:
        row: dict[str, float] = {"data_set": n}
        row |= {m: float(found.sel(data_set=str(n), estimated_on=m)) for m in _MODELS}
        row |= {f"thesis_{m}": v for m, v in zip(_MODELS, TABLE_9_2[n], strict=True)}
        rows.append(row)
    claims = fit_claims(found, TABLE_9_2, three_masses(context, STANDARD).fit_percent)
    title = "Model fit on the three data sets [%]"
    return Item("table-9.2", title, {"": pd.DataFrame(rows)}, {}, claims)


@item("table-9.3")
def table_9_3(context: Context) -> Item:
    """Return the differences of fit for parameters changed by 20 %."""
    found = sensitivity(context)
    rows = []
    for name in NAMES:
        row: dict[str, float | str] = {"parameter": name}
        for n, old in zip(SETS, TABLE_9_3[name], strict=True):
            for sign, change, was in zip(
                ("plus", "minus"), found["change"].values, old, strict=True
            ):
                value = found.sel(parameter=name, change=change, data_set=str(n))
                row[f"set_{n}_{sign}"] = float(value)
                row[f"thesis_set_{n}_{sign}"] = was
        rows.append(row)
    title = "Difference in fit of m3 when one parameter changes by 20 % [% points]"
    claims = change_claims(found, TABLE_9_3)
    return Item("table-9.3", title, {"": pd.DataFrame(rows)}, {}, claims)
