"""What sections 8.3 and 8.4 say, as a computed yes or no."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from axisight.frf.errors import mean_relative_error
from axisight.reproduce.chapter8_averages import averaged
from axisight.reproduce.chapter8_setting import DESIGNS, Design, excited_lines, square_lines
from axisight.reproduce.chapter8_study import (
    experiments,
    same_excitation,
    simulate_nonlinear,
    true_response,
)
from axisight.reproduce.chapter8_tables import (
    mean_errors,
    realizations,
    single_frequency_error,
    single_frequency_snr,
    snr,
)
from axisight.reproduce.context import Context
from axisight.reproduce.item import Claim, Item, item

Real = NDArray[np.float64]
Result = tuple[bool, str]

_T1, _T1_SQUARE, _T2, _T2_SQUARE = range(4)
DIAGONAL = np.eye(3, dtype=bool)
# The coupling between axis one and axes two and three.
COUPLING = ((0, 1), (0, 2), (1, 0), (2, 0))
LOW_HZ = 3.0

_CLAIMS: list[tuple[str, str, str, Callable[[Context], Result]]] = []
Check = Callable[[Context], Result]


def _claim(name: str, section: str, statement: str) -> Callable[[Check], Check]:
    def register(check: Check) -> Check:
        _CLAIMS.append((name, section, statement, check))
        return check

    return register


@item("claims-8")
def claims_8(context: Context) -> Item:
    """Return the claims of chapter 8."""
    claims = []
    for name, section, statement, check in _CLAIMS:
        holds, evidence = check(context)
        claims.append(Claim(name, section, statement, holds, evidence))
    return Item("claims-8", "Claims of chapter 8", claims=tuple(claims))


@_claim("8.3.1-nonsymmetric", "8.3.1", "The robot is symmetric, the relative error is not.")
def _nonsymmetric(context: Context) -> Result:
    true = true_response(context, excited_lines() / 10.0)
    asymmetry = np.abs(true - np.swapaxes(true, 1, 2)).max() / np.abs(true).max()
    error = mean_errors(context)[_T2]
    ratio = error[2, 0] / error[0, 2]
    text = (
        f"G differs from its transpose by {asymmetry:.0e}; T2 without square wave: "
        f"(3,1) {error[2, 0]:.0f} %, (1,3) {error[0, 2]:.0f} %"
    )
    return bool(asymmetry < 1e-6 and ratio > 1.5), text


@_claim("8.3.1-small", "8.3.1", "Small elements of G have the larger relative error.")
def _small_elements(context: Context) -> Result:
    size = np.abs(true_response(context, excited_lines() / 10.0)).mean(axis=0).ravel()
    ranks = [float(np.corrcoef(_rank(size), _rank(e.ravel()))[0, 1]) for e in mean_errors(context)]
    text = "rank correlation of mean |G| and error: " + ", ".join(
        f"{r:.2f} ({d})" for r, d in zip(ranks, DESIGNS, strict=True)
    )
    return bool(max(ranks) < -0.5), text


@_claim(
    "8.3.1-diagonal", "8.3.1", "Without square wave T1 and T2 are about the same on the diagonal."
)
def _diagonal(context: Context) -> Result:
    error = mean_errors(context)
    ratio = (error[_T2] / error[_T1])[DIAGONAL]
    return bool(np.all(np.abs(np.log(ratio)) < np.log(1.5))), f"T2 over T1: {_list(ratio)}"


@_claim("8.3.1-offdiagonal", "8.3.1", "Without square wave T1 is better off the diagonal.")
def _off_diagonal(context: Context) -> Result:
    error = mean_errors(context)
    ratio = (error[_T2] / error[_T1])[~DIAGONAL]
    return bool(np.all(ratio > 1)), f"T2 over T1: {_list(ratio)}"


@_claim(
    "8.3.1-t1-best",
    "8.3.1",
    "Without square wave T1 is best except for (2,2) and (3,3), where T2 is slightly better.",
)
def _t1_best(context: Context) -> Result:
    ratio = mean_errors(context)[_T2] / mean_errors(context)[_T1]
    return _exceptions(ratio < 1, {(1, 1), (2, 2)}, "T2", ratio)


@_claim(
    "8.3.1-vy-diagonal",
    "8.3.1",
    "Without square wave V_y is about diagonal with T1, and of one size in all elements with T2.",
)
def _v_y(context: Context) -> Result:
    sizes = [_disturbance(context, DESIGNS[d])[1] for d in (_T1, _T2)]
    t1, t2 = (s / s[DIAGONAL].mean() for s in sizes)
    text = (
        f"off the diagonal, over the mean of the diagonal: T1 {_list(t1[~DIAGONAL])}; "
        f"T2 {_list(t2[~DIAGONAL])}"
    )
    return bool(t1[~DIAGONAL].max() < 0.5 and np.all(np.abs(np.log(t2)) < np.log(2))), text


@_claim(
    "8.3.1-factor-five",
    "8.3.1",
    "Without square wave the disturbances off the diagonal are at least five times lower with "
    "T1 than with T2.",
)
def _factor_five(context: Context) -> Result:
    t1, t2 = (_disturbance(context, DESIGNS[d]) for d in (_T1, _T2))
    ratio = np.array([(b / a)[~DIAGONAL] for a, b in zip(t1, t2, strict=True)])
    text = f"T2 over T1, V_u: {_list(ratio[0])}; V_y: {_list(ratio[1])}"
    return bool(ratio.min() >= 5), text


@_claim("8.3.1-equal", "8.3.1", "With square wave the disturbances are fairly equal for T1 and T2.")
def _equal(context: Context) -> Result:
    t1, t2 = (_disturbance(context, DESIGNS[d]) for d in (_T1_SQUARE, _T2_SQUARE))
    ratio = np.array([b / a for a, b in zip(t1, t2, strict=True)])
    text = (
        f"T2 over T1, V_u {ratio[0].min():.2f} to {ratio[0].max():.2f}, "
        f"V_y {ratio[1].min():.2f} to {ratio[1].max():.2f}"
    )
    return bool(np.all(np.abs(np.log(ratio)) < np.log(2))), text


@_claim(
    "8.3.1-square",
    "8.3.1",
    "With square wave T2 is more accurate than T1 except for (2,1), (2,3) and (3,1).",
)
def _square(context: Context) -> Result:
    ratio = mean_errors(context)[_T2_SQUARE] / mean_errors(context)[_T1_SQUARE]
    return _exceptions(ratio > 1, {(1, 0), (1, 2), (2, 0)}, "T1", ratio)


@_claim(
    "8.3.1-snr",
    "8.3.1",
    "With T1 and square wave the signal-to-noise ratio between its lines is poor in (1,2), (1,3), "
    "(2,1) and (3,1) at low frequency.",
)
def _poor_snr(context: Context) -> Result:
    lines = excited_lines()
    at = (lines / 10.0 <= LOW_HZ) & ~square_lines(lines)
    runs = range(realizations(context))
    ratios = [snr(experiments(context, DESIGNS[_T1_SQUARE], r))[1][at] for r in runs]
    median = np.median(np.concatenate(ratios), axis=0)
    coupling = np.array([median[e] for e in COUPLING])
    diagonal = median[DIAGONAL]
    text = (
        f"median output SNR up to {LOW_HZ:g} Hz: {_list(coupling, '.0f')} dB, diagonal "
        f"{_list(diagonal, '.0f')} dB"
    )
    return bool(coupling.max() < diagonal.min() - 10), text


@_claim(
    "8.3.1-low",
    "8.3.1",
    "With T1 the square wave makes the coupling of axis 1 worse at low frequency.",
)
def _worse_at_low(context: Context) -> Result:
    low = excited_lines() / 10.0 <= LOW_HZ
    without, with_ = (_errors(context, DESIGNS[d])[:, low].mean((0, 1)) for d in (_T1, _T1_SQUARE))
    ratio = np.array([with_[e] / without[e] for e in COUPLING])
    return bool(np.all(ratio > 1)), f"error with over without, up to {LOW_HZ:g} Hz: {_list(ratio)}"


@_claim(
    "8.3.1-at-lines",
    "8.3.1",
    "In (2,2) with T1 the square wave leaves the error as it is, but lowers it at its own lines.",
)
def _at_lines(context: Context) -> Result:
    at = square_lines(excited_lines())
    without, with_ = (_errors(context, DESIGNS[d])[..., 1, 1] for d in (_T1, _T1_SQUARE))
    own = np.exp(np.log(with_[:, at] / without[:, at]).mean())
    others = np.exp(np.log(with_[:, ~at] / without[:, ~at]).mean())
    text = f"with over without, geometric mean: {own:.2f} at its lines, {others:.2f} at the others"
    return bool(own < 0.9 and own < others and abs(np.log(others)) < np.log(1.5)), text


@_claim(
    "8.3.1-t2-square",
    "8.3.1",
    "With T2 the square wave makes little difference, a small improvement.",
)
def _t2_square(context: Context) -> Result:
    ratio = mean_errors(context)[_T2_SQUARE] / mean_errors(context)[_T2]
    text = f"with over without: {_list(ratio.ravel())}; geometric mean {_geometric(ratio):.2f}"
    return bool(np.abs(np.log(ratio)).max() < np.log(2) and _geometric(ratio) < 1), text


@_claim(
    "8.3.2-sinusoid", "8.3.2", "A single sinusoid raises the signal-to-noise ratio by 20 dB or so."
)
def _sinusoid(context: Context) -> Result:
    ratio = single_frequency_snr(context)
    gain = (ratio[0] - ratio[1]).mean(axis=(1, 2))
    text = f"mean gain: input {gain[0]:.0f} dB, output {gain[1]:.0f} dB"
    return bool(gain.min() > 15), text


@_claim("8.3.2-error", "8.3.2", "A single sinusoid is much more accurate in every element.")
def _sinusoid_error(context: Context) -> Result:
    sinusoid, multisine = single_frequency_error(context)
    gain = multisine / sinusoid
    text = (
        f"multisine {100 * multisine.min():.0f} to {100 * multisine.max():.0f} %, sinusoid "
        f"{100 * sinusoid.min():.2f} to {100 * sinusoid.max():.2f} %, gain at least {gain.min():.0f}"
    )
    return bool(gain.min() > 10), text


@_claim(
    "8.3.3-same",
    "8.3.3",
    "Averaging over experiments with the same excitation gains nothing against ripple.",
)
def _same(context: Context) -> Result:
    found = same_excitation(context, DESIGNS[_T1_SQUARE], 8)
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


@_claim(
    "8.3.3-realizations",
    "8.3.3",
    "Averaging over different multisines improves the estimate, also off the diagonal.",
)
def _realizations(context: Context) -> Result:
    few = mean_errors(context)[_T1_SQUARE] / 100
    study = averaged(context, 250)
    many = _mean_error(study, "arithmetic_mean", context)
    text = (
        f"error of the arithmetic mean of {int(study.attrs['runs'])} over that of one: "
        f"diagonal {_list((many / few)[DIAGONAL])}, off it {_list((many / few)[~DIAGONAL])}"
    )
    return bool(np.all(many < few)), text


@_claim(
    "8.3.3-log-bias",
    "8.3.3",
    "The logarithmic mean keeps a bias at low frequency in the coupling of axis 1, "
    "the arithmetic mean does not.",
)
def _log_bias(context: Context) -> Result:
    study = averaged(context, 250)
    log, arithmetic = (_low_bias(context, study, m) for m in ("log_mean", "arithmetic_mean"))
    error = _standard_error(context, study)
    text = (
        f"mean of |estimate| / |G| - 1 up to {LOW_HZ:g} Hz in (1,2), (1,3), (2,1), (3,1): "
        f"logarithmic {_list(100 * log, '.1f')} %, arithmetic {_list(100 * arithmetic, '.1f')} %, "
        f"standard error {_list(100 * error, '.1f')} %"
    )
    biased = np.abs(log) > 3 * error
    return bool(np.any(biased) and np.all(np.abs(arithmetic) < 3 * error)), text


@_claim(
    "8.3.3-twenty",
    "8.3.3",
    "The arithmetic mean of 20 realizations is less biased than the logarithmic mean of 250.",
)
def _twenty(context: Context) -> Result:
    log = _low_bias(context, averaged(context, 250), "log_mean")
    twenty = _low_bias(context, averaged(context, 20), "arithmetic_mean")
    text = (
        f"mean of |estimate| / |G| - 1 up to {LOW_HZ:g} Hz in (1,2), (1,3), (2,1), (3,1): "
        f"20 arithmetic {_list(100 * twenty, '.1f')} %, 250 logarithmic {_list(100 * log, '.1f')} %"
    )
    return bool(np.abs(twenty).max() < np.abs(log).max()), text


@_claim("8.4-excites", "8.4", "The square wave excites the ripple in all channels.")
def _excites(context: Context) -> Result:
    without, with_ = (_disturbance(context, DESIGNS[d]) for d in (_T1, _T1_SQUARE))
    ratio = np.array([(b / a)[~DIAGONAL] for a, b in zip(without, with_, strict=True)])
    text = (
        f"off the diagonal with T1, with over without: V_u {_list(ratio[0])}, V_y {_list(ratio[1])}"
    )
    return bool(ratio.min() > 2), text


@_claim("8.4-t2", "8.4", "With square wave T2 is more accurate than T1 except for (2,1) and (3,1).")
def _t2(context: Context) -> Result:
    ratio = mean_errors(context)[_T2_SQUARE] / mean_errors(context)[_T1_SQUARE]
    return _exceptions(ratio > 1, {(1, 0), (2, 0)}, "T1", ratio)


@_claim("8.4-nonsymmetric", "8.4", "With T2 (2,1) and (3,1) are much worse than (1,2) and (1,3).")
def _t2_nonsymmetric(context: Context) -> Result:
    error = mean_errors(context)
    ratio = np.array([error[d][j, 0] / error[d][0, j] for d in (_T2, _T2_SQUARE) for j in (1, 2)])
    text = f"(2,1)/(1,2) and (3,1)/(1,3), without and with square wave: {_list(ratio)}"
    return bool(ratio.min() > 1.5), text


@_claim(
    "8.4-sinusoid-coupling",
    "8.4",
    "The gain of a sinusoid matters most in the coupling of axis 1 at low frequency.",
)
def _sinusoid_coupling(context: Context) -> Result:
    multisine = single_frequency_error(context)[1]
    coupling = np.array([multisine[e] for e in COUPLING])
    others = multisine[DIAGONAL | DIAGONAL[[0, 2, 1]]]
    text = (
        f"multisine errors: {_list(100 * coupling, '.0f')} %, others {_list(100 * others, '.0f')} %"
    )
    return bool(coupling.mean() > others.mean()), text


@_claim("8.4-nonlinear", "8.4", "The nonlinear model makes a minor difference.")
def _nonlinear(context: Context) -> Result:
    found = simulate_nonlinear(context)
    true = true_response(context, excited_lines() / 10.0)
    error = np.array([100 * mean_relative_error(f.estimate, true) for f in found])
    linear = np.array(
        [100 * mean_relative_error(experiments(context, d).estimate, true) for d in DESIGNS]
    )
    ratio = error / linear
    text = (
        f"entries of Table 8.2, nonlinear over linear, one realization: {ratio.min():.2f} to "
        f"{ratio.max():.2f}, median {np.median(ratio):.2f}"
    )
    return bool(np.median(np.abs(np.log(ratio))) < np.log(1.2)), text


def _disturbance(context: Context, design: Design) -> tuple[Real, Real]:
    """Return root mean square V_u and V_y of each element over lines and realizations."""
    found = [experiments(context, design, run) for run in range(realizations(context))]

    def size(name: str) -> Real:
        values = np.concatenate([getattr(f, name) for f in found])
        return np.asarray(np.sqrt(np.mean(np.abs(values) ** 2, axis=0)))

    return size("input_disturbance"), size("output_disturbance")


def _errors(context: Context, design: Design) -> Real:
    """Return relative errors, (realization, n_freq, output, input)."""
    found = [experiments(context, design, run) for run in range(realizations(context))]
    true = true_response(context, found[0].frequency_hz)
    return np.array([np.abs(f.estimate / true - 1) for f in found])


def _different(context: Context, runs: int) -> Real:
    """Return the error of the mean over realizations over the mean of their errors."""
    found = [experiments(context, DESIGNS[_T1_SQUARE], run).estimate for run in range(runs)]
    true = true_response(context, excited_lines() / 10.0)
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

    Lines are independent; half of E|dG|^2 is along G.
    """
    low = study.sel(frequency_hz=slice(0, LOW_HZ + 1e-9))
    true = true_response(context, low["frequency_hz"].values)
    relative = low["standard_error"].values / np.abs(true)
    total = np.sqrt((relative**2 / 2).sum(axis=0)) / len(relative)
    return np.array([total[e] for e in COUPLING])


def _exceptions(
    other: NDArray[np.bool_], expected: set[tuple[int, int]], winner: str, ratio: Real
) -> Result:
    """Return whether exactly the ``expected`` elements are ``other``, and the ratios."""
    found = {(int(i), int(j)) for i, j in np.argwhere(other)}
    where = ", ".join(f"({i + 1},{j + 1})" for i, j in sorted(found)) or "none"
    text = f"{winner} better in {where}; T2 over T1: {_list(ratio.ravel())}"
    return found == expected, text


def _geometric(values: Real) -> float:
    return float(np.exp(np.log(values).mean()))


def _rank(values: Real) -> Real:
    return np.asarray(pd.Series(values).rank().to_numpy(float))


def _list(values: Real, form: str = ".2f") -> str:
    return ", ".join(format(float(v), form) for v in np.ravel(values))
