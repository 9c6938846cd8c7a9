"""Errors of ``Y U^-1`` in closed loop, Wernholt (2004), chapter 6.

The loop is that of Figure 6.1: ``u = F (r - y)``, ``y = G (u + v_u) + v_y``. All spectra are complex
of shape (n_freq, channel, experiment), and responses are (n_freq, n_out, n_in). The scale of the DFT
does not matter as long as it is the same for all. Outputs and disturbances have one unit, e.g.
motor position [rad] for all of G, F, Y, V. Leakage is neglected, which holds for periodic signals in
steady state.

Every function raises InputError for shapes that do not fit. A line with a singular matrix is NaN, and
so is a ratio over zero.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight.arguments import complex_array, complexes, reals, shown
from axisight.errors import InputError

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def sensitivity(response: ArrayLike, controller: ArrayLike) -> Complex:
    """Return ``S = (I + G F)^-1``, (6.10)."""
    g, f = _stack("response", response), _stack("controller", controller)
    return _inverse(np.eye(g.shape[1]) + _product(g, f))


def reference_to_input(response: ArrayLike, controller: ArrayLike) -> Complex:
    """Return ``G_u = (I + F G)^-1 F``, from reference to input, (6.11)."""
    g, f = _stack("response", response), _stack("controller", controller)
    return _inverse(np.eye(g.shape[2]) + _product(f, g)) @ f


def reference_to_output(response: ArrayLike, controller: ArrayLike) -> Complex:
    """Return ``G_c = G F S``, from reference to output, (6.12)."""
    g, f = _stack("response", response), _stack("controller", controller)
    return _product(g, f) @ sensitivity(g, f)


def total_disturbance(
    response: ArrayLike, input_disturbance: ArrayLike, output_disturbance: ArrayLike
) -> Complex:
    """Return ``V = V_y + G V_u``, the total disturbance at the output, (6.7)."""
    g = _stack("response", response)
    v_u = _stack("input_disturbance", input_disturbance)
    v_y = _stack("output_disturbance", output_disturbance)
    through = _product(g, v_u)
    _same("output_disturbance", v_y, through.shape)
    return v_y + through


def closed_loop_spectra(
    reference: ArrayLike, disturbance: ArrayLike, response: ArrayLike, controller: ArrayLike
) -> tuple[Complex, Complex]:
    """Return U and Y of the loop with total disturbance V, (6.8) and (6.9)."""
    r, v = _stack("reference", reference), _stack("disturbance", disturbance)
    _same("disturbance", v, r.shape)
    g = _stack("response", response)
    u = _product(reference_to_input(g, controller), r - v)
    return u, g @ u + v


def estimation_error(disturbance: ArrayLike, input_: ArrayLike) -> Complex:
    """Return the exact error ``V U^-1`` of the estimate ``Y U^-1``, Lemma 6.1.

    ``input_`` is the measured U, including disturbances, (n_freq, m, m).
    """
    v, u = _stack("disturbance", disturbance), _stack("input", input_)
    return _product(v, _inverse(_square("input", u)))


def error_from_reference(
    disturbance: ArrayLike, reference: ArrayLike, response: ArrayLike, controller: ArrayLike
) -> Complex:
    """Return the exact error of ``Y U^-1`` from reference and disturbance, (6.15) with (6.16)."""
    r, v = _stack("reference", reference), _stack("disturbance", disturbance)
    _same("disturbance", v, r.shape)
    inverse = _inverse(_square("reference", r) - v)
    return _product(v @ inverse, _inverse_input(response, controller))


def approximate_error(
    disturbance: ArrayLike, reference: ArrayLike, response: ArrayLike, controller: ArrayLike
) -> Complex:
    """Return the error ``V R^-1 (G + F^-1)``, to first order in the disturbance, (6.17)."""
    r, v = _stack("reference", reference), _stack("disturbance", disturbance)
    inverse = _inverse(_square("reference", r))
    return _product(_product(v, inverse), _inverse_input(response, controller))


def approximate_error_directions(
    disturbance: ArrayLike,
    scalar_reference: ArrayLike,
    directions: ArrayLike,
    response: ArrayLike,
    controller: ArrayLike,
) -> Complex:
    """Return the error (6.17) for ``r = T r_0``: ``V T^-1 (G + F^-1) / R_0``, (6.18).

    ``scalar_reference`` is R_0, (n_freq,); ``directions`` is T, (m, m).
    """
    v, r0 = _stack("disturbance", disturbance), _any_shape("scalar_reference", scalar_reference)
    if r0.shape != v.shape[:1]:
        raise InputError(f"scalar_reference: expected shape {v.shape[:1]}, got {r0.shape}")
    reference = r0[:, None, None] * _directions(directions)
    return approximate_error(v, reference, response, controller)


def error_variance(disturbance_power: ArrayLike, input_: ArrayLike) -> Real:
    """Return ``E|dG|^2`` for disturbances independent of the excitation and between experiments.

    Element (i, j) is ``E|V_i|^2 sum_e |U^-1_ej|^2``, to first order, or exact for known U.
    ``disturbance_power`` is ``E|V_i|^2``, (n_freq, n_out), after averaging over periods;
    ``input_`` is U without the disturbance, (n_freq, m, m).
    """
    u = _stack("input", input_)
    what = f"numbers not below zero of shape ({len(u)}, n_out)"
    power = reals("disturbance_power", disturbance_power, what, 2)
    if len(power) != len(u) or np.any(power < 0):
        raise InputError(f"disturbance_power: expected {what}, got {shown(power)}")
    columns = np.sum(np.abs(_inverse(_square("input", u))) ** 2, axis=1)
    return np.asarray(power[:, :, None] * columns[:, None, :])


def directions_gain(directions: ArrayLike) -> Real:
    """Return the power that ``T^-1`` passes from disturbances to each column, (m,).

    For disturbances independent of the excitation the gain is ``sum_e |T^-1_ej|^2``: 1 for T1 = I,
    1/2 for T2, 1/m for a Hadamard matrix (section 6.3.3).
    """
    inverse = _inverse(_directions(directions)[None])[0]
    return np.asarray(np.sum(np.abs(inverse) ** 2, axis=0))


def relative_error(estimate: ArrayLike, true: ArrayLike) -> Complex:
    """Return ``(estimate - true) / true`` element by element, (6.3); NaN where true is zero."""
    e, g = _any_shape("estimate", estimate), _any_shape("true", true)
    _same("estimate", e, g.shape)
    return _ratio(e - g, g)


def mean_relative_error(estimate: ArrayLike, true: ArrayLike) -> Real:
    """Return the mean over frequency of the magnitude of the relative error, (6.4).

    Frequency is the first axis. The mean leaves out lines that are NaN; an element without other lines
    is NaN.
    """
    magnitude = np.abs(relative_error(estimate, true))
    counted = np.isfinite(magnitude)
    total = np.where(counted, magnitude, 0.0).sum(axis=0)
    return _ratio(total, counted.sum(axis=0).astype(np.float64))


def signal_to_noise_ratio(signal: ArrayLike, disturbance: ArrayLike) -> Real:
    """Return ``|X|^2 / |V|^2`` element by element, (8.10) and (8.11); NaN without disturbance.

    The ratio is one of powers: in dB it is ``10 log10`` of it.
    """
    x, v = _any_shape("signal", signal), _any_shape("disturbance", disturbance)
    _same("disturbance", v, x.shape)
    return _ratio(np.abs(x) ** 2, np.abs(v) ** 2)


def spectral_analysis_limit(
    response: ArrayLike,
    controller: ArrayLike,
    reference_spectrum: ArrayLike,
    disturbance_spectrum: ArrayLike,
) -> Complex:
    """Return the limit of direct spectral analysis (H1) in the loop ``u = r - F_y y``, (3.66).

    ``G - Phi_v F_y^H (Phi_r + F_y Phi_v F_y^H)^-1 (I + F_y G)``, which for one channel is
    ``(G Phi_r - conj(F_y) Phi_v) / (Phi_r + |F_y|^2 Phi_v)``. Spectra are (n_freq, m, m) and
    (n_freq, p, p); for the loop ``u = F (r - y)`` Phi_r is that of F r.
    """
    g, f = _stack("response", response), _stack("controller", controller)
    phi_r = _stack("reference_spectrum", reference_spectrum)
    phi_v = _stack("disturbance_spectrum", disturbance_spectrum)
    back = _product(phi_v, np.conj(np.swapaxes(f, 1, 2)))
    seen = _product(f, back)
    _same("reference_spectrum", phi_r, seen.shape)
    return g - back @ _inverse(phi_r + seen) @ (np.eye(g.shape[2]) + _product(f, g))


def _inverse_input(response: ArrayLike, controller: ArrayLike) -> Complex:
    """Return ``G_u^-1 = G + F^-1``, (6.16)."""
    g, f = _stack("response", response), _stack("controller", controller)
    _same("controller", f, (len(g), g.shape[2], g.shape[1]))
    return g + _inverse(_square("controller", f))


def _stack(name: str, value: ArrayLike) -> Complex:
    array = complex_array(name, value)
    if array.ndim != 3 or 0 in array.shape:
        raise InputError(f"{name}: expected matrices of shape (n_freq, n, m), got {array.shape}")
    return _without_infinity(array)


def _any_shape(name: str, value: ArrayLike) -> Complex:
    array = complex_array(name, value)
    if not array.size or not array.ndim:
        raise InputError(f"{name}: expected an array of numbers, got shape {array.shape}")
    return _without_infinity(array)


def _without_infinity(array: Complex) -> Complex:
    """Return the array with NaN for infinity, because products with infinity are not meaningful."""
    return np.asarray(np.where(np.isfinite(array), array, np.nan))


def _directions(value: ArrayLike) -> Complex:
    array = complexes("directions", value, "a square matrix", 2)
    if array.shape[0] != array.shape[1]:
        raise InputError(f"directions: expected a square matrix, got shape {array.shape}")
    return array


def _square(name: str, array: Complex) -> Complex:
    if array.shape[1] != array.shape[2]:
        raise InputError(
            f"{name}: expected as many experiments as channels, got shape {array.shape}"
        )
    return array


def _same(name: str, array: NDArray[Any], shape: tuple[int, ...]) -> None:
    if array.shape != shape:
        raise InputError(f"{name}: expected shape {shape}, got {array.shape}")


def _product(a: Complex, b: Complex) -> Complex:
    if len(a) != len(b) or a.shape[2] != b.shape[1]:
        raise InputError(f"expected matrices that can be multiplied, got {a.shape} and {b.shape}")
    return a @ b


def _inverse(matrix: Complex) -> Complex:
    """Return inverses; NaN where a matrix is singular to rounding or not finite."""
    out = np.full(matrix.shape, np.nan, np.complex128)
    good = np.asarray(np.isfinite(matrix).all(axis=(1, 2)))
    values = np.linalg.svd(matrix[good], compute_uv=False)
    good[good] = values[:, -1] > np.finfo(float).eps * values[:, 0]
    out[good] = np.linalg.inv(matrix[good])
    return out


def _ratio(a: NDArray[Any], b: NDArray[Any]) -> NDArray[Any]:
    out = np.full(np.shape(b), np.nan, np.result_type(a, b))
    np.divide(a, b, out=out, where=b != 0)
    return out
