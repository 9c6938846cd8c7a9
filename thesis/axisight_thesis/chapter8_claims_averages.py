"""The claims of section 8.3.3 on averages, with computed verdicts."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.frf.errors import mean_relative_error
from axisight_thesis.chapter8_averages import averaged, realizations_from_rest
from axisight_thesis.chapter8_compare import (
    COUPLING,
    DIAGONAL,
    LOW_HZ,
    STANDARD_ERRORS,
    T1_SQUARE,
    listed,
)
from axisight_thesis.chapter8_setting import DESIGNS, PERIOD_S, excited_lines
from axisight_thesis.chapter8_study import same_excitation, true_response
from axisight_thesis.chapter8_tables import mean_errors
from axisight_thesis.context import Context
from axisight_thesis.item import Result, Statements

Real = NDArray[np.float64]

CLAIMS = Statements("8.3.3")


@CLAIMS.claim(
    "8.3.3-same",
    "Averaging over experiments with the same excitation gains nothing against ripple.",
)
def _same(context: Context) -> Result:
    found = same_excitation(context, DESIGNS[T1_SQUARE], 8)
    true = true_response(context, found[0].frequency_hz)
    single = np.mean([mean_relative_error(f.estimate, true) for f in found], axis=0)
    mean = mean_relative_error(np.mean([f.estimate for f in found], axis=0), true)
    ratio = mean / single
    other = _different(context, 8)
    text = (
        f"error of the mean of 8 over that of one: {ratio.min():.3f} to {ratio.max():.3f}; "
        f"with 8 different multisines {other.min():.2f} to {other.max():.2f}"
    )
    return bool(ratio.min() > 0.97), text


@CLAIMS.claim(
    "8.3.3-realizations",
    "Averaging over different multisines improves the estimate, also off the diagonal.",
)
def _realizations(context: Context) -> Result:
    few = mean_errors(context)[T1_SQUARE] / 100
    study = averaged(context, 250)
    many = _mean_error(study, "arithmetic_mean", context)
    text = (
        f"error of the arithmetic mean of {int(study.attrs['runs'])} over that of one: "
        f"diagonal {listed((many / few)[DIAGONAL])}, off it {listed((many / few)[~DIAGONAL])}"
    )
    return bool(np.all(many < few)), text


@CLAIMS.claim(
    "8.3.3-log-bias",
    "The logarithmic mean keeps a bias at low frequency in the coupling of axis 1, "
    "the arithmetic mean does not.",
)
def _log_bias(context: Context) -> Result:
    study = averaged(context, 250)
    log, arithmetic = (_low_bias(context, study, m) for m in ("log_mean", "arithmetic_mean"))
    error = _standard_error(context, study)
    text = (
        f"mean of |estimate| / |G| - 1 up to {LOW_HZ:g} Hz in (1,2), (1,3), (2,1), (3,1): "
        f"logarithmic {listed(100 * log, '.1f')} %, arithmetic {listed(100 * arithmetic, '.1f')} %, "
        f"standard error {listed(100 * error, '.1f')} %"
    )
    biased = np.abs(log) > STANDARD_ERRORS * error
    return bool(np.any(biased) and np.all(np.abs(arithmetic) < STANDARD_ERRORS * error)), text


@CLAIMS.claim(
    "8.3.3-twenty",
    "The arithmetic mean of 20 realizations is less biased than the logarithmic mean of 250.",
)
def _twenty(context: Context) -> Result:
    log = _low_bias(context, averaged(context, 250), "log_mean")
    twenty = _low_bias(context, averaged(context, 20), "arithmetic_mean")
    text = (
        f"mean of |estimate| / |G| - 1 up to {LOW_HZ:g} Hz in (1,2), (1,3), (2,1), (3,1): "
        f"20 arithmetic {listed(100 * twenty, '.1f')} %, 250 logarithmic {listed(100 * log, '.1f')} %"
    )
    return bool(np.abs(twenty).max() < np.abs(log).max()), text


def _different(context: Context, runs: int) -> Real:
    """Return the error of the mean over realizations over the mean of their errors."""
    found = realizations_from_rest(context, runs)
    true = true_response(context, excited_lines() / PERIOD_S)
    single = np.mean([mean_relative_error(f, true) for f in found], axis=0)
    return np.asarray(mean_relative_error(np.mean(found, axis=0), true) / single)


def _mean_error(study: xr.Dataset, mean: str, context: Context) -> Real:
    return mean_relative_error(
        study[mean].values, true_response(context, study["frequency_hz"].values)
    )


def _low_bias(context: Context, study: xr.Dataset, mean: str) -> Real:
    """Return the mean of ``|estimate| / |G| - 1`` at low frequency, per element of COUPLING."""
    low = study.sel(frequency_hz=slice(0, LOW_HZ + 1e-9))
    true = true_response(context, low["frequency_hz"].values)
    ratio = (np.abs(low[mean].values) / np.abs(true) - 1).mean(axis=0)
    return np.array([ratio[e] for e in COUPLING])


def _standard_error(context: Context, study: xr.Dataset) -> Real:
    """Return the standard error of :func:`_low_bias` for the arithmetic mean.

    Lines are independent, and half of E|dG|^2 lies along G.
    """
    low = study.sel(frequency_hz=slice(0, LOW_HZ + 1e-9))
    true = true_response(context, low["frequency_hz"].values)
    relative = low["standard_error"].values / np.abs(true)
    total = np.sqrt((relative**2 / 2).sum(axis=0)) / len(relative)
    return np.array([total[e] for e in COUPLING])
