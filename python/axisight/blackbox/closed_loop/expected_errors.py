"""Bias and variance that the methods will have in closed loop, Wernholt (2004), section 3.7.

The loop has one input and one output: y = G_0 u + v, v = H_0 e, u = r - F_y y, with the sensitivity
S_0 = 1 / (1 + F_y G_0). Responses and spectra are (n_freq,) at the same frequencies. A spectrum is the
mean |X_N|^2 of the transform X_N = N^-1/2 sum x(t) e^{-iwt}: white noise of variance s has the spectrum
s. Open loop is F_y = 0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy import optimize

from axisight.arguments import Complex, Real, complexes, not_negative, positive, reals, whole
from axisight.display.summary import summarized
from axisight.errors import InputError

ROUNDS = 50
"""Most refits of the start of a limiting model."""

DRAWN_POLES = 200
"""Sets of poles from which a search for a limiting model may begin."""

SEARCHES = 5
"""Starts of least loss that are searched."""


def input_spectra(
    response: ArrayLike,
    controller: ArrayLike,
    reference_spectrum: ArrayLike,
    disturbance_spectrum: ArrayLike,
) -> tuple[Real, Real]:
    """Return the parts of the input spectrum from the reference and from the disturbance, (3.59).

    ``response`` G_0, ``controller`` F_y, ``reference_spectrum`` Phi_r and ``disturbance_spectrum``
    Phi_v are (n_freq,). Raises InputError for other shapes and for spectra below zero.
    """
    g, f = _line("response", response), _line("controller", controller)
    phi_r = _spectrum("reference_spectrum", reference_spectrum)
    phi_v = _spectrum("disturbance_spectrum", disturbance_spectrum)
    _same(len(g), controller=f, reference_spectrum=phi_r, disturbance_spectrum=phi_v)
    gain = 1 / np.abs(1 + f * g) ** 2
    return gain * phi_r, np.abs(f) ** 2 * gain * phi_v


def noise_model_bias(
    response: ArrayLike,
    controller: ArrayLike,
    reference_spectrum: ArrayLike,
    noise_variance: float,
    noise_model: ArrayLike,
    fixed_noise_model: ArrayLike,
) -> Complex:
    """Return the bias B of the direct method with a fixed noise model, (3.62), with its phase.

    ``B = (H_0 - H_*) Phi_eu / Phi_u`` with ``Phi_eu = -conj(F_y S_0 H_0) lambda_0``. A model of the
    plant with enough parameters tends to G_0 + B. ``response`` G_0, ``controller`` F_y,
    ``reference_spectrum`` Phi_r, ``noise_model`` H_0 and ``fixed_noise_model`` H_* are (n_freq,);
    ``noise_variance`` is lambda_0. Raises InputError for other shapes. Source: Ljung (1999), (13.53).
    """
    h, fixed = _line("noise_model", noise_model), _line("fixed_noise_model", fixed_noise_model)
    power = not_negative("noise_variance", noise_variance)
    g, f = _line("response", response), _line("controller", controller)
    _same(len(g), noise_model=h, fixed_noise_model=fixed)
    by_reference, by_noise = input_spectra(g, f, reference_spectrum, power * np.abs(h) ** 2)
    cross = -np.conj(f * h / (1 + f * g)) * power
    total = by_reference + by_noise
    out = np.full(len(g), np.nan, np.complex128)
    known = total > 0
    out[known] = ((h - fixed) * cross)[known] / total[known]
    return out


def asymptotic_variance(
    order: int,
    n_samples: int,
    disturbance_spectrum: ArrayLike,
    reference_input_spectrum: ArrayLike,
) -> Real:
    """Return the variance of G for models of high order, ``n Phi_v / (N Phi_u^r)``, (3.63).

    ``order`` n is the model order, ``n_samples`` N, ``disturbance_spectrum`` Phi_v (n_freq,). Only the
    part of the input spectrum from the reference counts: ``reference_input_spectrum`` Phi_u^r,
    (n_freq,), of `input_spectra`. It holds for the direct, indirect and joint methods (Forssell and
    Ljung, 1999), except within 1/n of 0 and of Nyquist, where it is up to twice as large. Infinite
    where the reference has no power. Raises InputError for other shapes.
    """
    n, count = whole("order", order, 1), whole("n_samples", n_samples, 1)
    phi_v = _spectrum("disturbance_spectrum", disturbance_spectrum)
    phi_u = _spectrum("reference_input_spectrum", reference_input_spectrum)
    _same(len(phi_v), reference_input_spectrum=phi_u)
    return _over(n / count * phi_v, phi_u)


def etfe_bias_bound(
    pulse_response: ArrayLike, peak_input: float, input_power: ArrayLike, n_samples: int
) -> Real:
    """Return the largest bias of the ETFE of a record that is not periodic, (3.64).

    ``|rho_1| <= 2 max|u| sum_k k |g(k)| / sqrt(N)`` (Ljung, 1999, theorem 2.1), over ``|U_N|``.
    ``pulse_response`` g(0), g(1), ...; ``peak_input`` is max|u|, also before the record;
    ``input_power`` is |U_N|^2, (n_freq,), scaled by 1/N; ``n_samples`` N. It is zero for periodic
    records in steady state. Raises InputError for other shapes.
    """
    pulse = reals("pulse_response", pulse_response, "a pulse response of shape (n,)", 1)
    peak, n = not_negative("peak_input", peak_input), whole("n_samples", n_samples, 1)
    power = _spectrum("input_power", input_power)
    rest = 2 * peak * float(np.arange(len(pulse)) @ np.abs(pulse)) / np.sqrt(n)
    return np.sqrt(_over(np.full(len(power), rest**2), power))


def etfe_variance(disturbance_spectrum: ArrayLike, input_power: ArrayLike) -> Real:
    """Return the variance of the ETFE, ``Phi_v / |U_N|^2``, (3.65), without its part of order 1/N.

    ``disturbance_spectrum`` Phi_v and ``input_power`` |U_N|^2 are (n_freq,). At the lines of a periodic
    input |U_N|^2 grows with N. For the indirect and joint methods |U_N|^2 is the part from the reference.
    """
    phi_v = _spectrum("disturbance_spectrum", disturbance_spectrum)
    power = _spectrum("input_power", input_power)
    _same(len(phi_v), input_power=power)
    return _over(phi_v, power)


def wrong_controller_bias(
    response: ArrayLike, controller: ArrayLike, assumed_controller: ArrayLike
) -> Complex:
    """Return the bias of the indirect method if it assumes another controller than the one at work.

    ``G_c / (1 - F G_c) - G_0`` with the ``assumed_controller`` F; ``response`` G_0 and ``controller``
    F_y are at work. All are (n_freq,). NaN where the assumed controller has no solution. Raises
    InputError for other shapes.
    """
    g, f = _line("response", response), _line("controller", controller)
    assumed = _line("assumed_controller", assumed_controller)
    _same(len(g), controller=f, assumed_controller=assumed)
    bottom = 1 + (f - assumed) * g
    out = np.full(len(g), np.nan, np.complex128)
    known = bottom != 0
    out[known] = g[known] / bottom[known] - g[known]
    return out


def expected_errors(
    frequency_hz: ArrayLike,
    *,
    response: ArrayLike,
    controller: ArrayLike,
    reference_spectrum: ArrayLike,
    noise_variance: float,
    noise_model: ArrayLike,
    order: int,
    n_samples: int,
    fixed_noise_model: ArrayLike | None = None,
    assumed_controller: ArrayLike | None = None,
) -> xr.Dataset:
    """Return bias and variance of all methods before the experiment, (3.59) to (3.66).

    frequency_hz
        Frequencies [Hz], (n_freq,), for labels.
    response, controller, reference_spectrum, noise_model
        G_0, F_y, Phi_r and H_0, (n_freq,).
    noise_variance
        Variance lambda_0 of e.
    order, n_samples
        Model order n and number of samples N of (3.63).
    fixed_noise_model
        H_* of the direct method with a fixed noise model, by default 1 (output error).
    assumed_controller
        Controller of the indirect method, by default the true one.

    Variables ``bias`` (approach, frequency_hz), complex, ``variance`` and ``rms_error``, and
    ``sensitivity``, ``input_by_reference``, ``input_by_noise`` over ``frequency_hz``. Approaches:
    ``direct`` (a noise model that fits), ``direct_fixed`` (H_*), ``spectral`` (3.66), ``indirect``,
    ``joint``. The variance is (3.63); ``spectral`` and ``direct_fixed`` have none there: NaN. Raises
    InputError for shapes that do not fit.
    """
    g, f = _line("response", response), _line("controller", controller)
    h = _line("noise_model", noise_model)
    hz = reals("frequency_hz", frequency_hz, "frequencies of shape (n_freq,)", 1)
    power = not_negative("noise_variance", noise_variance)
    phi_v = power * np.abs(h) ** 2
    by_reference, by_noise = input_spectra(g, f, reference_spectrum, phi_v)
    fixed = np.ones_like(h) if fixed_noise_model is None else fixed_noise_model
    assumed = f if assumed_controller is None else assumed_controller
    phi_r = _spectrum("reference_spectrum", reference_spectrum)
    _same(len(g), frequency_hz=hz)
    limit = (g * phi_r - np.conj(f) * phi_v) / (phi_r + np.abs(f) ** 2 * phi_v)
    zero = np.zeros_like(g)
    bias = {
        "direct": zero,
        "direct_fixed": noise_model_bias(g, f, phi_r, power, h, fixed),
        "spectral": limit - g,
        "indirect": wrong_controller_bias(g, f, assumed),
        "joint": zero,
    }
    variance = asymptotic_variance(order, n_samples, phi_v, by_reference)
    spread = np.stack(
        [
            np.full(len(g), np.nan) if name in ("direct_fixed", "spectral") else variance
            for name in bias
        ]
    )
    offset = np.stack(list(bias.values()))
    over = ("approach", "frequency_hz")
    return xr.Dataset(
        {
            "bias": (over, offset),
            "variance": (over, spread),
            "rms_error": (over, np.sqrt(np.abs(offset) ** 2 + spread)),
            "sensitivity": ("frequency_hz", 1 / (1 + f * g)),
            "input_by_reference": ("frequency_hz", by_reference),
            "input_by_noise": ("frequency_hz", by_noise),
        },
        coords={"approach": list(bias), "frequency_hz": hz},
        attrs={"order": int(order), "n_samples": int(n_samples)},
    )


@summarized
@dataclass(frozen=True)
class LimitingModel:
    """The model B / F to which a method tends, from `limiting_model`.

    ``b`` and ``f`` are polynomials in q^-1, delays included. ``response`` (n_freq,) is B / F at the
    given frequencies. ``status`` is ``converged`` or ``max_evaluations``.
    """

    b: Real
    f: Real
    response: Complex = field(repr=False)
    status: str


def limiting_model(
    frequency_hz: ArrayLike,
    target: ArrayLike,
    weight: ArrayLike,
    *,
    nb: int,
    nf: int,
    nk: int = 1,
    sample_time_s: float = 1.0,
    max_evaluations: int = 500,
) -> LimitingModel:
    """Return the output-error model to which the direct method tends, (3.61).

    It minimizes the sum of ``|target - B / F|^2 weight`` over stable F.

    frequency_hz
        Evenly spaced frequencies [Hz] from 0 to Nyquist, (n_freq,).
    target
        G_0 + B of `noise_model_bias`, (n_freq,).
    weight
        Phi_u / |H_*|^2, (n_freq,).
    nb, nf, nk
        Coefficients of B, order of F, and delay, as in `axisight.blackbox.output_error`.
    sample_time_s
        Sample time T [s].
    max_evaluations
        Most evaluations of each of the searches, which begin from several poles.

    Raises InputError for other shapes and orders; non-convergence is a status.
    """
    hz = reals("frequency_hz", frequency_hz, "frequencies of shape (n_freq,)", 1)
    goal = _line("target", target)
    size = np.sqrt(_spectrum("weight", weight))
    _same(len(hz), target=goal, weight=size)
    n_b, n_f, delay = whole("nb", nb, 1), whole("nf", nf, 0), whole("nk", nk, 0)
    step = positive("sample_time_s", sample_time_s)
    if len(hz) <= n_b + n_f:
        raise InputError(f"frequency_hz: expected more than {n_b + n_f} lines, got {len(hz)}")
    late = np.exp(-2j * np.pi * hz * step)
    top = late[:, None] ** np.arange(delay, delay + n_b)
    bottom = late[:, None] ** np.arange(1, n_f + 1)

    def response(theta: Real) -> Complex:
        return np.asarray(top @ theta[:n_b] / (1 + bottom @ theta[n_b:]))

    def residual(theta: Real) -> Real:
        if np.any(np.abs(np.roots(np.r_[1.0, theta[n_b:]])) >= 1):
            return np.full(2 * len(hz), np.nan)
        return _parts(size * (response(theta) - goal))

    def slope(theta: Real) -> Real:
        below = (size / (1 + bottom @ theta[n_b:]))[:, None]
        return _parts(np.hstack([top, -bottom * response(theta)[:, None]]) * below)

    limit = whole("max_evaluations", max_evaluations, 1)
    searches = [
        optimize.least_squares(
            residual,
            start,
            slope,
            x_scale="jac",
            xtol=1e-12,
            ftol=1e-14,
            gtol=1e-14,
            max_nfev=limit,
        )
        for start in _limit_starts(goal, size, top, bottom, residual)
    ]
    found = min(searches, key=lambda one: float(one.cost))
    theta = np.asarray(found.x, np.float64)
    return LimitingModel(
        np.r_[np.zeros(delay), theta[:n_b]],
        np.r_[1.0, theta[n_b:]],
        response(theta),
        "max_evaluations" if found.status == 0 else "converged",
    )


def _limit_starts(
    goal: Complex, size: Real, top: Complex, bottom: Complex, residual: Callable[[Real], Real]
) -> list[Real]:
    """Return starts of the search: the loss has local minima, so poles are drawn all over the circle."""
    n_f = bottom.shape[1]
    rng = np.random.default_rng(0)
    starts = [_refits(goal, size, top, bottom, residual)]
    for _ in range(DRAWN_POLES if n_f else 0):
        radius, angle = rng.uniform(0.2, 0.99, (n_f,)), rng.uniform(0, np.pi, (n_f,))
        poles = radius[: n_f // 2] * np.exp(1j * angle[: n_f // 2])
        real = radius[n_f // 2 : n_f - n_f // 2] if n_f % 2 else np.zeros(0)
        own: Complex = np.asarray(np.poly(np.r_[poles, poles.conj(), real]), np.complex128)
        f = np.asarray(own.real[1:], np.float64)
        weight = size / np.abs(1 + bottom @ f)
        matrix = _parts(np.asarray(top * weight[:, None], np.complex128))
        b = np.linalg.lstsq(matrix, _parts(goal * size), rcond=None)[0]
        starts.append(np.r_[np.asarray(b, np.float64), f])
    starts.sort(key=lambda theta: float(np.sum(residual(theta) ** 2)))
    return starts[:SEARCHES]


def _refits(
    goal: Complex, size: Real, top: Complex, bottom: Complex, residual: Callable[[Real], Real]
) -> Real:
    """Return the best stable refit of the equation error, each weighted by the last 1 / F."""
    best, least = np.zeros(top.shape[1] + bottom.shape[1]), np.inf
    weight = size.copy()
    for _ in range(ROUNDS):
        columns = np.hstack([top, -bottom * goal[:, None]]) * weight[:, None]
        matrix = _parts(np.asarray(columns, np.complex128))
        found = np.linalg.lstsq(matrix, _parts(goal * weight), rcond=None)[0]
        theta = np.asarray(found, np.float64)
        loss = float(np.sum(residual(theta) ** 2))
        if np.isfinite(loss) and loss < least:
            best, least = theta, loss
        weight = size / np.abs(1 + bottom @ theta[top.shape[1] :])
    return best


def _parts(x: Complex) -> Real:
    return np.concatenate([np.asarray(x.real, np.float64), np.asarray(x.imag, np.float64)])


def _line(name: str, value: ArrayLike) -> Complex:
    return complexes(name, value, "numbers of shape (n_freq,)", 1)


def _spectrum(name: str, value: ArrayLike) -> Real:
    found = reals(name, value, "numbers not below zero of shape (n_freq,)", 1)
    if np.any(found < 0):
        raise InputError(f"{name}: expected numbers not below zero, got {found.min():g}")
    return found


def _same(n: int, **arrays: Complex | Real) -> None:
    for name, array in arrays.items():
        if len(array) != n:
            raise InputError(f"{name}: expected {n} frequencies as the response, got {len(array)}")


def _over(top: Real, bottom: Real) -> Real:
    """Return the ratio, infinite where ``bottom`` is zero."""
    out = np.full(np.broadcast_shapes(top.shape, bottom.shape), np.inf)
    np.divide(top, bottom, out=out, where=bottom > 0)
    return out
