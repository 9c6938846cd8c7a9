"""Small complex systems, many at a time."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from axisight import _core
from axisight.arguments import complex_array, shown, threads_of
from axisight.errors import InputError

Complex = NDArray[np.complex128]


def invert(
    matrices: NDArray[Any], *, out: Complex | None = None, threads: int = 1
) -> tuple[Complex, NDArray[np.bool_]]:
    """Invert many small complex matrices, shape (..., n, n).

    Returns the inverses and where a matrix is singular to working precision or not finite,
    shape (...,); those inverses are NaN. Several matrices in lock-step: LU with partial pivoting
    as in LAPACK's gesv, cofactors for the 3x3 where they are as accurate. ``threads`` 0 takes
    every core and changes no bit of the result.

    out
        Where to put the inverses: C-contiguous complex128 of the same shape, apart from
        ``matrices``. Used again and again it saves what new memory costs, which for 3x3 is
        about as much as inverting.

    Raises InputError for matrices that are not square and for an ``out`` that does not fit.
    """
    a = np.ascontiguousarray(complex_array("matrices", matrices))
    threads_of(threads)
    if a.ndim < 2 or a.shape[-1] != a.shape[-2] or not a.shape[-1]:
        raise InputError(f"matrices: expected shape (..., n, n), got {a.shape}")
    if out is None:
        out = np.empty_like(a)
    elif (
        not isinstance(out, np.ndarray)
        or out.shape != a.shape
        or out.dtype != a.dtype
        or not (out.flags.c_contiguous and out.flags.writeable)
        or np.may_share_memory(a, out)
    ):
        raise InputError(
            f"out: expected a writeable C-contiguous complex128 array of shape {a.shape} that "
            f"does not overlap matrices, got {shown(out)}"
        )
    stack = (int(np.prod(a.shape[:-2])), *a.shape[-2:])
    singular = _core.invert_matrices(a.reshape(stack), out.reshape(stack), threads=threads)
    return out, singular.reshape(a.shape[:-2])


def right_divide(
    y: NDArray[Any], u: NDArray[Any], *, threads: int = 1
) -> tuple[Complex, NDArray[np.bool_]]:
    """Solve G U = Y, that is ``Y U^-1``, for many small complex matrices.

    ``y`` has shape (..., p, n), ``u`` (..., n, n) with the same leading axes; ``threads`` as for `invert`. Returns G,
    (..., p, n), and flags as `invert`. Raises InputError for shapes that do not fit.
    """
    y = np.ascontiguousarray(complex_array("y", y))
    u = np.ascontiguousarray(complex_array("u", u))
    threads_of(threads)
    fits = (
        y.ndim >= 2
        and y.shape[-1] > 0
        and y.shape[-2] > 0
        and u.shape == (*y.shape[:-2], y.shape[-1], y.shape[-1])
    )
    if not fits:
        raise InputError(f"u: expected shape (..., n, n) for y {y.shape}, got {u.shape}")
    out = np.empty_like(y)
    count = int(np.prod(y.shape[:-2]))
    stacks = [a.reshape(count, *a.shape[-2:]) for a in (y, u, out)]
    singular = _core.right_divide_matrices(*stacks, threads=threads)
    return out, singular.reshape(y.shape[:-2])
