"""Tables 8.1 and 8.2."""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from axisight.frf.errors import mean_relative_error
from axisight_thesis.agreement import Agreement
from axisight_thesis.chapter8_setting import (
    DESIGNS,
    PERIOD_S,
    PROPORTIONAL_RIPPLE,
    RESOLVER_RIPPLE_RAD,
    TORQUE_RIPPLE_NM,
    excited_lines,
)
from axisight_thesis.chapter8_study import experiments, true_response
from axisight_thesis.context import Context
from axisight_thesis.item import Claim, Item, item

Real = NDArray[np.float64]

# Wernholt (2004), Table 8.2 [%], in the order of DESIGNS.
THESIS_8_2 = np.array(
    [
        [[9.23, 23.41, 32.20], [24.40, 18.27, 24.28], [33.95, 31.07, 18.49]],
        [[8.17, 59.67, 92.50], [55.53, 17.10, 60.35], [80.83, 61.41, 15.77]],
        [[10.13, 42.20, 47.00], [198.96, 15.84, 55.81], [186.22, 69.55, 14.79]],
        [[7.76, 27.15, 39.11], [92.74, 12.38, 61.57], [165.69, 61.26, 11.35]],
    ]
)


def realizations(context: Context) -> int:
    """Return the number of realizations, each with its start angle, over which the tables average."""
    return 2 if context.quick else 8


def mean_errors(context: Context) -> Real:
    """Return Table 8.2 [%], (design, output, input)."""
    return context.shared("chapter8-mean-errors", lambda: mean_error_table(context))


def mean_error_table(context: Context) -> Real:
    """Return Table 8.2 [%] on the robot of ``context``, (design, output, input)."""
    return np.asarray(100 * mean_error_runs(context, realizations(context)).mean(axis=0))


def mean_error_runs(context: Context, runs: int) -> Real:
    """Return mean relative errors [1], (realization, design, output, input)."""
    true = true_response(context, excited_lines() / PERIOD_S)

    def one(run: int) -> Real:
        found = [experiments(context, d, run).estimate for d in DESIGNS]
        return np.array([mean_relative_error(estimate, true) for estimate in found])

    shared = [
        context.shared(("chapter8-mean-error", run), partial(one, run)) for run in range(runs)
    ]
    return np.array(shared)


@item("table-8.1")
def table_8_1(context: Context) -> Item:
    """Return the disturbances of the simulation."""
    parts = {
        "a_n [Nm]": TORQUE_RIPPLE_NM,
        "b_n [1]": PROPORTIONAL_RIPPLE,
        "c_n [rad]": RESOLVER_RIPPLE_RAD,
    }
    rows = [
        {"amplitude": name, "n": n, "value": value, "phase_rad": phase}
        for name, sines in parts.items()
        for n, value, phase in sines
    ]
    noise = context.robot.position_noise_std
    rows.append({"amplitude": "e_phi, standard deviation [rad]", "value": noise})
    table = pd.DataFrame(rows)
    table["n"] = table["n"].astype("Int64")
    return Item("table-8.1", "Disturbances", {"": table})


@item("table-8.2")
def table_8_2(context: Context) -> Item:
    """Return the mean relative errors of the four designs, next to those of the thesis."""
    here = mean_errors(context)
    factor = here / THESIS_8_2
    rows = [
        {
            "design": str(design),
            "output": i + 1,
            "input": j + 1,
            "thesis_percent": THESIS_8_2[k, i, j],
            "here_percent": here[k, i, j],
            "factor": factor[k, i, j],
        }
        for k, design in enumerate(DESIGNS)
        for i in range(3)
        for j in range(3)
    ]
    away = np.exp(np.abs(np.log(factor)))
    evidence = (
        f"largest factor {away.max():.2f}, median {np.median(away):.2f}, "
        f"{int((away <= 2).sum())} of 36 within 2 ({realizations(context)} realizations)"
    )
    claim = Claim(
        "table-8.2",
        "8.3.1",
        "Table 8.2 comes out: every entry within a factor 2, the median within 1.4.",
        bool(away.max() <= 2 and np.median(away) <= 1.4),
        evidence,
    )
    same = Agreement.of(THESIS_8_2, 100 * mean_error_runs(context, realizations(context)))
    pattern = Claim(
        "table-8.2-pattern",
        "8.3.1",
        "Table 8.2: large and small entries are those of the thesis, as well as in single "
        "realizations of this study.",
        same.alike,
        same.correlations(),
    )
    scatter = Claim(
        "table-8.2-scatter",
        "8.3.1",
        "Table 8.2: the thesis could be one realization of this study.",
        same.scattered,
        same.intervals(),
    )
    tables = {"": pd.DataFrame(rows), "layout": _layout(here)}
    title = "Mean relative error of the MFRF estimate [%]"
    return Item("table-8.2", title, tables, {}, (claim, pattern, scatter))


def _layout(here: Real) -> pd.DataFrame:
    """Return Table 8.2 in its printed layout: without square wave left, with square wave right."""
    columns = [f"{square} {j}" for square in ("without", "with") for j in (1, 2, 3)]
    blocks = [np.hstack([here[0], here[1]]), np.hstack([here[2], here[3]])]
    table = pd.DataFrame(np.vstack(blocks), columns=columns)
    table.insert(0, "output", [1, 2, 3] * 2)
    table.insert(0, "directions", ["T1"] * 3 + ["T2"] * 3)
    return table
