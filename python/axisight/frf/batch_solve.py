"""Solution of many small complex systems at a time."""

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
    """Return the inverses of many small complex matrices, shape (..., n, n), and flags.

    The flags, shape (...,), are true for matrices that are singular to working precision or not
    finite; their inverses are NaN. Several matrices run in lock-step: LU with partial pivoting as in
    LAPACK's gesv, or cofactors for 3x3 matrices where they are as accurate. ``threads`` 0 takes
    every core and changes no bit of the result.

    out
        Array for the inverses: C-contiguous complex128 of the same shape, without overlap with
        ``matrices``. Reuse it to avoid new memory, which for 3x3 costs about as much as inverting.

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
    """Return G = ``Y U^-1`` for many small complex matrices, and the flags of `invert`.

    ``y`` has shape (..., p, n), ``u`` (..., n, n) with the same leading axes, and G (..., p, n).
    ``threads`` is that of `invert`. Raises InputError for shapes that do not fit.
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
