"""Correlation over time of residuals and inputs, and tests whether it is chance.

The tests are those of Ljung (1999), System Identification, chapter 16.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import fft, stats

Real = NDArray[np.float64]


def covariances(x: Real, y: Real, lags: int) -> Real:
    """Return ``(1/n) sum_t x(t) y(t - lag)`` for lags 0 to ``lags``, at most n - 1.

    ``x`` and ``y`` are (n,), of mean zero.
    """
    n = len(x)
    size = fft.next_fast_len(n + lags, real=True)
    product = fft.rfft(x, size) * np.conj(fft.rfft(y, size))
    return np.asarray(fft.irfft(product, size)[: lags + 1] / n)


def pooled_autocovariance(parts: Sequence[Real], lags: int) -> Real:
    """Return ``sum x(t) x(t - lag)`` over all samples of all ``parts`` for lags 0 to ``lags``.

    A short part contributes only to lags below its length.
    """
    total = np.zeros(lags + 1)
    for x in parts:
        most = min(lags, len(x) - 1)
        total[: most + 1] += len(x) * covariances(x, x, most)
    return total


def covariance_spread(first: Real, second: Real, count: int) -> Real:
    """Return n times the covariance of cross-covariances that are 0 to ``count`` - 1 lags apart.

    It is ``sum_k R_1(k) R_2(k + lag)`` over all k from -K to K (16.40), for independent signals.
    ``first`` is R_1(0) to R_1(K), ``second`` R_2(0) to R_2(K + count - 1).
    """
    one, other = (np.concatenate([r[:0:-1], r]) for r in (first, second))
    return np.asarray(np.correlate(other, one, mode="valid")[count - 1 :])


def joint_p_value(cross: Real, lags: NDArray[np.int64], spread: Real, least: float) -> float:
    """Return the probability of cross-covariances at least as large by chance.

    cross, lags
        (n_lags,) cross-covariances and their lags.
    spread
        Covariance of two cross-covariances by the distance of their lags.
    least
        Directions with less than this share of the largest variance are not tested, because periodic
        or smooth inputs make neighbouring lags nearly equal.

    NaN if no direction is left.
    """
    values, vectors = np.linalg.eigh(spread[np.abs(lags[:, None] - lags)])
    kept = values > least * values[-1]
    if not kept.any():
        return float("nan")
    parts = vectors[:, kept].T @ cross
    return float(stats.chi2.sf(np.sum(parts**2 / values[kept]), int(kept.sum())))


def whiteness_p_value(autocorrelation: Real, n_samples: int, *, short: bool) -> Real:
    """Return the probability of autocorrelations at least as large in white noise.

    autocorrelation
        (..., n_lags), at lags from 1 on, normalized to one at lag zero.
    short
        Whether to correct for the n - lag products of each autocorrelation (Ljung and Box 1978), for
        records that are short relative to the lags; otherwise all count alike (16.34).

    The statistic is chi-squared with as many degrees of freedom as lags. Estimated parameters remove a
    few degrees of freedom, which makes the test mild.
    """
    lags = autocorrelation.shape[-1]
    weight = (n_samples + 2) / (n_samples - np.arange(1, lags + 1)) if short else 1.0
    statistic = n_samples * np.sum(autocorrelation**2 * weight, axis=-1)
    return np.asarray(stats.chi2.sf(statistic, lags))
