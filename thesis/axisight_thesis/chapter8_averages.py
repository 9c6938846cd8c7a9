"""Figures 8.9 to 8.11: averages over realizations of the multisine."""

from __future__ import annotations

from functools import partial

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight_thesis.chapter8_figures import ACCELERATION
from axisight_thesis.chapter8_setting import (
    PERIOD_S,
    Design,
    excited_lines,
    references,
    ripple,
)
from axisight_thesis.chapter8_study import from_simulation, simulate_period, true_response
from axisight_thesis.context import Context
from axisight_thesis.element_plot import (
    ESTIMATE,
    TRUE,
    Curve,
    element_figure,
    element_table,
)
from axisight_thesis.item import Item, item

Complex = NDArray[np.complex128]

DESIGN = Design("T1", square=True)
# Realizations that are simulated together. It bounds the memory and changes no result.
_BLOCK = 8
_NOISE = 2**34
"""Noise run of the first experiment; other experiments of chapter 8 have smaller ones."""


def averaged(context: Context, runs: int) -> xr.Dataset:
    """Return averages over realizations of T1 with square wave, over a tenth of them if quick.

    Variables ``arithmetic_mean`` (7.7), ``log_mean`` (7.8) and ``standard_error`` of the arithmetic
    mean, dims (frequency_hz, output, input); attribute ``runs``.
    """
    runs = max(runs // 10, 4) if context.quick else runs
    return context.shared(("chapter8-averages", runs), lambda: _averaged(context, runs))


def realizations_from_rest(context: Context, runs: int) -> Complex:
    """Return the estimates of realizations, (realization, n_freq, output, input).

    As in the thesis, every realization has a new clipped multisine of crest factor 1.55. All begin at
    the operating point: new start angles would average out ripple too (section 7.2.8). Realization
    ``i`` is a function of (seed, i), so a smaller number gives the first of a larger one.
    """
    blocks = []
    for first in range(0, runs, _BLOCK):
        key = ("chapter8-average-block", first)
        blocks.append(context.shared(key, partial(_block, context, first)))
    return np.concatenate(blocks)[:runs]


def _block(context: Context, first: int) -> Complex:
    robot, seed = context.robot, context.seed
    runs = range(first, first + _BLOCK)
    simulated = simulate_period(
        context,
        np.concatenate([references(robot, DESIGN, seed, run) for run in runs]),
        ripple(robot),
        noise_seed=seed,
        first_run=_NOISE + robot.n_axes * first,
    )
    n = robot.n_axes
    parts = (simulated.isel(run=slice(n * k, n * k + n)) for k in range(_BLOCK))
    return np.stack([from_simulation(context, part, excited_lines()).estimate for part in parts])


def _averaged(context: Context, runs: int) -> xr.Dataset:
    context.report(f"{runs} realizations")
    single = realizations_from_rest(context, runs)
    arithmetic = single.mean(axis=0)
    size = np.exp(np.log(np.abs(single)).mean(axis=0))
    scatter = np.sqrt((np.abs(single - arithmetic) ** 2).sum(axis=0) / (runs - 1))
    dims = ("frequency_hz", "output", "input")
    return xr.Dataset(
        {
            "arithmetic_mean": (dims, arithmetic),
            "log_mean": (dims, size * arithmetic / np.abs(arithmetic)),
            "standard_error": (dims, scatter / np.sqrt(runs)),
        },
        coords={"frequency_hz": excited_lines() / PERIOD_S},
        attrs={"runs": runs},
    )


def _register(number: str, mean: str, runs: int, title: str) -> None:
    @item(f"figure-{number}")
    def figure(context: Context) -> Item:
        study = averaged(context, runs)
        frequency = study["frequency_hz"].values
        true = np.abs(true_response(context, frequency))
        estimate = np.abs(study[f"{mean}_mean"].values)
        count = int(study.attrs["runs"])
        curves = [
            Curve(frequency, true, "true", TRUE),
            Curve(frequency, estimate, f"{title} of {count} realizations", ESTIMATE),
        ]
        table = element_table(true=(frequency, true), estimate=(frequency, estimate))
        return Item(
            f"figure-{number}",
            f"MFRF estimate, {title} of {count} realizations, T1 with square wave",
            {"": table},
            {"": element_figure(curves, ACCELERATION)},
        )


_register("8.9", "arithmetic", 250, "arithmetic mean")
_register("8.10", "log", 250, "logarithmic mean")
_register("8.11", "arithmetic", 20, "arithmetic mean")
