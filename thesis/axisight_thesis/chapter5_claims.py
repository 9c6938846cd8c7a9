"""The statements of chapter 5 on the design of experiments, with computed verdicts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from axisight import excitation
from axisight.blackbox import arx, polynomial_model
from axisight.errors import InputError
from axisight.records import waiting_time_s
from axisight.records.experiment import Experiment
from axisight_thesis.chapter3_claims import within
from axisight_thesis.chapter3_loop import B, C, D, F, ratio
from axisight_thesis.chapter5_transients import TIME_CONSTANT_S, outputs
from axisight_thesis.context import Context
from axisight_thesis.decision import all_of, positive
from axisight_thesis.item import Item, Result, Statements, item

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

PERIOD = 400
BANDS = 5
NOISE_STD = 0.1

INFORMATIVE = Statements("5.2")
SPECTRUM = Statements("5.3")
SIGNALS = Statements("5.4")
TRANSIENTS = Statements("5.6")


@item("claims-5")
def claims_5(context: Context) -> Item:
    """Return the claims of chapter 5."""
    parts = (INFORMATIVE, SPECTRUM, SIGNALS, TRANSIENTS)
    claims = tuple(c for part in parts for c in part.computed(context))
    return Item("claims-5", "Claims of chapter 5", claims=claims)


@INFORMATIVE.claim(
    "5.2-sinusoids",
    "A sum of n sinusoids is persistently exciting of order 2n: it suffices for a system of order n.",
)
def _sinusoids(context: Context) -> Result:
    texts, holds = [], True
    for n in (1, 2, 4):
        t = np.arange(2000)
        u = sum((np.sin(0.6 * (k + 1) * t + k) for k in range(n)), np.zeros(2000))
        lags = np.lib.stride_tricks.sliding_window_view(u, 2 * n + 2)
        rank = int(np.linalg.matrix_rank(lags.T @ lags, tol=1e-8 * len(u)))
        pairs = 0.7 * np.exp(1j * np.linspace(0.5, 2.5, n // 2))
        poles = np.r_[pairs, pairs.conj(), np.full(n % 2, 0.7)]
        bottom = np.real(np.atleast_1d(np.asarray(np.poly(poles))))
        top = np.r_[0, np.linspace(1, 0.5, n)]
        x = Experiment(1.0, u[100:], signal.lfilter(top, bottom, u)[100:])
        found = arx(x, na=n, nb=n).values
        off = float(np.abs(found - np.r_[bottom[1:], top[1:]]).max())
        holds = holds and rank == 2 * n and off < 1e-6
        texts.append(f"n = {n}: order {rank}, error of {2 * n} parameters {off:.0e}")
    return holds, "; ".join(texts)


def _fed_back(context: Context, run: int, back: Real, size: float) -> Experiment:
    """Return an ARX system with u = size r - back(q) y."""
    rng = np.random.default_rng([context.seed, run, 52])
    e, r = rng.standard_normal((2, 3000))
    loop = np.convolve(B, back)
    bottom = F.copy()
    total = np.zeros(max(len(bottom), len(loop)))
    total[: len(bottom)] += bottom
    total[: len(loop)] += loop
    y = signal.lfilter(B, total, size * r) + signal.lfilter([1.0], total, e)
    return Experiment(1.0, size * r - signal.lfilter(back, [1.0], y), y)


@INFORMATIVE.claim(
    "5.2-simple-controller",
    "In closed loop an experiment may be uninformative although the input excites persistently.",
)
def _simple_controller(context: Context) -> Result:
    x = _fed_back(context, 0, np.array([0.3]), 0.0)
    lags = np.lib.stride_tricks.sliding_window_view(x.input[:, 0], 20)
    values = np.linalg.eigvalsh(lags.T @ lags / len(lags))
    excites = bool(values[0] > 1e-6 * values[-1])
    try:
        arx(x, na=2, nb=2)
    except InputError:
        found = "the regressors have no full rank"
        lost = True
    else:
        found = "an ARX model of the true order can be fitted"
        lost = False
    text = (
        f"proportional feedback without reference: least eigenvalue of 20 lags of u "
        f"{values[0] / values[-1]:.0e} of the largest; {found}"
    )
    return excites and lost, text


@INFORMATIVE.claim(
    "5.2-rich", "A more complex controller or a rich reference makes the experiment informative."
)
def _rich(context: Context) -> Result:
    cases = {
        "a controller of four lags": (np.array([0.3, -0.1, 0.1, -0.05]), 0.0),
        "proportional control with a white reference": (np.array([0.3]), 1.0),
    }
    true = np.r_[F[1:], B[1:]]
    holds, texts = True, []
    for name, (back, size) in cases.items():
        model = arx(_fed_back(context, 1, back, size), na=2, nb=2)
        error = model.values - true
        # The 99.9 % quantile of chi-squared with 4 degrees of freedom.
        holds = holds and float(error @ np.linalg.solve(model.covariance, error)) < 18.5
        texts.append(f"{name}: standard error up to {model.std.max():.3f}")
    return holds, "; ".join(texts)


def _etfe_errors(context: Context, power: Real, runs: int) -> Complex:
    """Return errors (run, line) of the ETFE of one period in open loop, for this |U|^2 by line."""
    lines = np.arange(1, PERIOD // 2)
    out = []
    for run in range(runs):
        rng = np.random.default_rng([context.seed, run, 53])
        spectrum = np.zeros(PERIOD // 2 + 1, np.complex128)
        spectrum[lines] = np.sqrt(power) * np.exp(2j * np.pi * rng.random(len(lines)))
        u = np.fft.irfft(spectrum, PERIOD) * np.sqrt(PERIOD)
        y = np.fft.irfft(ratio(B, F, np.arange(PERIOD // 2 + 1) / PERIOD) * np.fft.rfft(u), PERIOD)
        e = NOISE_STD * rng.standard_normal(PERIOD + 200)
        measured = y + signal.lfilter(C, D, e)[200:]
        out.append(
            np.fft.rfft(measured)[lines] / np.fft.rfft(u)[lines] - ratio(B, F, lines / PERIOD)
        )
    return np.stack(out)


def _flatness(context: Context, power: Real, scale: Real) -> tuple[Real, Real]:
    """Return the rms of scaled errors by band, (run, band) and its ratio of largest to smallest."""
    runs = 8 if context.quick else 40
    errors = np.abs(_etfe_errors(context, power / np.mean(power), runs)) / scale
    bands = np.array_split(errors**2, BANDS, axis=1)
    by_band = np.stack([b.mean(axis=1) for b in bands], axis=1)
    means = by_band.mean(axis=0)
    return by_band, np.asarray(np.sqrt(means / means.mean()))


def _even(context: Context, relative: bool) -> Result:
    """Compare the designed spectrum with a flat one of the same power."""
    f = np.arange(1, PERIOD // 2) / PERIOD
    noise = np.abs(ratio(C, D, f)) ** 2
    size = np.abs(ratio(B, F, f))
    scale = size if relative else np.ones_like(size)
    by_band, levels = _flatness(context, noise / scale**2, scale)
    _, flat = _flatness(context, np.ones_like(f), scale)
    logs = np.log(by_band / by_band.mean(axis=1, keepdims=True)) / 2
    # A chi-squared mean of 40 lines has a log of -1/80 on average.
    verdict = all_of([within(logs[:, k], -0.2, 0.2) for k in range(BANDS)])
    text = (
        f"rms error in {BANDS} bands over its mean: {', '.join(f'{v:.2f}' for v in levels)}; with a "
        f"flat spectrum of the same power {', '.join(f'{v:.2f}' for v in flat)}"
    )
    return verdict, text


@SPECTRUM.claim(
    "5.3-absolute",
    "A spectrum in proportion to that of the noise (5.1) gives equal absolute accuracy.",
)
def _absolute(context: Context) -> Result:
    return _even(context, relative=False)


@SPECTRUM.claim("5.3-relative", "The spectrum (5.2) gives equal relative accuracy.")
def _relative(context: Context) -> Result:
    return _even(context, relative=True)


@SIGNALS.claim("5.4-chirp", "A chirp usually has a crest factor of 1.45, about that of a sinusoid.")
def _chirp(context: Context) -> Result:
    bands = ((1.0, 40.0), (1.0, 100.0), (5.0, 200.0), (10.0, 60.0))
    found = [excitation.chirp(10.0, 5e-4, band_hz=band).crest_factor for band in bands]
    text = f"{', '.join(f'{c:.2f}' for c in found)} for four bands"
    return bool(max(abs(c - 1.45) for c in found) < 0.05), text


@SIGNALS.claim(
    "5.4-schroeder",
    "A Schroeder multisine with a flat spectrum typically has a crest factor of 1.7.",
)
def _schroeder(context: Context) -> Result:
    bands = ((1.0, 40.0), (1.0, 100.0), (5.0, 200.0), (10.0, 60.0))
    found = [
        excitation.multisine(10.0, 5e-4, band_hz=band, phases="schroeder").crest_factor
        for band in bands
    ]
    text = f"{', '.join(f'{c:.2f}' for c in found)} for four bands"
    return bool(max(abs(c - 1.7) for c in found) < 0.1), text


@TRANSIENTS.claim(
    "5.6-waiting", "After the waiting time (5.6) the transient is below the other errors."
)
def _waiting(context: Context) -> Result:
    """Compare the transient's mean square over one period with the noise that (5.6) is given."""
    _, output, steady = outputs(40)
    error = output - steady
    amplitude = np.abs(1 / (1 + 2j * np.pi))
    texts, ratios = [], []
    for wanted in (10.0, 100.0, 1000.0):
        wait = waiting_time_s(TIME_CONSTANT_S, 1.0, wanted)
        first = int(np.ceil(wait * 100))
        left = np.sqrt(np.mean(error[first : first + 100] ** 2)) / amplitude
        ratios.append(left * wanted)
        texts.append(f"signal-to-noise {wanted:.0f}: {wait:.1f} s, transient {left * wanted:.2f}")
    return bool(max(ratios) <= 1), f"{'; '.join(texts)} of the noise"


@TRANSIENTS.claim(
    "5.6-parametric",
    "Parametric methods handle transients by estimating the initial conditions.",
)
def _parametric(context: Context) -> Result:
    """Fit records that begin in motion, with the past estimated and taken as zero."""
    logs = []
    true = np.r_[B[1:], F[1:]]
    for run in range(8 if context.quick else 40):
        rng = np.random.default_rng([context.seed, run, 56])
        u = rng.standard_normal(260)
        u[:60] *= 20  # much motion before the record begins
        y = signal.lfilter(B, F, u) + NOISE_STD * rng.standard_normal(260)
        x = Experiment(1.0, u[60:], y[60:])
        errors = [
            np.linalg.norm(polynomial_model(x, nb=2, nf=2, initial=initial).values - true)
            for initial in ("estimate", "zero")
        ]
        logs.append(np.log(errors[1] / errors[0]))
    text = (
        f"error of an output-error model of 200 samples from rest over that with estimated past: "
        f"{np.exp(np.mean(logs)):.1f}"
    )
    return positive(logs), text


@TRANSIENTS.claim("5.6-burst", "A burst whose whole response is recorded has no transient errors.")
def _burst(context: Context) -> Result:
    rng = np.random.default_rng([context.seed, 57])
    u = np.zeros(1024)
    u[:100] = rng.standard_normal(100)
    y = signal.lfilter(B, F, u)
    f = np.arange(1, 512) / 1024
    errors = []
    for length in (150, 1024):
        lines = np.arange(1, length // 2)
        g = np.fft.rfft(y[:length])[lines] / np.fft.rfft(u[:length])[lines]
        errors.append(np.median(np.abs(g / ratio(B, F, lines / length) - 1)))
    text = (
        f"median relative error {errors[0]:.0e} if the record ends 50 samples after the burst, "
        f"{errors[1]:.0e} with the whole response ({len(f)} lines)"
    )
    return bool(errors[1] < 1e-9 < errors[0]), text
