"""The importance of the cubic spring: the puzzle at the end of section 9.5.

Measured responses stiffen with amplitude, yet the fit hardly depends on k3. The thesis could not
change its machine. This study changes the simulated machine and repeats all steps.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from axisight.errors import InputError
from axisight.graybox import AxisFit
from axisight.graybox.collocated import collocated
from axisight.graybox.landmarks import find_notch
from axisight.graybox.validation import fit_percent
from axisight.palette import SERIES
from axisight_thesis.chapter9_machine import M3, Machine
from axisight_thesis.chapter9_study import (
    SETS,
    fitted,
    initial,
    measured,
    records,
    responses,
    simulated,
    three_masses,
)
from axisight_thesis.context import Context

STANDARD = Machine()
K3 = M3["cubic_stiffness"]
THESIS_STIFFENING = (1.12e6 - 9.78e5) / 9.78e5
"""Relative increase of the stiffness from set 2 to set 3, section 9.5.2."""


@dataclass(frozen=True)
class Case:
    """A machine, and the references of sets 2 and 3 times ``scale``."""

    name: str
    machine: Machine
    scale: float = 1.0


CASES = (
    Case("as in the tables", STANDARD),
    Case("no third mass", replace(STANDARD, third_mass=False)),
    Case("no third mass, no ripple", replace(STANDARD, third_mass=False, ripple=False)),
    Case("no ripple", replace(STANDARD, ripple=False)),
    Case("no Coulomb friction", replace(STANDARD, coulomb_nm=0.0)),
    Case("half the amplitude", STANDARD, 0.5),
    Case("twice the amplitude", STANDARD, 2.0),
    Case("k3 = 0", replace(STANDARD, cubic_nm_rad3=0.0)),
    Case("k3 = 1e11", replace(STANDARD, cubic_nm_rad3=1e11)),
    Case("k3 = 2e11", replace(STANDARD, cubic_nm_rad3=2e11)),
    Case("k3 = 3e11", replace(STANDARD, cubic_nm_rad3=3e11)),
    Case("k3 = 1e11, no third mass", replace(STANDARD, cubic_nm_rad3=1e11, third_mass=False)),
    Case("k3 = 2e11, no third mass", replace(STANDARD, cubic_nm_rad3=2e11, third_mass=False)),
)
LARGE = "k3 = 2e11"
"""Large enough for the stiffening that the thesis measured."""

_SERIES = ("as in the tables", "k3 = 1e11", LARGE, "k3 = 3e11")
_ALONE = ("no third mass", "k3 = 1e11, no third mass", "k3 = 2e11, no third mass")
_QUICK = ("as in the tables", LARGE, _ALONE[0], _ALONE[2], "no Coulomb friction", "k3 = 0")


@dataclass(frozen=True)
class Importance:
    """The importance of k3 in one case.

    true, estimate
        k3 [Nm/rad^3] of the machine, and of two masses fitted to all sets.
    white_error, sandwich_error
        Standard errors of the estimate, for white residuals and from blocks of data.
    loss
        Points of fit (3.54) lost without k3 when all other parameters are fitted again; by data set.
    row
        Largest change of fit with k3 20 % larger or smaller; by data set.
    fit
        Fit with k3, by data set.
    stiffening
        Relative increase of the squared notch frequency from set 2 to set 3; NaN if a response has no
        clear notch.
    """

    case: Case
    true: float
    estimate: float
    white_error: float
    sandwich_error: float
    loss: tuple[float, ...]
    row: tuple[float, ...]
    fit: tuple[float, ...]
    stiffening: float


def importance(context: Context, case: Case) -> Importance:
    """Return the importance of k3 in a case."""
    return context.shared(("chapter 9 cubic", case), lambda: _importance(context, case))


def by_name(context: Context, name: str) -> Importance:
    """Return the importance of k3 in the case of this name."""
    return importance(context, next(c for c in CASES if c.name == name))


def _importance(context: Context, case: Case) -> Importance:
    start = None
    try:
        initial(context, case.machine, case.scale)
    except InputError:
        # Strongly nonlinear springs have no clear notch or plateau, so the standard machine's start is used.
        start = initial(context, STANDARD).start
    with_cubic, without = (
        fitted(
            context, case.machine, scale=case.scale, cubic=cubic, start=start, max_iterations=100
        )
        for cubic in (True, False)
    )
    data = records(context, case.machine, case.scale).data

    def fits(fit: AxisFit, factor: float = 1.0) -> np.ndarray:
        values = {**fit.parameters, "k3": factor * fit.parameters["k3"]}
        return np.array([fit_percent(measured(data[n]), simulated(values, data[n])) for n in SETS])

    best = fits(with_cubic)
    changed = np.array([fits(with_cubic, factor) - best for factor in (1.2, 0.8)])
    largest = changed[np.abs(changed).argmax(axis=0), np.arange(len(SETS))]
    at = with_cubic.free.index("k3")
    return Importance(
        case=case,
        true=case.machine.cubic_nm_rad3,
        estimate=with_cubic.parameters["k3"],
        white_error=float(with_cubic.std[at]),
        sandwich_error=float(np.sqrt(with_cubic.sandwich[at, at])),
        loss=tuple((best - fits(without)).tolist()),
        row=tuple(largest.tolist()),
        fit=tuple(best.tolist()),
        stiffening=_stiffening(context, case),
    )


def _stiffening(context: Context, case: Case) -> float:
    try:
        notches = [
            find_notch(collocated(r), band_rad_s=(25.0, 55.0)).frequency_rad_s
            for r in responses(context, case.machine, case.scale).values()
        ]
    except InputError:
        return float("nan")
    return (notches[1] / notches[0]) ** 2 - 1


def cases(context: Context) -> list[Importance]:
    """Return all cases, in a quick study half of them."""
    return [importance(context, c) for c in CASES if not context.quick or c.name in _QUICK]


def _chosen(context: Context, names: tuple[str, ...]) -> list[Importance]:
    return [by_name(context, n) for n in names if not context.quick or n in _QUICK]


def table(found: list[Importance]) -> pd.DataFrame:
    """Return the cases as a table."""
    rows = []
    for one in found:
        row: dict[str, float | str] = {
            "case": one.case.name,
            "true_k3": one.true,
            "estimated_k3": one.estimate,
            "standard_error_white": one.white_error,
            "standard_error_sandwich": one.sandwich_error,
            "stiffening_percent": 100 * one.stiffening,
        }
        for n, fit, loss, change in zip(SETS, one.fit, one.loss, one.row, strict=True):
            row |= {
                f"fit_{n}_percent": fit,
                f"fit_{n}_lost_without_k3": loss,
                f"fit_{n}_change_at_20_percent": change,
            }
        rows.append(row)
    return pd.DataFrame(rows)


def three_mass_table(context: Context) -> pd.DataFrame:
    """Return k3 estimated with two and with three masses, and fit lost without it, over the truth."""
    rows = []
    for two in _chosen(context, _SERIES):
        three = three_masses(context, two.case.machine)
        linear = three_masses(context, two.case.machine, cubic=False)
        at = three.free.index("k3")
        lost = np.subtract(three.fit_percent, linear.fit_percent)
        rows.append(
            {
                "true_k3": two.true,
                "two_masses": two.estimate,
                "two_masses_standard_error": two.sandwich_error,
                "three_masses": three.parameters["k3"],
                "three_masses_standard_error": float(np.sqrt(three.sandwich[at, at])),
                "fit_2_lost_three_masses": float(lost[1]),
                "fit_3_lost_three_masses": float(lost[2]),
            }
        )
    return pd.DataFrame(rows)


def figure(context: Context) -> Figure:
    """Return a figure, over true k3, of estimated over true k3 and of the loss of fit without it."""
    estimates = three_mass_table(context)
    losses = _chosen(context, ("k3 = 0", *_SERIES))
    alone = _chosen(context, _ALONE)
    drawing = Figure(figsize=(7.2, 3.0), layout="constrained")
    left, right = drawing.subplots(1, 2)
    unit = 1e11
    ends = np.array([0.0, 3.3])
    left.plot(ends, ends, color="#b4b4b4", lw=1.0, label="true value")
    for column, label, color, marker in (
        ("three_masses", "three masses", SERIES[2], "s"),
        ("two_masses", "two masses", SERIES[0], "o"),
    ):
        left.errorbar(
            estimates["true_k3"] / unit,
            estimates[column] / unit,
            1.96 * estimates[f"{column}_standard_error"] / unit,
            color=color,
            marker=marker,
            ms=4,
            lw=1.0,
            capsize=2,
            label=label,
        )
    left.axhline(K3 / unit, color=SERIES[4], lw=0.8, ls=":", label="model m3 of the thesis")
    left.set_ylabel("estimated k$_3$ [10$^{11}$ Nm/rad$^3$]", fontsize=8)
    curves = (
        ([one.true for one in alone], [one.loss[2] for one in alone], "D--", SERIES[1]),
        (estimates["true_k3"], estimates["fit_3_lost_three_masses"], "s-", SERIES[2]),
        ([one.true for one in losses], [one.loss[2] for one in losses], "o-", SERIES[0]),
    )
    for true, lost, style, color in curves:
        right.plot(np.asarray(true) / unit, lost, style, color=color, lw=1.0, ms=4)
    notes = (
        ("two masses, on an\narm of one mass", (2.1, 12.3), SERIES[1], "left"),
        ("three masses", (3.3, 5.4), SERIES[2], "right"),
        ("two masses", (3.3, 1.6), SERIES[0], "right"),
    )
    for text, place, color, side in notes:
        right.annotate(text, place, fontsize=7.5, color=color, ha=side)
    right.set_ylabel("fit lost without k$_3$, set 3 [% points]", fontsize=8)
    right.set_ylim(bottom=0)
    for axes in (left, right):
        axes.set_xlabel("true k$_3$ [10$^{11}$ Nm/rad$^3$]", fontsize=8)
        axes.grid(True, color="#e4e4e4", lw=0.5)
        axes.set_axisbelow(True)
        axes.set_xlim(-0.05, 3.35)
        axes.tick_params(labelsize=7)
        axes.spines[["top", "right"]].set_visible(False)
    left.set_ylim(bottom=0)
    left.legend(fontsize=7, frameon=False)
    return drawing
