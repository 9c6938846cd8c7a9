"""What sections 8.3 and 8.4 say, as a computed yes or no."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.frf.errors import mean_relative_error
from axisight.reproduce.chapter8_averages import averaged
from axisight.reproduce.chapter8_compare import (
    Ratio,
    at_square_lines,
    compare,
    errors,
    except_for,
    listed,
    mean_error_runs,
    rank,
)
from axisight.reproduce.chapter8_setting import (
    DESIGNS,
    PERIOD_S,
    Design,
    excited_lines,
    references,
    square_lines,
)
from axisight.reproduce.chapter8_study import (
    experiments,
    same_excitation,
    simulate_nonlinear,
    true_response,
)
from axisight.reproduce.chapter8_tables import (
    THESIS_8_2,
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
    true = true_response(context, excited_lines() / PERIOD_S)
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
    size = np.abs(true_response(context, excited_lines() / PERIOD_S)).mean(axis=0).ravel()
    ranks = [float(np.corrcoef(rank(size), rank(e.ravel()))[0, 1]) for e in mean_errors(context)]
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
    return bool(np.all(np.abs(np.log(ratio)) < np.log(1.5))), f"T2 over T1: {listed(ratio)}"


@_claim("8.3.1-offdiagonal", "8.3.1", "Without square wave T1 is better off the diagonal.")
def _off_diagonal(context: Context) -> Result:
    error = mean_errors(context)
    ratio = (error[_T2] / error[_T1])[~DIAGONAL]
    return bool(np.all(ratio > 1)), f"T2 over T1: {listed(ratio)}"


@_claim(
    "8.3.1-t1-best",
    "8.3.1",
    "Without square wave T1 is best except for (2,2) and (3,3), where T2 is slightly better.",
)
def _t1_best(context: Context) -> Result:
    return except_for(compare(context, _T1, _T2), {(1, 1), (2, 2)}, "T2")


@_claim(
    "8.3.1-vy-diagonal",
    "8.3.1",
    "Without square wave V_y is about diagonal with T1, and of one size in all elements with T2.",
)
def _v_y(context: Context) -> Result:
    sizes = [_disturbance(context, DESIGNS[d])[1] for d in (_T1, _T2)]
    t1, t2 = (s / s[DIAGONAL].mean() for s in sizes)
    text = (
        f"off the diagonal, over the mean of the diagonal: T1 {listed(t1[~DIAGONAL])}; "
        f"T2 {listed(t2[~DIAGONAL])}"
    )
    return bool(t1[~DIAGONAL].max() < 0.5 and np.all(np.abs(np.log(t2)) < np.log(2))), text


@_claim(
    "8.3.1-factor-five",
    "8.3.1",
    "Without square wave the disturbances off the diagonal are at least five times lower with "
    "T1 than with T2.",
)
def _factor_five(context: Context) -> Result:
    t1, t2 = (_disturbance(context, DESIGNS[d])[:2] for d in (_T1, _T2))
    ratio = np.array([(b / a)[~DIAGONAL] for a, b in zip(t1, t2, strict=True)])
    found = [experiments(context, DESIGNS[_T1], run) for run in range(realizations(context))]
    torque = np.sqrt(np.mean([np.abs(f.input) ** 2 for f in found], axis=(0, 1)))
    held = (torque / torque[DIAGONAL])[~DIAGONAL]
    text = (
        f"T2 over T1, V_u: {listed(ratio[0])}; V_y: {listed(ratio[1])}. With T1 the axes at rest "
        f"take {100 * held.min():.0f} to {100 * held.max():.0f} % of the moving one's torque, "
        "and proportional ripple with it"
    )
    return bool(ratio.min() >= 5), text


@_claim("8.3.1-equal", "8.3.1", "With square wave the disturbances are fairly equal for T1 and T2.")
def _equal(context: Context) -> Result:
    pairs = (_T1_SQUARE, _T2_SQUARE), (_T1, _T2)
    ranges = []
    for designs in pairs:
        t1, t2 = (_disturbance(context, DESIGNS[d])[:2] for d in designs)
        ranges.append(np.array([b / a for a, b in zip(t1, t2, strict=True)]))
    with_, without = ranges
    text = (
        f"T2 over T1, V_u {with_[0].min():.2f} to {with_[0].max():.2f}, "
        f"V_y {with_[1].min():.2f} to {with_[1].max():.2f}; without square wave up to "
        f"{without[0].max():.0f} and {without[1].max():.0f}"
    )
    return bool(np.all(np.abs(np.log(with_)) < np.log(3))), text


@_claim(
    "8.3.1-square",
    "8.3.1",
    "With square wave T2 is more accurate than T1 except for (2,1), (2,3) and (3,1).",
)
def _square(context: Context) -> Result:
    expected = {(1, 0), (1, 2), (2, 0)}
    holds, text = except_for(compare(context, _T2_SQUARE, _T1_SQUARE), expected, "T1")
    margin = (THESIS_8_2[_T2_SQUARE] / THESIS_8_2[_T1_SQUARE])[1, 2]
    runs = np.log(mean_error_runs(context)[:, [_T2_SQUARE, _T1_SQUARE], 1, 2])
    scatter = (runs[:, 0] - runs[:, 1]).std(ddof=1)
    text += (
        f". In (2,3) the thesis has {margin:.2f} from one realization; here one realization "
        f"scatters by {100 * scatter:.0f} %"
    )
    return holds, text


@_claim(
    "8.3.1-snr",
    "8.3.1",
    "With T1 and square wave the signal-to-noise ratio between its lines is poor in (1,2), (1,3), "
    "(2,1) and (3,1) at low frequency.",
)
def poor_snr(context: Context) -> Result:
    """Return whether the coupling of axis 1 has 10 dB less than the diagonal."""
    lines = excited_lines()
    at = (lines / PERIOD_S <= LOW_HZ) & ~square_lines(lines)
    runs = range(realizations(context))
    ratios = [snr(experiments(context, DESIGNS[_T1_SQUARE], r))[1][at] for r in runs]
    median = np.median(np.concatenate(ratios), axis=0)
    coupling = np.array([median[e] for e in COUPLING])
    diagonal = median[DIAGONAL]
    text = (
        f"median output SNR up to {LOW_HZ:g} Hz: {listed(coupling, '.0f')} dB, diagonal "
        f"{listed(diagonal, '.0f')} dB"
    )
    return bool(coupling.max() < diagonal.min() - 10), text


@_claim(
    "8.3.1-low",
    "8.3.1",
    "With T1 the square wave makes the coupling of axis 1 worse at low frequency.",
)
def _worse_at_low(context: Context) -> Result:
    lines = excited_lines()
    at = (lines / PERIOD_S <= LOW_HZ) & ~square_lines(lines)
    designs = DESIGNS[_T1], DESIGNS[_T1_SQUARE]
    without, with_ = (errors(context, d)[:, at].mean((0, 1)) for d in designs)
    ratio = np.array([with_[e] / without[e] for e in COUPLING])
    before, after = (_disturbance(context, d, at)[2][DIAGONAL] for d in designs)
    text = (
        f"error with over without up to {LOW_HZ:g} Hz, between lines of the square wave: "
        f"{listed(ratio)}. It keeps the excited motor turning and so moves ripple away from low "
        f"frequency: G V_u + V_y on the diagonal there, with over without: {listed(after / before)}"
    )
    return bool(np.all(ratio > 1)), text


@_claim(
    "8.3.1-at-lines",
    "8.3.1",
    "In (2,2) with T1 the square wave leaves the error as it is, but lowers it at its own lines.",
)
def _at_lines(context: Context) -> Result:
    own, others = at_square_lines(context, errors, DESIGNS[_T1], DESIGNS[_T1_SQUARE], (1, 1))
    holds = (
        own.decided
        and own.value < 1
        and own.value < others.value
        and abs(np.log(others.value)) < np.log(1.5)
    )
    return bool(holds), f"with over without: {own} at its lines, {others} at the others"


@_claim("8.3.1-t2-square", "8.3.1", "With T2 the square wave makes little difference.")
def _t2_square(context: Context) -> Result:
    ratio = compare(context, _T2_SQUARE, _T2).value
    return bool(np.abs(np.log(ratio)).max() < np.log(1.5)), f"with over without: {listed(ratio)}"


@_claim("8.3.1-t2-square-better", "8.3.1", "With T2 the square wave is a small improvement.")
def _t2_square_better(context: Context) -> Result:
    logs = np.log(mean_error_runs(context)[:, [_T2_SQUARE, _T2]])
    ratio = Ratio.of((logs[:, 0] - logs[:, 1]).mean(axis=(1, 2)))
    thesis = THESIS_8_2[_T2_SQUARE] / THESIS_8_2[_T2]
    text = (
        f"with over without, geometric mean of the elements: {ratio}; in the thesis "
        f"{np.exp(np.log(thesis).mean()):.2f}, of which (2,1) alone is {thesis[1, 0]:.2f}"
    )
    return bool(ratio.decided and ratio.value < 1), text


@_claim(
    "8.3.2-sinusoid",
    "8.3.2",
    "A single sinusoid raises the signal-to-noise ratio by 20 dB or more on average.",
)
def _sinusoid(context: Context) -> Result:
    ratio = single_frequency_snr(context)
    gain = (ratio[0] - ratio[1]).mean(axis=(1, 2))
    text = f"mean gain: input {gain[0]:.0f} dB, output {gain[1]:.0f} dB"
    return bool(gain.min() > 20), text


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
        f"diagonal {listed((many / few)[DIAGONAL])}, off it {listed((many / few)[~DIAGONAL])}"
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
        f"logarithmic {listed(100 * log, '.1f')} %, arithmetic {listed(100 * arithmetic, '.1f')} %, "
        f"standard error {listed(100 * error, '.1f')} %"
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
        f"20 arithmetic {listed(100 * twenty, '.1f')} %, 250 logarithmic {listed(100 * log, '.1f')} %"
    )
    return bool(np.abs(twenty).max() < np.abs(log).max()), text


@_claim("8.4-excites", "8.4", "The square wave excites the ripple in all channels.")
def _excites(context: Context) -> Result:
    without, with_ = (_disturbance(context, DESIGNS[d])[:2] for d in (_T1, _T1_SQUARE))
    v_u, v_y = ((b / a)[~DIAGONAL] for a, b in zip(without, with_, strict=True))
    text = (
        f"off the diagonal with T1, with over without: V_y {listed(v_y)}; V_u {listed(v_u)} "
        "(the coupling of axes 2 and 3 excites it without square wave)"
    )
    return bool(v_y.min() > 2 and v_u.min() > 0.8), text


@_claim("8.4-t2", "8.4", "With square wave T2 is more accurate than T1 except for (2,1) and (3,1).")
def _t2(context: Context) -> Result:
    return except_for(compare(context, _T2_SQUARE, _T1_SQUARE), {(1, 0), (2, 0)}, "T1")


@_claim("8.4-nonsymmetric", "8.4", "With T2 (2,1) and (3,1) are much worse than (1,2) and (1,3).")
def _t2_nonsymmetric(context: Context) -> Result:
    error = mean_errors(context)
    ratio = np.array([error[d][j, 0] / error[d][0, j] for d in (_T2, _T2_SQUARE) for j in (1, 2)])
    text = f"(2,1)/(1,2) and (3,1)/(1,3), without and with square wave: {listed(ratio)}"
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
    text = f"multisine errors: {listed(100 * coupling, '.0f')} %, others {listed(100 * others, '.0f')} %"
    return bool(coupling.mean() > others.mean()), text


@_claim("8.4-nonlinear", "8.4", "The nonlinear model makes a minor difference.")
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
    still, swung = ratio[[_T1, _T2]], ratio[[_T1_SQUARE, _T2_SQUARE]]
    refs = references(context.robot, DESIGNS[_T1_SQUARE], context.seed, 0)
    motion = np.cumsum(refs, axis=1) * context.robot.sample_time_s * context.robot.core.gear_ratio
    swing = np.ptp(motion, axis=1).max()
    text = (
        f"entries of Table 8.2, nonlinear over linear, one realization: {still.min():.2f} to "
        f"{still.max():.2f} without square wave, {swung.min():.2f} to {swung.max():.2f} with it, "
        f"{int((ratio > 1.2).sum())} of 36 above 1.2; it swings the joints by up to "
        f"{swing:.2f} rad, and the response with them"
    )
    return bool(np.abs(np.log(ratio)).max() < np.log(1.4)), text


def _disturbance(
    context: Context, design: Design, at: NDArray[np.bool_] | None = None
) -> tuple[Real, Real, Real]:
    """Return root mean square V_u, V_y and G V_u + V_y over lines and realizations."""
    kept = slice(None) if at is None else at
    found = [experiments(context, design, run) for run in range(realizations(context))]
    frequency = found[0].frequency_hz
    velocity = true_response(context, frequency) / (2j * np.pi * frequency[:, None, None])
    v_u = np.array([f.input_disturbance for f in found])
    v_y = np.array([f.output_disturbance for f in found])

    def size(values: NDArray[np.complex128]) -> Real:
        return np.asarray(np.sqrt(np.mean(np.abs(values[:, kept]) ** 2, axis=(0, 1))))

    return size(v_u), size(v_y), size(velocity @ v_u + v_y)


def _different(context: Context, runs: int) -> Real:
    """Return the error of the mean over realizations over the mean of their errors."""
    found = [experiments(context, DESIGNS[_T1_SQUARE], run).estimate for run in range(runs)]
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

    Lines are independent; half of E|dG|^2 is along G.
    """
    low = study.sel(frequency_hz=slice(0, LOW_HZ + 1e-9))
    true = true_response(context, low["frequency_hz"].values)
    relative = low["standard_error"].values / np.abs(true)
    total = np.sqrt((relative**2 / 2).sum(axis=0)) / len(relative)
    return np.array([total[e] for e in COUPLING])
