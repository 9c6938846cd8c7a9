"""Validation of a fitted model: fit, residual tests, cross-validation.

Wernholt (2004), section 3.5; Ljung (1999), System Identification, chapter 16.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import scipy
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from axisight import blackbox
from axisight.arguments import series_pair
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.statistics.correlation import (
    covariance_spread,
    covariances,
    joint_p_value,
    whiteness_p_value,
)

Real = NDArray[np.float64]
D = TypeVar("D")
M = TypeVar("M")

_RANK = 1e-3
_WINDOW_SHARE = 10


def fit_percent(measured: ArrayLike, simulated: ArrayLike) -> float:
    """Return the model fit (3.54) in per cent.

    ``100 (1 - |y - yhat| / |y - mean(y)|)``, y the ``measured`` output and yhat the ``simulated``
    or predicted one, (n,). It is 100 for a perfect model, 0 for one no better than the mean, and
    negative for a worse one. Raises InputError for other shapes, values that are not finite, and a
    constant measurement.
    """
    y, model = series_pair("measured", measured, "simulated", simulated)
    if np.ptp(y) == 0:
        raise InputError("measured: expected values that vary, got a constant")
    return float(blackbox.fit_percent(y, model)[0])


@summarized
@dataclass(frozen=True, eq=False)
class ResidualTests:
    """Results of residual tests of a model.

    correlations
        Dataset over ``lag`` (samples; positive: input before residual) with
        ``autocorrelation`` and ``cross_correlation`` (both normalised), and their two-sided limits
        at ``probability`` (attribute) for each lag alone.
    whiteness_p_value
        Probability of autocorrelations at least as large if the residuals are white.
    independence_p_value
        Probability of cross-correlations with past inputs at least as large, if the residuals do not
        depend on the input.
    feedback_p_value
        The same probability for cross-correlations with later inputs.
    closed_loop
        Whether the data are from a closed loop.
    """

    correlations: xr.Dataset
    whiteness_p_value: float
    independence_p_value: float
    feedback_p_value: float
    closed_loop: bool

    @property
    def verdict(self) -> str:
        """The verdict of the tests in words."""
        level = 1 - float(self.correlations.attrs["probability"])
        parts = []
        # Only residuals that are not white can depend on earlier ones through the controller.
        feeds = self.closed_loop and max(self.feedback_p_value, self.whiteness_p_value) < level
        if self.independence_p_value < level:
            parts.append(
                "residuals depend on past inputs: the model lacks dynamics or a nonlinearity"
                + (", or the controller fed them back; test with the reference" * feeds)
            )
        else:
            parts.append("no dependence on past inputs found")
        if self.feedback_p_value < level:
            parts.append(
                "they show in later inputs, as they must in closed loop: no fault of the model"
                if self.closed_loop
                else "they are correlated with later inputs: a closed loop, or an input that repeats"
            )
        if self.whiteness_p_value < level:
            parts.append(
                "they are not white: an output-error model need not whiten them, but its "
                "standard errors are then too small; estimate a noise model"
            )
        return "; ".join(parts)


def residual_tests(
    residual: ArrayLike,
    input_: ArrayLike,
    *,
    lags: int = 25,
    lag_step: int = 1,
    probability: float = 0.99,
    closed_loop: bool = True,
) -> ResidualTests:
    """Return tests of residuals for whiteness and for independence of the input.

    Ljung (1999), section 16.6. Whiteness: n times the sum of squared autocorrelations over
    lags 1 to ``lags`` is chi-squared with as many degrees of freedom (16.34). Independence: if the
    residuals, white or not, do not depend on the input (16.40), the cross-covariances at lags i and j
    are normal with covariance

        sum_k R_e(k) R_u(k + i - j) / n

    and the quadratic form with the inverse covariance is chi-squared. Directions with less than a
    thousandth of the power of the input tell nothing and are left out. R_e and R_u are estimated with
    Parzen's window over a tenth of the record.

    Negative lags are inputs that come after the residual. In closed loop the controller feeds
    residuals into later inputs, and without delay also into the input of the same sample. Therefore
    the test of independence uses lags from one on (open loop: from zero on). Residuals that are not
    white, for example those of an output-error model with noise before the output, then also
    correlate with past inputs, through their own past. To avoid this, give the reference as
    ``input_``, which has no feedback.

    Parameters
    ----------
    residual, input_ : (n,); the input of the model, or the reference of the loop.
    lags : number of lags on either side.
    lag_step : samples between lags of the correlations, more than one for dense samples; the test of
        whiteness uses every sample.
    probability : probability that a correlation stays within its limits.
    closed_loop : whether the data are from a closed loop.

    Raises InputError for arrays that do not fit, too few samples, and lags out of range.

    """
    e, u = series_pair("residual", residual, "input_", input_)
    for name, value in (("lags", lags), ("lag_step", lag_step)):
        if isinstance(value, bool) or value != int(value) or value < 1:
            raise InputError(f"{name}: expected a whole number of at least 1, got {value}")
    if not 0 < probability < 1:
        raise InputError(f"probability: expected a number between 0 and 1, got {probability}")
    n, last = len(e), lags * lag_step
    if n < 4 * (last + 1):
        raise InputError(f"residual: expected at least {4 * (last + 1)} samples, got {n}")
    e, u = e - e.mean(), u - u.mean()
    if not (e.any() and u.any()):
        raise InputError("residual, input_: expected values that vary, got a constant")
    window, count = max(n // _WINDOW_SHARE, last + 1), 2 * last + 1
    auto, power = covariances(e, e, window), covariances(u, u, window)
    cross = np.concatenate([covariances(u, e, last)[:0:-1], covariances(e, u, last)])
    at = lag_step * np.arange(-lags, lags + 1)
    r_auto = auto[np.abs(at)] / auto[0]
    scale = np.sqrt(auto[0] * power[0])
    spread = _smoothed_spread(auto, power, count) / n
    cross = cross[last + at]
    limit = scipy.stats.norm.ppf(0.5 + probability / 2)
    dataset = xr.Dataset(
        {
            "autocorrelation": ("lag", r_auto),
            "cross_correlation": ("lag", cross / scale),
            "autocorrelation_limit": limit / np.sqrt(n),
            "cross_correlation_limit": limit * np.sqrt(max(spread[0], 0.0)) / scale,
        },
        coords={"lag": ("lag", at, {"units": "samples"})},
        attrs={"probability": probability, "n_samples": n, "closed_loop": int(closed_loop)},
    )
    causal = at >= (1 if closed_loop else 0)
    return ResidualTests(
        dataset,
        float(whiteness_p_value(auto[1 : lags + 1] / auto[0], n, short=False)),
        joint_p_value(cross[causal], at[causal], spread, _RANK),
        joint_p_value(cross[~causal], at[~causal], spread, _RANK),
        closed_loop,
    )


def _smoothed_spread(auto: Real, power: Real, count: int) -> Real:
    """Return `covariance_spread` with Parzen's window, of full width, on both autocovariances."""
    # The window on both keeps their spectra non-negative, and power in its band.
    window = _parzen(np.arange(len(auto)), len(auto) - 1)
    return covariance_spread(auto * window, np.pad(power * window, (0, count - 1)), count)


def _parzen(lag: NDArray[np.int64], width: int) -> Real:
    x = np.minimum(np.abs(lag) / (width + 1), 1.0)
    return np.where(x < 0.5, 1 - 6 * x**2 * (1 - x), 2 * (1 - x) ** 3)


def cross_validation(
    fit: Callable[[list[D]], M],
    data_sets: Mapping[str, D],
    simulate: Callable[[M, D], ArrayLike],
    measured: Callable[[D], ArrayLike],
    *,
    combinations: Sequence[Sequence[str]] | None = None,
) -> tuple[xr.DataArray, dict[str, M]]:
    """Return the fit to all data sets of models fitted to some of them, as in Table 9.2.

    Parameters
    ----------
    fit : function from a list of data sets to a model.
    data_sets : data sets by name.
    simulate, measured : functions that return the output (n,) of a model for a data set, and its
        measured output (n,).
    combinations : names of the data sets of each fit; default each alone, and all.

    Returns fits (3.54) in per cent, dims (data_set, estimated_on), with an attribute
    ``own`` that says which data sets were fitted, and the models by the same names. Raises InputError
    for unknown names, empty combinations and without data sets.

    """
    if not data_sets:
        raise InputError("data_sets: expected at least one, got none")
    if combinations is None:
        combinations = [[name] for name in data_sets]
        if len(data_sets) > 1:
            combinations.append(list(data_sets))
    models: dict[str, M] = {}
    for names in combinations:
        unknown = [name for name in names if name not in data_sets]
        if unknown or not names:
            known = ", ".join(data_sets)
            raise InputError(f"combinations: expected names among {known}, got {list(names)}")
        models[", ".join(names)] = fit([data_sets[name] for name in names])
    table = fit_table(models, data_sets, simulate, measured)
    table.attrs["own"] = "; ".join(models)
    return table, models


def fit_table(
    models: Mapping[str, M],
    data_sets: Mapping[str, D],
    simulate: Callable[[M, D], ArrayLike],
    measured: Callable[[D], ArrayLike],
) -> xr.DataArray:
    """Return the fit (3.54) of every model on every data set, dims (data_set, estimated_on) [%].

    ``models`` and ``data_sets`` are dicts by name; ``simulate`` and ``measured`` are those of
    :func:`cross_validation`.
    """
    rows = [
        [fit_percent(measured(data), simulate(model, data)) for model in models.values()]
        for data in data_sets.values()
    ]
    return xr.DataArray(
        np.array(rows).reshape(len(data_sets), len(models)),
        dims=("data_set", "estimated_on"),
        coords={"data_set": list(data_sets), "estimated_on": list(models)},
        attrs={"units": "%"},
        name="fit",
    )
