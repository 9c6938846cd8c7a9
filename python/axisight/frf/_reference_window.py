"""Local rational models of responses from a reference, over windows of lines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight.arguments import Complex, Lines, Real

PASSES = 3
"""Solutions for the denominator; each weights the equations by the denominator before."""
SMALLEST = 1e-10
"""Smallest ratio of the diagonal of a triangular factor that counts as full rank."""


@dataclass(frozen=True)
class Windows:
    """Responses at the centre of every window, with what their uncertainty follows from.

    response
        From reference to the signals, (n_lines, n_signals, n_references).
    residual
        Residuals, (n_lines, n_rows, n_signals), white over a window if the noise is.
    gram
        ``E h h^H`` for white noise of power one, (n_lines, n_references, n_references): the covariance
        of the responses of one signal.
    denominator_covariance, denominator_slope
        Covariance of the coefficients of the denominator, (n_lines, order, order), and the derivative
        of the responses by each, (n_lines, order, n_signals, n_references); None without denominator.
    full_rank
        Whether the window determines all responses, (n_lines,).
    """

    response: Complex
    residual: Complex
    gram: Complex
    full_rank: NDArray[np.bool_]
    denominator_covariance: Complex | None = None
    denominator_slope: Complex | None = None


def windows_of(lines: Lines, count: int) -> NDArray[np.int64]:
    """Return the places of the ``count`` lines around every line, (n_lines, count)."""
    first = np.clip(np.arange(len(lines)) - count // 2, 0, len(lines) - count)
    return np.asarray(first[:, None] + np.arange(count))


def fit_windows(
    lines: Lines,
    reference: Complex,
    signals: Complex,
    *,
    count: int,
    order: int,
    denominator_order: int,
    freedom: float,
) -> Windows:
    """Return least-squares fits of ``Z = N / D R`` over ``count`` lines around every line.

    ``reference`` and ``signals`` are (n_lines, channel, experiment). N, one polynomial per pair of
    channels, and D, shared by all signals, are polynomials of the distance to the centre, with D = 1
    there. ``freedom`` is the number of degrees of freedom of a residual.
    """
    places = windows_of(lines, count)
    apart = (lines[places] - lines[:, None]).astype(float)
    apart /= np.abs(apart).max(axis=1, keepdims=True)
    n_experiments, n_references = reference.shape[2], reference.shape[1]
    x = np.repeat(apart, n_experiments, axis=1)
    r, z = (_rows(signal[places]) for signal in (reference, signals))
    powers = x[:, :, None] ** np.arange(order + 1)
    columns = (r[:, :, :, None] * powers[:, :, None, :]).reshape(*x.shape, -1)
    size = np.linalg.norm(columns, axis=1, keepdims=True)
    size = np.where(size > 0, size, 1.0)
    columns /= size
    full_rank = _full_rank(columns)
    columns[~full_rank] = np.eye(columns.shape[1], columns.shape[2])
    d = np.ones(x.shape, np.complex128)
    weight = 1 / _rms(z, axis=1)
    equations = factor = None
    for _ in range(PASSES if denominator_order else 0):
        projected = _Projection(columns / d[:, :, None])
        scaled = z / d[:, :, None]
        terms = [
            projected.residual(x[:, :, None] ** p * scaled) for p in range(1, denominator_order + 1)
        ]
        wide = np.stack([(t * weight[:, None, :]).reshape(len(x), -1) for t in terms], axis=-1)
        right = (projected.residual(scaled) * weight[:, None, :]).reshape(len(x), -1)
        equations, factor = np.linalg.qr(wide)
        found = -np.linalg.solve(factor, _adjoint(equations) @ right[:, :, None])[:, :, 0]
        d = 1 + sum(found[:, p, None] * x ** (p + 1) for p in range(denominator_order))
        weight = 1 / _rms(_Projection(columns / d[:, :, None]).residual(z), axis=1)
    projected = _Projection(columns / d[:, :, None])
    residual = projected.residual(z)
    at_centre = np.arange(n_references) * (order + 1)
    undo = 1 / size[:, 0, at_centre]
    inverse = projected.inverse[:, at_centre] * undo[:, :, None]
    response = np.swapaxes(inverse @ (projected.adjoint @ z), 1, 2)
    gram = inverse @ _adjoint(inverse)
    if equations is None or factor is None:
        return Windows(response, residual, gram, full_rank)
    solved = (np.linalg.inv(factor) @ _adjoint(equations)).reshape(len(x), -1, *z.shape[1:])
    solved = solved * weight[:, None, None, :]
    noise = np.swapaxes(residual, 1, 2) @ residual.conj() / freedom
    covariance = np.einsum("kdms,kst,kfmt->kdf", solved, noise, solved.conj(), optimize=True)
    slope = np.stack(
        [
            np.swapaxes(inverse @ (projected.adjoint @ ((x**p / d)[:, :, None] * z)), 1, 2)
            for p in range(1, denominator_order + 1)
        ],
        axis=1,
    )
    return Windows(response, residual, gram, full_rank, covariance, slope)


class _Projection:
    """Least squares on columns, by QR."""

    def __init__(self, columns: Complex) -> None:
        self.basis, factor = np.linalg.qr(columns)
        self.adjoint = _adjoint(self.basis)
        self.inverse = np.linalg.inv(factor)

    def residual(self, values: Complex) -> Complex:
        return np.asarray(values - self.basis @ (self.adjoint @ values))


def _rows(values: Complex) -> Complex:
    """Return (n_lines, line and experiment of the window, channel)."""
    swapped = np.swapaxes(values, 2, 3)
    return swapped.reshape(len(values), -1, swapped.shape[3])


def _full_rank(columns: Complex) -> NDArray[np.bool_]:
    diagonal = np.abs(np.einsum("kii->ki", np.linalg.qr(columns)[1]))
    return np.asarray(diagonal.min(axis=1) > SMALLEST * diagonal.max(axis=1))


def _rms(values: Complex, axis: int) -> Real:
    found = np.sqrt(np.mean(np.abs(values) ** 2, axis=axis))
    return np.asarray(np.where(found > 0, found, 1.0))


def _adjoint(values: NDArray[Any]) -> Complex:
    return np.asarray(np.conj(np.swapaxes(values, -1, -2)), np.complex128)
