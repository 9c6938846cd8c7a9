"""State-space realizations of rational models, of the least order that their residues allow.

A pole with residue R_k, a matrix, takes rank(R_k) states, and a complex pair twice as many. The
integrators I_1 / x + I_2 / x^2 take the rank of the Hankel matrix [[I_1, I_2], [I_2, 0]] (Ho and
Kalman). Mechanical modes have residues of rank one: with `rank=1` each mode keeps one input and one
output direction. Input and output matrices are then fitted again in turn, with fixed poles, until
the loss settles.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy import linalg, signal

from axisight.blackbox._data import Complex, Real, lines, whole
from axisight.blackbox._model import control_module, evaluate
from axisight.blackbox._sections import Weighted
from axisight.blackbox.rational import RationalModel
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.frf.response import frequency_response
from axisight.statistics.least_squares import scaled_solution

ROUNDS = 50
"""Most rounds of fitting inputs and outputs in turn."""


@summarized
@dataclass(frozen=True)
class Realization:
    """A state-space realization of a rational model.

        x' = A x + B u,   or x(t+T) = A x + B u with ``sample_time_s``;   y = C x + D u

    ``loss`` is the weighted loss of the rational fit, computed for this realization. ``status`` is
    ``exact`` if the realization keeps all of the rational model. If the rank was cut and the model
    fitted again, it is ``converged`` or ``not_converged``.
    """

    a: Real
    b: Real
    c: Real
    d: Real
    sample_time_s: float | None
    loss: float
    status: str

    @property
    def order(self) -> int:
        """Number of states."""
        return int(self.a.shape[0])

    @property
    def poles(self) -> Complex:
        """Eigenvalues of A [rad/s, or z]."""
        return np.linalg.eigvals(self.a).astype(np.complex128)

    def response(
        self, frequency_hz: ArrayLike, *, input_unit: str = "Nm", output_unit: str = "rad"
    ) -> xr.Dataset:
        """Return G in the format of `axisight.frf.frequency_response`, with variance NaN.

        ``frequency_hz`` [Hz] ascends; ``input_unit`` and ``output_unit`` are labels. Raises
        InputError for other frequencies.
        """
        f = lines(frequency_hz, self.sample_time_s)
        s = 2j * np.pi * f
        at = np.asarray(s if self.sample_time_s is None else np.exp(s * self.sample_time_s))
        return frequency_response(
            f,
            evaluate(self.a, self.b, self.c, self.d, at),
            estimator="rational",
            input_unit=input_unit,
            output_unit=output_unit,
            attrs={"order": self.order},
        )

    def to_scipy(self) -> signal.StateSpace:
        """Return a ``scipy.signal.StateSpace``."""
        if self.sample_time_s is None:
            return signal.StateSpace(self.a, self.b, self.c, self.d)
        return signal.StateSpace(self.a, self.b, self.c, self.d, dt=self.sample_time_s)

    def to_control(self) -> Any:
        """Return a ``control.StateSpace``. Raises MissingExtraError without python-control."""
        step = 0 if self.sample_time_s is None else self.sample_time_s
        return control_module().ss(self.a, self.b, self.c, self.d, step)


def realize(
    model: RationalModel, *, rank: int | None = None, rank_tolerance: float = 1e-8
) -> Realization:
    """Return a state-space realization of a rational ``model``.

    rank
        Largest rank of each pole's residue, after which the model is fitted again; integrators are
        not cut. None keeps all directions above ``rank_tolerance``.
    rank_tolerance
        Singular values of a residue below this share of its largest are dropped.

    Raises InputError for misuse, and for real poles that coincide, because their residues are
    infinite.
    """
    most = None if rank is None else whole("rank", rank, 1)
    if not 0 <= rank_tolerance < 1:
        raise InputError(f"rank_tolerance: expected a number from 0 below 1, got {rank_tolerance}")
    p, m, n = model.n_out, model.n_in, model.order
    blocks = [
        _block(pole, residue, most, rank_tolerance)
        for pole, residue in _residues(model)
        if pole.imag >= 0
    ]
    cut = any(lost for *_, lost in blocks)
    parts = [block[:3] for block in blocks]
    if model.integrators:
        found = model.numerators[:, n : n + model.integrators].T.reshape(-1, p, m)
        parts.append(_integrators(found, rank_tolerance))
    a = linalg.block_diag(*(part[0] for part in parts)) if parts else np.zeros((0, 0))
    b = np.vstack([part[1] for part in parts]) if parts else np.zeros((0, m))
    c = np.hstack([part[2] for part in parts]) if parts else np.zeros((p, 0))
    a = a.reshape(len(b), len(b))
    d, status = model.direct.copy(), "exact"
    has_direct = model.problem.extra.shape[1] > model.integrators
    if cut:
        b, c, d, status = _refitted(model.problem, a, b, c, d, has_direct)
    loss = _loss(model.problem, evaluate(a, b, c, d, model.problem.x))
    scale = model.domain.scale_rad_s
    if model.sample_time_s is None:
        return Realization(a * scale, b * scale, c, d, None, loss, status)
    step = model.domain.step
    return Realization(np.eye(len(a)) + step * a, step * b, c, d, model.sample_time_s, loss, status)


def _residues(model: RationalModel) -> list[tuple[complex, Complex]]:
    """Return every pole in x with its residue (n_out, n_in)."""
    shape = (model.n_out, model.n_in)
    out: list[tuple[complex, Complex]] = []
    poles = model.sections.poles()
    for k, (b, _) in enumerate(model.sections.quadratic):
        first, second = (model.numerators[:, 2 * k + i].reshape(shape) for i in (0, 1))
        for x in poles[2 * k : 2 * k + 2]:
            steep = 2 * x + b
            if abs(steep) < 1e-9 * max(abs(x), 1e-300):
                raise InputError(
                    "model: two real poles coincide, their residues are infinite: change the order"
                )
            out.append((complex(x), np.asarray((first + second * x) / steep, np.complex128)))
    if len(model.sections.linear):
        out.append(
            (
                complex(poles[-1]),
                np.asarray(model.numerators[:, model.order - 1].reshape(shape), np.complex128),
            )
        )
    return out


def _block(
    pole: complex, residue: Complex, most: int | None, tolerance: float
) -> tuple[Real, Real, Real, bool]:
    """Return A, B, C of a pole (and its conjugate, if complex), and whether its rank was cut."""
    real = pole.imag == 0
    u, s, vh = np.linalg.svd(residue.real if real else residue)
    kept = max(int(np.sum(s > tolerance * s[0])), 1)
    count = kept if most is None else min(kept, most)
    c = u[:, :count] * np.sqrt(s[:count])
    b = np.sqrt(s[:count])[:, None] * vh[:count]
    if real:
        return pole.real * np.eye(count), b, c, count < kept
    turn = np.array([[pole.real, -pole.imag], [pole.imag, pole.real]])
    return (
        np.kron(np.eye(count), turn),
        np.stack([b.real, b.imag], axis=1).reshape(2 * count, -1),
        np.stack([2 * c.real, -2 * c.imag], axis=2).reshape(len(c), 2 * count),
        count < kept,
    )


def _integrators(found: Real, tolerance: float) -> tuple[Real, Real, Real]:
    """Return A, B, C of the poles at zero from I_1 and, for a double one, I_2."""
    first = found[0]
    p, m = first.shape
    if len(found) == 1:
        hankel, shifted = first, np.zeros((p, m))
    else:
        zero, second = np.zeros((p, m)), found[1]
        # Poles near zero can take over part of I_1, so rows and columns are scaled to one size.
        hankel = np.block([[first, second], [second, zero]])
        shifted = np.block([[second, zero], [zero, zero]])
    u, s, vh = np.linalg.svd(hankel)
    count = max(int(np.sum(s > tolerance * s[0])), 1)
    root = np.sqrt(s[:count])
    a = (u[:, :count] / root).T @ shifted @ (vh[:count].T / root)
    return a, root[:, None] * vh[:count, :m], u[:p, :count] * root


def _refitted(
    problem: Weighted, a: Real, b: Real, c: Real, d: Real, has_direct: bool
) -> tuple[Real, Real, Real, str]:
    """Fit C and D with B fixed, then B with C and D fixed, until the loss settles."""
    p, m = d.shape
    eye = np.eye(len(a))
    inverse = np.linalg.inv(problem.x[:, None, None] * eye - a)
    before = np.inf
    for _ in range(ROUNDS):
        states = inverse @ b
        for i in range(p):
            elements = slice(i * m, (i + 1) * m)
            columns = np.moveaxis(states, 2, 0)
            if has_direct:
                units = np.zeros((m, len(problem.x), m), np.complex128)
                units[np.arange(m), :, np.arange(m)] = 1.0
                columns = np.concatenate([columns, units], axis=2)
            theta = _weighted_solution(problem, columns, elements)
            c[i] = theta[: len(a)]
            if has_direct:
                d[i] = theta[len(a) :]
        seen = np.moveaxis(c @ inverse, 1, 0)
        for j in range(m):
            b[:, j] = _weighted_solution(problem, seen, slice(j, p * m, m), d[:, j])
        loss = _loss(problem, evaluate(a, b, c, d, problem.x))
        if before - loss <= 1e-9 * loss:
            return b, c, d, "converged"
        before = loss
    return b, c, d, "not_converged"


def _weighted_solution(
    problem: Weighted, columns: Complex, elements: slice, offset: Real | None = None
) -> Real:
    """Return real coefficients of columns (n_elements, n_freq, n) that fit some elements."""
    weight = problem.weight[:, elements].T
    values = problem.values[:, elements].T
    if offset is not None:
        values = values - offset[:, None]
    rows = (weight[:, :, None] * columns).reshape(-1, columns.shape[2])
    target = (weight * values).ravel()
    return scaled_solution(
        np.concatenate([rows.real, rows.imag]), np.concatenate([target.real, target.imag]), 1e-13
    )


def _loss(problem: Weighted, g: Complex) -> float:
    left = problem.weight * (g.reshape(len(g), -1) - problem.values)
    return float(np.sum(np.abs(left) ** 2))
