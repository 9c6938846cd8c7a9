"""Figures 8.9 to 8.11: averages over realizations of the multisine."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight import montecarlo
from axisight.montecarlo import EffectEntry, Excitation, Measurement, Multisine, Square, Study
from axisight_thesis.chapter8_figures import ACCELERATION
from axisight_thesis.chapter8_setting import (
    BAND_HZ,
    PEAK_RAD_S,
    PERIOD_S,
    SMOOTHING_SAMPLES,
    SQUARE_PERIOD_S,
    SQUARE_RAD_S,
    ripple,
)
from axisight_thesis.chapter8_study import true_response
from axisight_thesis.context import Context
from axisight_thesis.element_plot import (
    ESTIMATE,
    TRUE,
    Curve,
    element_figure,
    element_table,
)
from axisight_thesis.item import Item, item

Real = NDArray[np.float64]

# The multisines of a Monte Carlo study have random phases: crest factor 3.6 on average for 391
# lines. Their peak gives them the power of the clipped multisine of section 8.2, 1.56.
RANDOM_PEAK_RAD_S = PEAK_RAD_S * 3.6 / 1.56


def averaged(context: Context, runs: int) -> xr.Dataset:
    """Return the averages over realizations of T1 with square wave, over a tenth of them if quick."""
    runs = max(runs // 10, 4) if context.quick else runs

    def make() -> xr.Dataset:
        context.report(f"{runs} realizations")
        return montecarlo.run(_study(context, runs), threads=context.threads or None)

    return context.shared(("chapter8-averages", runs), make)


def _study(context: Context, runs: int) -> Study:
    effects = [
        EffectEntry(name=e.name, axis=e.axis, parameters=dict(e.parameters or {}))
        for e in ripple(context.robot)
    ]
    multisine = Multisine(period_s=PERIOD_S, band_hz=BAND_HZ, peak_rad_s=RANDOM_PEAK_RAD_S)
    square = Square(
        amplitude_rad_s=SQUARE_RAD_S,
        period_s=SQUARE_PERIOD_S,
        smoothing_samples=SMOOTHING_SAMPLES,
    )
    return Study(
        name="averages over realizations",
        robot="irb6600_like",
        seed=context.seed,
        runs=runs,
        excitation=Excitation(multisine=multisine, square=square, directions="identity"),
        measurement=Measurement(waiting_periods=1, periods=1, output="acceleration"),
        effect=effects,
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
