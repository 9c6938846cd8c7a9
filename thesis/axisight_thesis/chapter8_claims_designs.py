"""The claims of section 8.3.1 on the designs, with computed verdicts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from axisight_thesis.chapter8_compare import (
    COUPLING,
    DIAGONAL,
    LOW_HZ,
    T1,
    T1_SQUARE,
    T2,
    T2_SQUARE,
    Ratio,
    at_square_lines,
    compare,
    comparison_runs,
    disturbance,
    errors,
    except_for,
    listed,
    rank,
)
from axisight_thesis.chapter8_robot import weakly_coupled
from axisight_thesis.chapter8_setting import DESIGNS, PERIOD_S, excited_lines, square_lines
from axisight_thesis.chapter8_sinusoid import snr
from axisight_thesis.chapter8_study import experiments, true_response
from axisight_thesis.chapter8_tables import THESIS_8_2, mean_error_runs, mean_errors, realizations
from axisight_thesis.context import Context
from axisight_thesis.decision import all_of, interval, positive
from axisight_thesis.item import Result, Statements

Real = NDArray[np.float64]

CLAIMS = Statements("8.3.1")


@CLAIMS.claim("8.3.1-nonsymmetric", "The robot is symmetric, the relative error is not.")
def _nonsymmetric(context: Context) -> Result:
    true = true_response(context, excited_lines() / PERIOD_S)
    asymmetry = np.abs(true - np.swapaxes(true, 1, 2)).max() / np.abs(true).max()
    error = mean_errors(context)[T2]
    ratio = error[2, 0] / error[0, 2]
    text = (
        f"G differs from its transpose by {asymmetry:.0e}; T2 without square wave: "
        f"(3,1) {error[2, 0]:.0f} %, (1,3) {error[0, 2]:.0f} %"
    )
    return bool(asymmetry < 1e-6 and ratio > 1.5), text


@CLAIMS.claim("8.3.1-small", "Small elements of G have the larger relative error.")
def _small_elements(context: Context) -> Result:
    size = rank(np.abs(true_response(context, excited_lines() / PERIOD_S)).mean(axis=0).ravel())
    runs = mean_error_runs(context, comparison_runs(context))
    ranks = np.array(
        [
            [np.corrcoef(size, rank(e.ravel()))[0, 1] for e in runs[:, d]]
            for d in range(len(DESIGNS))
        ]
    )
    text = f"rank correlation of mean |G| and error in {len(runs)} realizations (95 %): "
    text += ", ".join(f"{interval(r)} ({d})" for r, d in zip(ranks, DESIGNS, strict=True))
    return all_of([positive(-r) for r in ranks]), text


@CLAIMS.claim("8.3.1-diagonal", "Without square wave T1 and T2 are about the same on the diagonal.")
def _diagonal(context: Context) -> Result:
    error = mean_errors(context)
    ratio = (error[T2] / error[T1])[DIAGONAL]
    return bool(np.all(np.abs(np.log(ratio)) < np.log(1.5))), f"T2 over T1: {listed(ratio)}"


@CLAIMS.claim("8.3.1-offdiagonal", "Without square wave T1 is better off the diagonal.")
def _off_diagonal(context: Context) -> Result:
    error = mean_errors(context)
    ratio = (error[T2] / error[T1])[~DIAGONAL]
    return bool(np.all(ratio > 1)), f"T2 over T1: {listed(ratio)}"


@CLAIMS.claim(
    "8.3.1-t1-best",
    "Without square wave T1 is best except for (2,2) and (3,3), where T2 is slightly better.",
)
def _t1_best(context: Context) -> Result:
    return except_for(compare(context, T1, T2), {(1, 1), (2, 2)}, "T2")


@CLAIMS.claim(
    "8.3.1-vy-diagonal",
    "Without square wave V_y is about diagonal with T1, and of one size in all elements with T2.",
)
def _v_y(context: Context) -> Result:
    sizes = [disturbance(context, DESIGNS[d])[1] for d in (T1, T2)]
    t1, t2 = (s / s[DIAGONAL].mean() for s in sizes)
    text = (
        f"off the diagonal, over the mean of the diagonal: T1 {listed(t1[~DIAGONAL])}; "
        f"T2 {listed(t2[~DIAGONAL])}"
    )
    return bool(t1[~DIAGONAL].max() < 0.5 and np.all(np.abs(np.log(t2)) < np.log(2))), text


@CLAIMS.claim(
    "8.3.1-factor-five",
    "Without square wave the disturbances off the diagonal are at least five times lower with "
    "T1 than with T2.",
)
def _factor_five(context: Context) -> Result:
    t1, t2 = (disturbance(context, DESIGNS[d])[:2] for d in (T1, T2))
    ratio = np.array([(b / a)[~DIAGONAL] for a, b in zip(t1, t2, strict=True)])
    found = [experiments(context, DESIGNS[T1], run) for run in range(realizations(context))]
    torque = np.sqrt(np.mean([np.abs(f.input) ** 2 for f in found], axis=(0, 1)))
    held = (torque / torque[DIAGONAL])[~DIAGONAL]
    text = (
        f"T2 over T1, V_u: {listed(ratio[0])}; V_y: {listed(ratio[1])}. With T1 the axes at rest "
        f"take {100 * held.min():.0f} to {100 * held.max():.0f} % of the moving one's torque, "
        "and proportional ripple with it"
    )
    return bool(ratio.min() >= 5), text


@CLAIMS.claim("8.3.1-equal", "With square wave the disturbances are fairly equal for T1 and T2.")
def _equal(context: Context) -> Result:
    pairs = (T1_SQUARE, T2_SQUARE), (T1, T2)
    ranges = []
    for designs in pairs:
        t1, t2 = (disturbance(context, DESIGNS[d])[:2] for d in designs)
        ranges.append(np.array([b / a for a, b in zip(t1, t2, strict=True)]))
    with_, without = ranges
    text = (
        f"T2 over T1, V_u {with_[0].min():.2f} to {with_[0].max():.2f}, "
        f"V_y {with_[1].min():.2f} to {with_[1].max():.2f}; without square wave up to "
        f"{without[0].max():.0f} and {without[1].max():.0f}"
    )
    return bool(np.all(np.abs(np.log(with_)) < np.log(3))), text


@CLAIMS.claim(
    "8.3.1-square",
    "With square wave T2 is more accurate than T1 except for (2,1), (2,3) and (3,1).",
)
def _square(context: Context) -> Result:
    expected = {(1, 0), (1, 2), (2, 0)}
    holds, text = except_for(compare(context, T2_SQUARE, T1_SQUARE), expected, "T1")
    margin = (THESIS_8_2[T2_SQUARE] / THESIS_8_2[T1_SQUARE])[1, 2]
    runs = np.log(
        mean_error_runs(context, comparison_runs(context))[:, [T2_SQUARE, T1_SQUARE], 1, 2]
    )
    scatter = (runs[:, 0] - runs[:, 1]).std(ddof=1)
    text += (
        f". In (2,3) the thesis has {margin:.2f} from one realization; here one realization "
        f"scatters by {100 * scatter:.0f} %"
    )
    return holds, text


@CLAIMS.claim(
    "8.3.1-snr",
    "With T1 and square wave the signal-to-noise ratio between its lines is poor in (1,2), (1,3), "
    "(2,1) and (3,1) at low frequency.",
)
def poor_snr(context: Context) -> Result:
    """Return whether the signal-to-noise ratio of the coupling of axis 1 is 10 dB below the diagonal."""
    lines = excited_lines()
    at = (lines / PERIOD_S <= LOW_HZ) & ~square_lines(lines)
    runs = range(realizations(context))
    ratios = [snr(experiments(context, DESIGNS[T1_SQUARE], r))[1][at] for r in runs]
    median = np.median(np.concatenate(ratios), axis=0)
    coupling = np.array([median[e] for e in COUPLING])
    diagonal = median[DIAGONAL]
    text = (
        f"median output SNR up to {LOW_HZ:g} Hz: {listed(coupling, '.0f')} dB, diagonal "
        f"{listed(diagonal, '.0f')} dB"
    )
    return bool(coupling.max() < diagonal.min() - 10), text


@CLAIMS.claim(
    "8.3.1-low",
    "With T1 the square wave makes the coupling of axis 1 worse at low frequency.",
)
def _worse_at_low(context: Context) -> Result:
    lines = excited_lines()
    at = (lines / PERIOD_S <= LOW_HZ) & ~square_lines(lines)
    designs = DESIGNS[T1], DESIGNS[T1_SQUARE]

    def coupling(robot: Context, runs: int) -> Real:
        without, with_ = (errors(robot, d, runs)[:, at].mean((0, 1)) for d in designs)
        return np.array([with_[e] / without[e] for e in COUPLING])

    ratio = coupling(context, comparison_runs(context))
    weak = coupling(weakly_coupled(context), realizations(context))
    before, after = (disturbance(context, d, at)[2][DIAGONAL] for d in designs)
    text = (
        f"error with over without up to {LOW_HZ:g} Hz, between lines of the square wave: "
        f"{listed(ratio)}. It keeps the excited motor turning and so moves ripple away from low "
        f"frequency: G V_u + V_y on the diagonal there, with over without: {listed(after / before)}. "
        f"With the weaker coupling of section 8.3.2 the ratios are {listed(weak, '.1f')}"
    )
    return bool(np.all(ratio > 1)), text


@CLAIMS.claim(
    "8.3.1-at-lines",
    "In (2,2) with T1 the square wave leaves the error as it is, but lowers it at its own lines.",
)
def _at_lines(context: Context) -> Result:
    own, others = at_square_lines(context, errors, DESIGNS[T1], DESIGNS[T1_SQUARE], (1, 1))
    holds = (
        own.decided
        and own.value < 1
        and own.value < others.value
        and abs(np.log(others.value)) < np.log(1.5)
    )
    return bool(holds), f"with over without: {own} at its lines, {others} at the others"


@CLAIMS.claim("8.3.1-t2-square", "With T2 the square wave makes little difference.")
def _t2_square(context: Context) -> Result:
    ratio = compare(context, T2_SQUARE, T2).value
    return bool(np.abs(np.log(ratio)).max() < np.log(1.5)), f"with over without: {listed(ratio)}"


@CLAIMS.claim("8.3.1-t2-square-better", "With T2 the square wave is a small improvement.")
def _t2_square_better(context: Context) -> Result:
    logs = np.log(mean_error_runs(context, comparison_runs(context))[:, [T2_SQUARE, T2]])
    ratio = Ratio.of((logs[:, 0] - logs[:, 1]).mean(axis=(1, 2)))
    thesis = THESIS_8_2[T2_SQUARE] / THESIS_8_2[T2]
    text = (
        f"with over without, geometric mean of the elements: {ratio}; in the thesis "
        f"{np.exp(np.log(thesis).mean()):.2f}, of which (2,1) alone is {thesis[1, 0]:.2f}"
    )
    return bool(ratio.decided and ratio.value < 1), text
