"""The conclusions of section 8.4, with computed verdicts."""

from __future__ import annotations

import numpy as np

from axisight.frf.errors import mean_relative_error
from axisight_thesis.chapter8_averages import averaged
from axisight_thesis.chapter8_compare import (
    COUPLING,
    DIAGONAL,
    STANDARD_ERRORS,
    T1,
    T1_SQUARE,
    T2,
    T2_SQUARE,
    compare,
    disturbance,
    except_for,
    listed,
)
from axisight_thesis.chapter8_setting import DESIGNS, PERIOD_S, excited_lines, references
from axisight_thesis.chapter8_sinusoid import single_frequency_error, snr
from axisight_thesis.chapter8_study import experiments, simulate_nonlinear, true_response
from axisight_thesis.chapter8_tables import mean_errors, realizations
from axisight_thesis.context import Context
from axisight_thesis.item import Result, Statements

CLAIMS = Statements("8.4")


@CLAIMS.claim("8.4-excites", "The square wave excites the ripple in all channels.")
def _excites(context: Context) -> Result:
    without, with_ = (disturbance(context, DESIGNS[d])[:2] for d in (T1, T1_SQUARE))
    v_u, v_y = ((b / a)[~DIAGONAL] for a, b in zip(without, with_, strict=True))
    text = (
        f"off the diagonal with T1, with over without: V_y {listed(v_y)}; V_u {listed(v_u)} "
        "(the coupling of axes 2 and 3 excites it without square wave)"
    )
    return bool(v_y.min() > 2 and v_u.min() > 0.8), text


@CLAIMS.claim("8.4-t2", "With square wave T2 is more accurate than T1 except for (2,1) and (3,1).")
def _t2(context: Context) -> Result:
    return except_for(compare(context, T2_SQUARE, T1_SQUARE), {(1, 0), (2, 0)}, "T1")


@CLAIMS.claim("8.4-nonsymmetric", "With T2 (2,1) and (3,1) are much worse than (1,2) and (1,3).")
def _t2_nonsymmetric(context: Context) -> Result:
    error = mean_errors(context)
    ratio = np.array([error[d][j, 0] / error[d][0, j] for d in (T2, T2_SQUARE) for j in (1, 2)])
    text = f"(2,1)/(1,2) and (3,1)/(1,3), without and with square wave: {listed(ratio)}"
    return bool(ratio.min() > 1.5), text


@CLAIMS.claim(
    "8.4-sinusoid-coupling",
    "The gain of a sinusoid matters most in the coupling of axis 1 at low frequency.",
)
def _sinusoid_coupling(context: Context) -> Result:
    multisine = single_frequency_error(context)[1]
    coupling = np.array([multisine[e] for e in COUPLING])
    others = multisine[DIAGONAL | DIAGONAL[[0, 2, 1]]]
    text = f"multisine errors: {listed(100 * coupling, '.0f')} %, others {listed(100 * others, '.0f')} %"
    return bool(coupling.mean() > others.mean()), text


@CLAIMS.claim(
    "8.4-arithmetic",
    "The arithmetic mean over different multisines is not biased off the diagonal.",
)
def _arithmetic(context: Context) -> Result:
    study = averaged(context, 250)
    true = true_response(context, study["frequency_hz"].values)
    distance = np.abs(study["arithmetic_mean"].values - true)
    share = np.mean(distance > STANDARD_ERRORS * study["standard_error"].values, axis=0)
    peak = np.abs(true).argmax(axis=0)
    at_peak = [
        np.take_along_axis(np.abs(study[mean].values / true), peak[None], axis=0)[0]
        for mean in ("arithmetic_mean", "log_mean")
    ]
    u = [experiments(context, DESIGNS[T1_SQUARE], run) for run in range(realizations(context))]
    ratio = np.median([snr(f)[0] for f in u], axis=0)
    low = min(ratio[peak[j, j], j, j] for j in range(3))
    text = (
        f"{100 * share[~DIAGONAL].min():.0f} to {100 * share[~DIAGONAL].max():.0f} % of the lines "
        f"are off by more than {STANDARD_ERRORS:g} standard errors. At the highest resonance of "
        f"each element the arithmetic mean has {listed(at_peak[0])} of the truth, the logarithmic "
        f"{listed(at_peak[1])}: there the input SNR falls to {low:.0f} dB"
    )
    return bool(share[~DIAGONAL].max() < 0.01), text


@CLAIMS.claim("8.4-nonlinear", "The nonlinear model makes a minor difference.")
def _nonlinear(context: Context) -> Result:
    found = simulate_nonlinear(context)
    true = true_response(context, excited_lines() / PERIOD_S)
    ratio = np.array(
        [
            mean_relative_error(f.estimate, true)
            / mean_relative_error(experiments(context, d).estimate, true)
            for f, d in zip(found, DESIGNS, strict=True)
        ]
    )
    still, swung = ratio[[T1, T2]], ratio[[T1_SQUARE, T2_SQUARE]]
    refs = references(context.robot, DESIGNS[T1_SQUARE], context.seed, 0)
    motion = np.cumsum(refs, axis=1) * context.robot.sample_time_s * context.robot.gear_ratio
    swing = np.ptp(motion, axis=1).max()
    text = (
        f"entries of Table 8.2, nonlinear over linear, one realization: {still.min():.2f} to "
        f"{still.max():.2f} without square wave, {swung.min():.2f} to {swung.max():.2f} with it, "
        f"{int((ratio > 1.2).sum())} of 36 above 1.2; it swings the joints by up to "
        f"{swing:.2f} rad, and the response with them"
    )
    return bool(np.abs(np.log(ratio)).max() < np.log(1.4)), text
