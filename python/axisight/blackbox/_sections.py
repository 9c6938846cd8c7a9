"""Poles as sections of first and second order, and the linear problem of their residues.

All fits use one variable x, in which an integrator is a pole at zero: s / w0 in continuous time and
(z - 1) / (T w0) in discrete time. The second tends to the first as T tends to zero, and loses no
digits when T is short. A section of second order, x^2 + b x + c, holds a complex pair or two real
poles, and passes smoothly from one to the other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from axisight.blackbox._data import Complex, Real


@dataclass(frozen=True)
class Domain:
    """The variable x: ``scale_rad_s`` is w0, ``sample_time_s`` T or None."""

    scale_rad_s: float
    sample_time_s: float | None

    def points(self, frequency_hz: Real) -> Complex:
        """Return x at frequencies [Hz]."""
        s = 2j * np.pi * frequency_hz
        if self.sample_time_s is None:
            return np.asarray(s / self.scale_rad_s)
        # expm1 keeps the digits that exp(...) - 1 loses at low frequency.
        return np.asarray(np.expm1(s * self.sample_time_s) / self.step)

    @property
    def step(self) -> float:
        """T w0."""
        return (self.sample_time_s or 0.0) * self.scale_rad_s

    def from_continuous(self, s: Complex) -> Complex:
        """Return x of poles at s [rad/s]."""
        if self.sample_time_s is None:
            return np.asarray(s / self.scale_rad_s)
        return np.asarray(np.expm1(s * self.sample_time_s) / self.step)

    def natural(self, x: Complex) -> Complex:
        """Return poles as s [rad/s], or as z in discrete time."""
        return np.asarray(x * self.scale_rad_s if self.sample_time_s is None else 1 + self.step * x)

    def rate(self, x: Complex) -> tuple[Complex, Complex]:
        """Return eigenvalues in continuous time [rad/s] and their derivative by x."""
        if self.sample_time_s is None:
            return np.asarray(x * self.scale_rad_s), np.full(x.shape, self.scale_rad_s + 0j)
        z = 1 + self.step * x
        return np.asarray(np.log(z) / self.sample_time_s), self.scale_rad_s / z

    def stable(self, x: Complex) -> bool:
        """Whether all poles are stable."""
        if self.sample_time_s is None:
            return bool(np.all(x.real < 0))
        return bool(np.all(np.abs(1 + self.step * x) < 1))

    def stabilized(self, x: Complex) -> Complex:
        """Return the poles with unstable ones mirrored, and none on the stability border."""
        if self.sample_time_s is None:
            real = -np.maximum(np.abs(x.real), LEAST_DAMPING * np.abs(x))
            return np.asarray(real + 1j * x.imag)
        z = 1 + self.step * x
        z = np.where(np.abs(z) > 1, 1 / np.where(z == 0, 1, z.conj()), z)
        most = 1 - LEAST_DAMPING * np.minimum(np.abs(z - 1), 1)
        z = z * np.minimum(1.0, most / np.maximum(np.abs(z), 1e-300))
        return np.asarray((z - 1) / self.step)


LEAST_DAMPING = 1e-6
"""Least damping ratio of a mirrored pole."""


@dataclass(frozen=True)
class Sections:
    """``quadratic`` (n, 2) of (b, c), and ``linear`` (0 or 1,) of a in x + a."""

    quadratic: Real
    linear: Real

    @property
    def order(self) -> int:
        """Number of poles."""
        return 2 * len(self.quadratic) + len(self.linear)

    @property
    def vector(self) -> Real:
        """All coefficients."""
        return np.concatenate([self.quadratic.ravel(), self.linear])

    @classmethod
    def of_vector(cls, vector: Real) -> Sections:
        """Return the sections of a vector of coefficients."""
        n = len(vector) // 2
        return cls(vector[: 2 * n].reshape(n, 2).copy(), vector[2 * n :].copy())

    @classmethod
    def of_poles(cls, poles: Complex) -> Sections:
        """Return the sections of poles that are closed under conjugation."""
        size = np.maximum(np.abs(poles), 1e-300)
        upper = poles[poles.imag > 1e-12 * size]
        real = np.sort(poles[np.abs(poles.imag) <= 1e-12 * size].real)
        pairs = [(-2 * p.real, abs(p) ** 2) for p in upper]
        even = len(real) - len(real) % 2
        pairs += [(-(p + q), p * q) for p, q in zip(real[:even:2], real[1:even:2], strict=True)]
        return cls(np.array(pairs, float).reshape(-1, 2), -real[even:])

    def poles(self) -> Complex:
        """Return the poles; the two of a section follow each other."""
        out: list[complex] = []
        for b, c in self.quadratic:
            # The other root follows from the product, which avoids cancellation.
            root = np.sqrt(complex(b * b / 4 - c))
            first = -b / 2 + (root if b < 0 else -root)
            out += [first, c / first if root.imag == 0 and first != 0 else np.conj(first)]
        return np.array([*out, *(-self.linear)], np.complex128)

    def basis(self, x: Complex) -> Complex:
        """Return the columns 1/q, x/q of each section and 1/(x + a), (n_freq, order)."""
        columns = []
        for b, c in self.quadratic:
            q = x * x + b * x + c
            columns += [1 / q, x / q]
        columns += [1 / (x + a) for a in self.linear]
        return np.stack(columns, axis=1) if columns else np.zeros((len(x), 0), np.complex128)

    def slopes(self, x: Complex, numerator: Real) -> Complex:
        """Return derivatives of ``basis @ numerator`` by ``vector``, (n_freq, order)."""
        columns = []
        for k, (b, c) in enumerate(self.quadratic):
            q = x * x + b * x + c
            shape = -(numerator[2 * k] + numerator[2 * k + 1] * x) / q**2
            columns += [shape * x, shape]
        columns += [-numerator[-1] / (x + a) ** 2 for a in self.linear]
        return np.stack(columns, axis=1)

    def zeros(self, numerator: Real, constant: float) -> Complex:
        """Return the zeros of ``basis @ numerator + constant``."""
        n = self.order
        a, b = np.zeros((n, n)), np.zeros(n)
        for k, (first, second) in enumerate(self.quadratic):
            i = 2 * k
            a[i, i + 1], a[i + 1, i], a[i + 1, i + 1] = 1.0, -second, -first
            b[i + 1] = 1.0
        if len(self.linear):
            a[-1, -1], b[-1] = -self.linear[0], 1.0
        return np.linalg.eigvals(a - np.outer(b, numerator) / constant).astype(np.complex128)


@dataclass(frozen=True)
class Weighted:
    """Elements of a response, each as rows of real numbers with its own weights.

    ``x`` (n_freq,), ``values`` (n_freq, n_elements), and ``weight``, real, of the same shape.
    ``extra`` are the columns without poles to fit: 1/x, 1/x^2 and one, as chosen. ``spread``, shaped
    as ``weight``, is the expected variance of the real or imaginary part of a weighted residual.
    """

    x: Complex
    values: Complex
    weight: Real
    extra: Complex
    spread: Real

    @property
    def row_spread(self) -> Real:
        """Variances of the weighted rows, (n_elements, 2 n_freq)."""
        return np.hstack([self.spread.T, self.spread.T])

    @property
    def targets(self) -> Real:
        """Weighted values, real parts followed by imaginary parts, (n_elements, 2 n_freq)."""
        return self.rows(self.values.T[:, :, None])[:, :, 0]

    def rows(self, columns: Complex) -> Real:
        """Return columns (n_elements or 1, n_freq, n) weighted for each element, as real numbers."""
        w = self.weight.T[:, :, None] * columns
        return np.concatenate([w.real, w.imag], axis=1)

    def columns(self, sections: Sections) -> Complex:
        """Return the columns that residues multiply, (n_freq, order + n_extra)."""
        return np.hstack([sections.basis(self.x), self.extra])

    def residues(self, sections: Sections) -> Solved:
        """Return the least-squares residues of every element."""
        rows, targets = self.rows(self.columns(sections)[None]), self.targets
        size = np.linalg.norm(rows, axis=1, keepdims=True)
        q, r = np.linalg.qr(rows / size)
        seen = np.swapaxes(q, 1, 2) @ targets[:, :, None]
        theta = (np.linalg.pinv(r, rcond=1e-13) @ seen)[:, :, 0] / size[:, 0]
        left = (rows @ theta[:, :, None])[:, :, 0] - targets
        return Solved(theta, left, q, r * size)


@dataclass(frozen=True)
class Solved:
    """Numerators (n_elements, n), weighted residuals (n_elements, 2 n_freq), Q and R of the rows."""

    numerators: Real
    left: Real
    q: Real
    r: Real

    @property
    def loss(self) -> float:
        """Sum of squares of the residuals."""
        return float(np.sum(self.left**2))
