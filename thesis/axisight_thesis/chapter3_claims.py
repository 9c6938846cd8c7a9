"""The statements of sections 3.6 and 3.7 on closed-loop identification, with computed verdicts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from scipy import signal

from axisight.blackbox import (
    ARXModel,
    PolynomialModel,
    arx,
    asymptotic_variance,
    box_jenkins,
    identify_closed_loop,
    limiting_model,
    noise_model_bias,
)
from axisight.records.experiment import Experiment
from axisight_thesis.chapter3_figure import Errors, figure
from axisight_thesis.chapter3_loop import (
    LINES,
    N_SAMPLES,
    WAITING,
    B,
    C,
    Complex,
    D,
    F,
    P,
    Q,
    Real,
    Setting,
    experiment,
    ratio,
    realizations,
    responses,
)
from axisight_thesis.chapter3_methods import (
    HIGH_ORDER,
    box_jenkins_direct,
    high_order_direct,
    high_order_indirect,
    output_error_direct,
    output_error_indirect,
    output_error_joint,
    slow_noise_direct,
    spectral_direct,
)
from axisight_thesis.context import Context
from axisight_thesis.decision import all_of, interval, positive
from axisight_thesis.item import Item, Result, Statements, item

USUAL = Setting(noise_std=0.25)
GRID = np.linspace(0, 0.5, 801)
SMALL = 0.1
"""A bias below this share of that of the direct method with a white noise model counts as none."""
INNER = (LINES > 1 / HIGH_ORDER) & (LINES < 0.5 - 1 / HIGH_ORDER)
"""Lines away from 0 and Nyquist, where (3.63) holds."""

DIRECT = Statements("3.6")
THEORY = Statements("3.7.1")
NONPARAMETRIC = Statements("3.7.2")


@item("claims-3")
def claims_3(context: Context) -> Item:
    """Return the claims of chapter 3, and the errors of all methods."""
    claims = tuple(c for s in (DIRECT, THEORY, NONPARAMETRIC) for c in s.computed(context))
    tables = {"": _methods_table(context)}
    return Item("claims-3", "Claims of chapter 3", tables, {"": _picture(context)}, claims)


def truth() -> Complex:
    """Return G_0 at the lines."""
    return ratio(B, F)


def predicted_bias(setting: Setting, fixed: Complex | None = None) -> Complex:
    """Return G_* - G_0 at the lines, by (3.61) and (3.62), with a fixed noise model (default 1)."""
    assumed = np.ones(len(GRID), np.complex128) if fixed is None else fixed
    g = ratio(B, F, GRID)
    by_reference, by_noise = setting.spectra(GRID)
    power = setting.noise_std**2
    ones = np.ones_like(GRID)
    bias = noise_model_bias(g, setting.controller(GRID), ones, power, ratio(C, D, GRID), assumed)
    weight = (by_reference + by_noise) / np.abs(assumed) ** 2
    limit = limiting_model(GRID, g + bias, weight, nb=2, nf=2)
    return np.asarray(ratio(limit.b, limit.f) - truth())


def share(estimates: Complex, bias: Complex) -> Real:
    """Return each estimate's error along a predicted bias: 1 as predicted, 0 for none."""
    along = np.real((estimates - truth()) @ bias.conj())
    return np.asarray(along / np.real(bias @ bias.conj()))


def within(values: Real, low: float, high: float) -> bool | None:
    """Return whether the mean of independent values is between two limits; None if undecided."""
    return all_of([positive(values - low), positive(high - values)])


def _usual(context: Context, name: str) -> Complex:
    methods = {
        "direct, Box-Jenkins": box_jenkins_direct,
        "direct, output error": output_error_direct,
        "direct, ARX of order 30": high_order_direct,
        "indirect, output error": output_error_indirect,
        "indirect, ARX of order 30": high_order_indirect,
        "joint, output error": output_error_joint,
    }
    return responses(context, name, USUAL, methods[name])


NAMES = (
    "direct, Box-Jenkins",
    "direct, output error",
    "direct, ARX of order 30",
    "indirect, output error",
    "indirect, ARX of order 30",
    "joint, output error",
)


def _methods_table(context: Context) -> pd.DataFrame:
    """Return bias and scatter of every method, relative to |G_0|, and the predicted ones."""
    size = np.linalg.norm(truth())
    bias = predicted_bias(USUAL)
    predicted = {"direct, output error": float(np.linalg.norm(bias) / size)}
    rows = []
    for name in NAMES:
        error = _usual(context, name) - truth()
        spread = error.std(axis=0, ddof=1)
        rows.append(
            {
                "method": name,
                "bias": np.linalg.norm(error.mean(axis=0)) / size,
                "bias_standard_error": np.linalg.norm(spread) / size / np.sqrt(len(error)),
                "predicted_bias": predicted.get(name, 0.0),
                "scatter": np.linalg.norm(spread) / size,
            }
        )
    return pd.DataFrame(rows)


def _picture(context: Context) -> Figure:
    """Return predicted and measured bias and scatter over frequency."""
    by_reference, _ = USUAL.spectra()
    noise = USUAL.disturbance_spectrum()
    return figure(
        truth(),
        np.abs(predicted_bias(USUAL)),
        [
            Errors(name, np.abs(_mean_error(_usual(context, name))))
            for name in ("direct, output error", "direct, Box-Jenkins", "indirect, output error")
        ],
        asymptotic_variance(HIGH_ORDER, N_SAMPLES, noise, by_reference),
        [
            Errors(name, _usual(context, name).std(axis=0, ddof=1))
            for name in ("direct, ARX of order 30", "indirect, ARX of order 30")
        ],
    )


def _unbiased(context: Context, name: str) -> Result:
    """Return whether the bias is below a tenth of that of the direct method with white noise."""
    found = share(_usual(context, name), predicted_bias(USUAL))
    text = f"{name}: {interval(found)} of the bias that a direct output-error model has"
    return within(found, -SMALL, SMALL), text


@DIRECT.claim(
    "3.6-direct",
    "Prediction-error methods work in closed loop if the model can describe the system.",
)
def _direct(context: Context) -> Result:
    return _unbiased(context, "direct, Box-Jenkins")


@DIRECT.claim(
    "3.6-indirect",
    "With the indirect approach all open-loop methods can be used, also output error with coloured "
    "noise.",
)
def _indirect(context: Context) -> Result:
    return _unbiased(context, "indirect, output error")


@DIRECT.claim(
    "3.6-joint", "With the joint input-output approach all open-loop methods can be used likewise."
)
def _joint(context: Context) -> Result:
    return _unbiased(context, "joint, output error")


def _errors(context: Context, limit: float) -> Real:
    """Return errors (realization, approach) relative to |G_0| with the feedback limited."""
    setting = replace(USUAL, gain=2.0, limit=limit)

    def compute() -> Real:
        context.report(f"chapter 3: feedback limited to {limit}")
        rows = []
        for run in range(4 if context.quick else 8):
            x = experiment(context, setting, run)
            found = identify_closed_loop(x, 3, controller=setting.controller_model())
            responses_ = [e.response(LINES)["response"].values for e in found.estimates.values()]
            rows.append([np.linalg.norm(g[:, 0, 0] - truth()) for g in responses_])
        return np.asarray(np.asarray(rows) / np.linalg.norm(truth()))

    return context.shared(("chapter 3", "limit", limit), compute)


def _needs_linear(context: Context, approach: int) -> Result:
    """Compare the error with a limited feedback to that with a linear one."""
    limited, linear = (_errors(context, limit)[:, approach] for limit in (0.5, np.inf))
    logs = np.log(limited / linear)
    text = (
        f"error {100 * limited.mean():.1f} % of |G| with a feedback limited to 0.5, "
        f"{100 * linear.mean():.1f} % without the limit"
    )
    return positive(logs - np.log(1.5)), text


@DIRECT.claim("3.6-indirect-linear", "The indirect approach needs a linear controller.")
def _indirect_linear(context: Context) -> Result:
    return _needs_linear(context, 1)


@DIRECT.claim("3.6-joint-linear", "The joint input-output approach needs a linear controller.")
def _joint_linear(context: Context) -> Result:
    """Whatever the controller, y = G u + v with v independent of r, so S_yr = G S_ur."""
    return _needs_linear(context, 2)


@DIRECT.claim("3.6-information", "A closed-loop data set contains less information.")
def _information(context: Context) -> Result:
    """Compare variances with those in open loop with the same input spectrum."""
    loud = Setting(gain=2.0, noise_std=1.0)

    def compute() -> Real:
        context.report("chapter 3: information in open and closed loop")
        return np.asarray([_information_of(context, loud, r) for r in range(realizations(context))])

    logs = context.shared(("chapter 3", "information"), compute)
    by_reference, by_noise = loud.spectra()
    expected = np.exp(np.mean(np.log((by_reference + by_noise) / by_reference)[INNER]))
    text = (
        "variance in closed loop over that in open loop with the same input spectrum: ARX of order "
        f"{HIGH_ORDER} {np.exp(logs[:, 0].mean()):.2f} ({expected:.2f} by (3.63)), Box-Jenkins of the "
        f"true order {np.exp(logs[:, 1].mean()):.2f}"
    )
    return positive(logs[:, 0]), text


def _information_of(context: Context, setting: Setting, run: int) -> list[float]:
    """Return log ratios of the predicted variances, for high order and for the true order."""
    x = experiment(context, setting, run)
    # Another realization's input has the same spectrum and no relation to this noise.
    u = experiment(context, setting, run + 10_000).input
    e = np.random.default_rng([context.seed, run, 4]).standard_normal(N_SAMPLES)
    y = signal.lfilter(B, F, u[:, 0]) + signal.lfilter(C, D, setting.noise_std * e)
    out = []
    for fit in (_high_order, _true_order):
        one, other = (
            fit(d).response(LINES)["variance"].values[INNER] for d in (x, Experiment(1.0, u, y))
        )
        out.append(float(np.mean(np.log(one / other))))
    return out


def _high_order(x: Experiment) -> ARXModel:
    return arx(x, na=HIGH_ORDER, nb=HIGH_ORDER)


def _true_order(x: Experiment) -> PolynomialModel:
    return box_jenkins(x, nb=2, nc=1, nd=1, nf=2)


@THEORY.claim(
    "3.7.1-bias", "With a fixed noise model the direct method tends to (3.61) with (3.62)."
)
def _bias(context: Context) -> Result:
    bias = predicted_bias(USUAL)
    found = share(_usual(context, "direct, output error"), bias)
    size = np.linalg.norm(bias) / np.linalg.norm(truth())
    text = f"measured over predicted bias {interval(found)}; predicted {100 * size:.0f} % of |G|"
    return within(found, 0.9, 1.1), text


@THEORY.claim(
    "3.7.1-small-bias",
    "The bias is small for a good noise model, little feedback in the input, or little noise.",
)
def _small_bias(context: Context) -> Result:
    base = np.linalg.norm(_mean_error(_usual(context, "direct, output error")))
    cases = {
        "noise model 1/D": (USUAL, slow_noise_direct, 1 / ratio(D, np.ones(1), GRID)),
        "a tenth of the feedback": (replace(USUAL, gain=0.1), output_error_direct, None),
        "a tenth of the noise": (replace(USUAL, noise_std=0.025), output_error_direct, None),
    }
    verdicts, texts = [], []
    for name, (setting, fit, fixed) in cases.items():
        found = responses(context, name, setting, fit)
        unit = predicted_bias(USUAL)
        verdicts.append(positive(0.5 - share(found, unit)))
        expected = np.linalg.norm(predicted_bias(setting, fixed)) / np.linalg.norm(truth())
        seen = np.linalg.norm(_mean_error(found)) / np.linalg.norm(truth())
        texts.append(f"{name} {100 * seen:.1f} % ({100 * expected:.1f} % predicted)")
    text = f"bias {100 * base / np.linalg.norm(truth()):.1f} % of |G|; with {', '.join(texts)}"
    return all_of(verdicts), text


def _mean_error(estimates: Complex) -> Complex:
    return np.asarray(estimates.mean(axis=0) - truth())


def _variance_ratio(estimates: Complex, setting: Setting, order: int) -> Real:
    """Return |error|^2 over (3.63), averaged over lines, by realization."""
    by_reference, _ = setting.spectra()
    expected = asymptotic_variance(order, N_SAMPLES, setting.disturbance_spectrum(), by_reference)
    error = np.abs(estimates - truth()) ** 2
    return np.asarray((error / expected)[:, INNER].mean(axis=1))


@THEORY.claim("3.7.1-variance", "The variance of the direct method with high orders is (3.63).")
def _variance(context: Context) -> Result:
    found = _variance_ratio(_usual(context, "direct, ARX of order 30"), USUAL, HIGH_ORDER)
    other = _variance_ratio(_usual(context, "indirect, ARX of order 30"), USUAL, HIGH_ORDER)
    text = (
        f"measured over predicted variance, order {HIGH_ORDER}: {interval(found)}; indirect method "
        f"{interval(other)}"
    )
    return within(found, 0.8, 1.25), text


@THEORY.claim("3.7.1-order", "More parameters increase the variance in proportion.")
def _order(context: Context) -> Result:
    small = _usual(context, "direct, ARX of order 30")
    large = responses(context, "ARX of order 90", USUAL, lambda x: high_order_direct(x, 90))
    noise = USUAL.disturbance_spectrum()[INNER]
    powers = [np.sum(np.abs(g - truth())[:, INNER] ** 2 / noise, axis=1) for g in (small, large)]
    logs = np.log(powers[1] / powers[0])
    text = f"variance of order 90 over order 30: {np.exp(logs.mean()):.2f}, 3 expected"
    return within(logs, float(np.log(2.25)), float(np.log(4))), text


@THEORY.claim(
    "3.7.1-reference-part",
    "Only the part of the input spectrum from the reference reduces the variance.",
)
def _reference_part(context: Context) -> Result:
    """Add feedback and keep Phi_u^r: the input grows, the variance stays."""
    loud = Setting(gain=2.0, noise_std=1.0)
    opened = replace(loud, gain=0.0)
    runs = range(realizations(context))

    def compute() -> Real:
        context.report("chapter 3: the same reference part in open and closed loop")
        rows = []
        for run in runs:
            pair = []
            for setting in (opened, loud):
                r = _equalized(context, setting, run)
                x = experiment(context, setting, run, reference=r)
                error = np.abs(high_order_direct(x) - truth()) ** 2 / loud.disturbance_spectrum()
                pair += [error[INNER].mean(), x.input.var()]
            rows.append(pair)
        return np.asarray(rows)

    found = context.shared(("chapter 3", "reference part"), compute)
    logs = np.log(found[:, 2] / found[:, 0])
    power = np.mean(found[:, 3] / found[:, 1])
    text = (
        f"feedback raises the power of the input {power:.1f} times at equal Phi_u^r; the variance "
        f"changes by a factor {np.exp(logs.mean()):.2f} (log {interval(logs)})"
    )
    return within(logs, float(np.log(0.8)), float(np.log(1.25))), text


def _equalized(context: Context, setting: Setting, run: int) -> Real:
    """Return a reference that gives u the same part from the reference with any controller."""
    white = np.random.default_rng([context.seed, run, 5]).standard_normal(WAITING + N_SAMPLES)
    back = np.convolve(B, setting.gain * P)
    bottom = np.convolve(F, Q)
    total = bottom + np.pad(back, (0, len(bottom) - len(back)))
    return np.asarray(signal.lfilter(total, bottom, white))


PERIOD = 200


def _periodic(context: Context, run: int, size: float) -> Real:
    """Return a periodic reference with equal lines and random phases."""
    rng = np.random.default_rng([context.seed, run, 6])
    spectrum = np.zeros(PERIOD // 2 + 1, np.complex128)
    spectrum[1:-1] = np.exp(2j * np.pi * rng.random(PERIOD // 2 - 1))
    period = size * np.fft.irfft(spectrum, PERIOD) * np.sqrt(PERIOD)
    count = -(-(WAITING + N_SAMPLES) // PERIOD)
    return np.asarray(np.tile(period, count)[-(WAITING + N_SAMPLES) :])


def _spectral(context: Context, size: float, setting: Setting) -> Complex:
    """Return H1 estimates (realization, line) for a periodic reference of this size."""

    def compute() -> Complex:
        context.report("chapter 3: spectral estimates")
        return np.stack(
            [
                spectral_direct(
                    experiment(context, setting, run, reference=_periodic(context, run, size)),
                    PERIOD,
                )
                for run in range(realizations(context))
            ]
        )

    return context.shared(("chapter 3", "spectral", size, setting), compute)


def _limit(setting: Setting, size: float, frequency: Real) -> Complex:
    """Return (3.66)."""
    g, f = ratio(B, F, frequency), setting.controller(frequency)
    phi_v = setting.disturbance_spectrum(frequency)
    top = g * size**2 - np.conj(f) * phi_v
    return np.asarray(top / (size**2 + np.abs(f) ** 2 * phi_v))


@NONPARAMETRIC.claim(
    "3.7.2-limit", "The nonparametric estimate tends to (3.66), whatever the data."
)
def _spectral_limit(context: Context) -> Result:
    setting = Setting(noise_std=1.0)
    lines = np.arange(1, PERIOD // 2) / PERIOD
    found = _spectral(context, 1.0, setting)
    g = ratio(B, F, lines)
    bias = _limit(setting, 1.0, lines) - g
    along = np.real((found - g) @ bias.conj()) / np.real(bias @ bias.conj())
    size = np.linalg.norm(bias) / np.linalg.norm(g)
    text = f"measured over predicted bias {interval(along)}; predicted {100 * size:.0f} % of |G|"
    return within(along, 0.9, 1.1), text


@NONPARAMETRIC.claim(
    "3.7.2-controller",
    "If the noise dominates, the estimate tends to the inverse of the controller.",
)
def _inverse_controller(context: Context) -> Result:
    setting = Setting(noise_std=1.0)
    lines = np.arange(1, PERIOD // 2) / PERIOD
    found = _spectral(context, 0.01, setting)
    back = setting.controller(lines)
    off = np.linalg.norm(found * back + 1, axis=1) / np.sqrt(len(lines))
    plus = np.linalg.norm(found * back - 1, axis=1) / np.sqrt(len(lines))
    text = (
        f"distance from -1/F_y, with the negative sign of the feedback: {100 * off.mean():.1f} %; "
        f"from 1/F_y {100 * plus.mean():.0f} %"
    )
    return positive(0.1 - off), text


@NONPARAMETRIC.claim(
    "3.7.2-etfe",
    "The variance of the ETFE falls as 1/N for periodic data, and does not fall for other data.",
)
def _etfe(context: Context) -> Result:
    """Compare 5 and 20 periods in open loop, and records of white noise of the same lengths."""
    setting = replace(USUAL, gain=0.0)
    falls: dict[str, list[float]] = {"periodic": [], "other": []}
    for run in range(realizations(context)):
        for name, r in (("periodic", _periodic(context, run, 1.0)), ("other", None)):
            x = experiment(context, setting, run, reference=r)
            powers = []
            for periods in (5, 20):
                n = periods * PERIOD
                step = periods if name == "periodic" else 1
                kept = np.arange(step, n // 2, step)
                u, y = (np.fft.rfft(s[:n, 0])[kept] for s in (x.input, x.output))
                error = y / u - ratio(B, F, kept / n)
                scaled = np.abs(error) ** 2 / setting.disturbance_spectrum(kept / n)
                powers.append(np.median(scaled))
            falls[name].append(float(np.log(powers[1] / powers[0])))
    texts = [f"{name} {np.exp(np.mean(v)):.2f}" for name, v in falls.items()]
    text = f"variance with four times the samples (0.25 is 1/N), medians over lines: {', '.join(texts)}"
    verdict = all_of(
        [
            within(np.asarray(falls["periodic"]), float(np.log(0.2)), float(np.log(0.32))),
            within(np.asarray(falls["other"]), float(np.log(0.75)), float(np.log(1.33))),
        ]
    )
    return verdict, text
