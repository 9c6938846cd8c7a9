"""The Fisher information of an experiment, as a root that keeps all digits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import linalg

from axisight.display.summary import summarized
from axisight.errors import InputError

Array = NDArray[np.float64]


@summarized
@dataclass(frozen=True)
class Information:
    """The Fisher information of an experiment, as a root: M = ``root``^T ``root``.

    ``names`` (n,) are those of the parameters, and ``scales`` (n,) the sizes of changes that matter, in
    the units of the parameters. ``root`` is (k, n). ``name`` is that of the experiment, and ``advice``
    says how to carry it out ("add the pose ..."). Information of independent experiments adds:
    ``a + b``.
    """

    names: tuple[str, ...]
    scales: Array
    root: Array = field(repr=False)
    name: str = ""
    advice: str = ""

    @property
    def matrix(self) -> Array:
        """M, (n, n), per squared units of the parameters."""
        return np.asarray(self.root.T @ self.root)

    def __add__(self, other: Information) -> Information:
        """Return the information of both experiments; raises InputError for other parameters or scales."""
        if not isinstance(other, Information) or other.names != self.names:
            raise InputError(f"other: expected the parameters {', '.join(self.names)}")
        if not np.allclose(other.scales, self.scales, rtol=1e-6, atol=0):
            raise InputError("other: expected the same scales")
        both = _compressed(np.vstack([self.root, other.root]))
        name = " + ".join(n for n in (self.name, other.name) if n)
        return replace(self, root=both, name=name)


def information(
    jacobian: ArrayLike | Sequence[ArrayLike],
    *,
    names: Sequence[str],
    scales: ArrayLike,
    noise_std: ArrayLike | None = None,
    noise_covariance: ArrayLike | None = None,
    name: str = "",
    advice: str = "",
) -> Information:
    """Return the information of an experiment from the Jacobian of its measurements.

    jacobian
        d measurement / d parameter, (n_measurements, n_parameters), or a sequence of such blocks.
        For a complex Jacobian of a frequency response, real and imaginary parts count as
        measurements, each with half the variance.
    names, scales
        Names of the parameters, and their scales, positive, in their units.
    noise_std
        Standard deviation of each measurement, a number or (n_measurements,); sqrt(E|e|^2) for
        complex measurements. Default one, for the Jacobian of whitened residuals.
    noise_covariance
        Covariance (n_measurements, n_measurements) of correlated real measurements, instead of
        ``noise_std``.
    name, advice
        Name of the experiment, and advice on it, for `compare_experiments`.

    Raises InputError for shapes that do not fit, numbers that are not finite, and a covariance that
    is not positive definite.
    """
    labels = _labels(names)
    sizes = _scales(scales, len(labels))
    blocks = list(jacobian) if isinstance(jacobian, list | tuple) else [jacobian]
    arrays = [np.asarray(block) for block in blocks]
    for array in arrays:
        if array.ndim != 2 or array.shape[1] != len(labels) or array.dtype.kind not in "fciu":
            raise InputError(
                f"jacobian: expected blocks of shape (n, {len(labels)}), got {array.shape}"
            )
        if not np.isfinite(array).all():
            raise InputError("jacobian: expected finite numbers, got NaN or infinity")
    if not arrays or not sum(map(len, arrays)):
        raise InputError("jacobian: expected at least one measurement, got none")
    whole = np.concatenate(arrays)
    if noise_covariance is not None:
        if noise_std is not None or np.iscomplexobj(whole):
            raise InputError("noise_covariance: expected real measurements and no noise_std beside")
        whole = whitened(whole, noise_covariance)
    else:
        std = np.asarray(1.0 if noise_std is None else noise_std, np.float64)
        if std.shape not in ((), (len(whole),)) or not np.all(np.isfinite(std) & (std > 0)):
            raise InputError(
                f"noise_std: expected positive numbers, one or {len(whole)}, got shape {std.shape}"
            )
        whole = whole / np.reshape(std, (-1, 1))
    if np.iscomplexobj(whole):
        whole = np.sqrt(2) * np.concatenate([whole.real, whole.imag])
    return Information(labels, sizes, _compressed(np.asarray(whole, np.float64)), name, advice)


def of_matrix(
    matrix: ArrayLike,
    *,
    names: Sequence[str],
    scales: ArrayLike,
    name: str = "",
    advice: str = "",
) -> Information:
    """Return the information of an experiment from its ``matrix`` M, (n, n).

    ``names``, ``scales``, ``name`` and ``advice`` are those of `information`. M is the square of the
    Jacobian and has half its digits. It therefore does not tell combinations known 1e7 times worse
    than others from unidentifiable ones. Raises InputError if M is not symmetric and positive
    semi-definite.
    """
    labels = _labels(names)
    sizes = _scales(scales, len(labels))
    m = np.asarray(matrix, np.float64)
    if m.shape != (len(labels),) * 2 or not np.isfinite(m).all():
        raise InputError(f"matrix: expected finite numbers ({len(labels)},) * 2, got {m.shape}")
    size = np.sqrt(np.abs(np.diag(m)))
    unit = m / np.outer(np.where(size > 0, size, 1.0), np.where(size > 0, size, 1.0))
    values, vectors = np.linalg.eigh((unit + unit.T) / 2)
    if np.abs(unit - unit.T).max() > 1e-8 or values[0] < -1e-8 * max(values[-1], 1e-300):
        raise InputError("matrix: expected a symmetric positive semi-definite matrix")
    # Smaller eigenvalues are rounding errors of M, not information.
    kept = values > 1e-13 * values[-1]
    root = (np.sqrt(values[kept])[:, None] * vectors[:, kept].T) * size
    return Information(labels, sizes, root, name, advice)


def _compressed(rows: Array) -> Array:
    """Return the triangular factor, which holds the same information in n rows."""
    (r,) = linalg.qr(rows, mode="r", check_finite=False)
    return np.asarray(r[: rows.shape[1]])


def whitened(jacobian: Array, covariance: ArrayLike) -> Array:
    """Return ``L^-1 jacobian`` for the covariance L L^T; raises InputError if it has no root."""
    c = np.asarray(covariance, np.float64)
    if c.shape != (len(jacobian),) * 2 or not np.isfinite(c).all() or not np.allclose(c, c.T):
        raise InputError(
            f"noise_covariance: expected a symmetric matrix of size {len(jacobian)}, got {c.shape}"
        )
    try:
        lower = np.linalg.cholesky(c)
    except np.linalg.LinAlgError:
        raise InputError("noise_covariance: expected a positive definite matrix") from None
    return np.asarray(linalg.solve_triangular(lower, jacobian, lower=True))


def _labels(names: Sequence[str]) -> tuple[str, ...]:
    labels = tuple(str(n) for n in names)
    if not labels or len(set(labels)) < len(labels):
        raise InputError("names: expected at least one name and none twice")
    return labels


def _scales(scales: ArrayLike, n: int) -> Array:
    sizes = np.asarray(scales, np.float64)
    if sizes.shape != (n,) or not np.all(np.isfinite(sizes) & (sizes > 0)):
        raise InputError(f"scales: expected {n} positive finite numbers, got {scales!r}")
    return sizes
