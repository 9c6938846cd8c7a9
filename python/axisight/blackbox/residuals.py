"""Tests whether residuals are white and independent of the input, Wernholt (2004), 3.5."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy import stats

from axisight.blackbox._data import Real, whole
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.statistics.correlation import (
    covariance_spread,
    covariances,
    joint_p_value,
    whiteness_p_value,
)

LEAST_SPREAD = 1e-6
"""Directions of the cross-covariances below this share of the largest variance are not tested."""


@summarized
@dataclass(frozen=True)
class ResidualTests:
    """Results of both residual tests, for every output and every pair of output and input.

    ``autocorrelation`` (n_out, lags + 1), one at lag 0, and ``cross_correlation``
    (n_out, n_in, 2 lags + 1), lags from -lags to lags, are normalized. ``whiteness_p`` (n_out,)
    and ``independence_p`` (n_out, n_in) are p-values: the probability of at least this much
    correlation by chance. Below 1 - ``probability`` the test fails. The test of independence uses
    lags from ``first_lag`` on; correlation at negative lags shows feedback. With ``probability``, a single lag
    stays within ``autocorrelation_bound`` and ``cross_correlation_bound`` (n_out, n_in).
    """

    autocorrelation: Real
    cross_correlation: Real
    autocorrelation_bound: float
    cross_correlation_bound: Real
    whiteness_p: Real
    independence_p: Real
    probability: float
    n_samples: int

    @property
    def white(self) -> bool:
        """Whether no output fails the whiteness test."""
        return bool(np.all(self.whiteness_p >= 1 - self.probability))

    @property
    def independent(self) -> bool:
        """Whether no residual follows an input."""
        return bool(np.all(self.independence_p >= 1 - self.probability))

    def advice(self) -> tuple[str, ...]:
        """Return one sentence for every test that fails: what it means and what to do."""
        out = []
        limit = 1 - self.probability
        for i in np.flatnonzero(self.whiteness_p < limit):
            out.append(
                f"residual {i + 1} is not white: standard errors that assume it are wrong; raise "
                "the orders of the noise model, or judge the plant by simulation"
            )
        for i, j in np.argwhere(self.independence_p < limit):
            out.append(
                f"residual {i + 1} follows input {j + 1}: dynamics are missing, the delay is "
                "wrong, or the system is nonlinear"
            )
        return tuple(out)

    def to_xarray(self) -> xr.Dataset:
        """Return both correlations over ``lag`` as a Dataset."""
        most = self.autocorrelation.shape[1] - 1
        mirrored = np.concatenate([self.autocorrelation[:, :0:-1], self.autocorrelation], axis=1)
        n_out, n_in = self.independence_p.shape
        return xr.Dataset(
            {
                "autocorrelation": (("output", "lag"), mirrored),
                "cross_correlation": (("output", "input", "lag"), self.cross_correlation),
                "whiteness_p": ("output", self.whiteness_p),
                "independence_p": (("output", "input"), self.independence_p),
            },
            coords={
                "lag": np.arange(-most, most + 1),
                "output": np.arange(1, n_out + 1),
                "input": np.arange(1, n_in + 1),
            },
            attrs={"probability": self.probability, "n_samples": self.n_samples},
        )


def residual_tests(
    residual: ArrayLike,
    input_: ArrayLike,
    *,
    lags: int = 25,
    probability: float = 0.99,
    first_lag: int = 0,
) -> ResidualTests:
    """Return tests of residuals ``measurement - model`` of one experiment.

    residual
        (n,) or (n, n_out); leading rows of NaN, before the first prediction, are left out.
    input_
        (n,) or (n, n_in), the input at the same samples.
    lags
        Largest lag.
    probability
        Probability that a right model passes.
    first_lag
        First lag of the test of independence. Take 1 if a controller acts within its sample: the input
        then follows the residual of the same sample, whatever the model.

    Whiteness: Ljung and Box's sum of squared autocorrelations, chi-squared with ``lags``
    degrees of freedom (estimated parameters take a few off, which makes the test mild).
    Independence: the vector of cross-correlations at lags ``first_lag`` to ``lags`` against its covariance
    sum_k R_e(k) R_u(k + i - j) / n, for a residual of any colour (Ljung, 1999, chapter 16).

    Raises InputError for misuse, and for a residual or input that is constant.
    """
    if not 0 < probability < 1:
        raise InputError(f"probability: expected a number between 0 and 1, got {probability}")
    most = whole("lags", lags, 1)
    first = whole("first_lag", first_lag, 0)
    if first > most:
        raise InputError(f"first_lag: expected at most {most} (lags), got {first}")
    e, u = _rows("residual", residual), _rows("input_", input_)
    if len(e) != len(u):
        raise InputError(f"input_: expected {len(e)} samples as the residual, got {len(u)}")
    known = np.isfinite(e).all(axis=1)
    start = int(np.argmax(known))
    e, u = e[start:], u[start:]
    if not (known.any() and np.isfinite(e).all() and np.isfinite(u).all()):
        raise InputError("residual, input_: expected finite numbers after the first prediction")
    n = len(e)
    if n < 4 * most:
        raise InputError(f"residual: expected at least {4 * most} samples for {most} lags, got {n}")
    for name, x in (("residual", e), ("input_", u)):
        if np.any(np.ptp(x, axis=0) == 0):
            raise InputError(f"{name}: expected channels that move, got a constant one")
    e, u = e - e.mean(axis=0), u - u.mean(axis=0)
    r_e = np.stack([covariances(x, x, most) for x in e.T])
    r_u = np.stack([covariances(x, x, 2 * most) for x in u.T])
    white = r_e / r_e[:, :1]
    cross = np.empty((e.shape[1], u.shape[1], 2 * most + 1))
    bound, independence = np.empty(cross.shape[:2]), np.empty(cross.shape[:2])
    one_sided = stats.norm.ppf((1 + probability) / 2)
    for i, x in enumerate(e.T):
        for j, w in enumerate(u.T):
            after, before = covariances(x, w, most), covariances(w, x, most)
            both = np.concatenate([before[:0:-1], after])
            spread = covariance_spread(r_e[i], r_u[j], most + 1) / n
            size = np.sqrt(r_e[i, 0] * r_u[j, 0])
            cross[i, j] = both / size
            bound[i, j] = one_sided * np.sqrt(spread[0]) / size
            independence[i, j] = joint_p_value(
                after[first:], np.arange(first, most + 1), spread, LEAST_SPREAD
            )
    return ResidualTests(
        white,
        cross,
        float(one_sided / np.sqrt(n)),
        bound,
        whiteness_p_value(white[:, 1:], n, short=True),
        independence,
        probability,
        n,
    )


def _rows(name: str, value: ArrayLike) -> Real:
    x = np.asarray(value, np.float64)
    x = x[:, None] if x.ndim == 1 else x
    if x.ndim != 2 or 0 in x.shape:
        raise InputError(f"{name}: expected shape (n,) or (n, channels), got {np.shape(value)}")
    return x
