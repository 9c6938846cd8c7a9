"""Matrices that give the amplitude of every input in every experiment."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from axisight import _core
from axisight.arguments import Real, did_you_mean, reals, shown, whole
from axisight.errors import InputError

Directions = Literal["t1", "identity", "t2", "hadamard"]

MOST_INPUTS = 4096


def direction_matrix(name: Directions | ArrayLike, n_inputs: int) -> Real:
    """Return T of ``r(t) = T r_0(t)``, (n_inputs, n_experiments), Wernholt (2004), (6.5).

    ``name`` is a matrix of full row rank, which is returned, or:

    - ``"t1"`` or ``"identity"``: one input at a time
    - ``"t2"``: the matrix of (6.6), for three inputs
    - ``"hadamard"``: orthogonal rows of plus and minus one, for 1, 2, 4, 8, ... inputs

    Raises InputError for other names, shapes and ranks.
    """
    n = whole("n_inputs", n_inputs, 1, MOST_INPUTS)
    if isinstance(name, str):
        if name not in get_args(Directions):
            known = ", ".join(get_args(Directions))
            meant = did_you_mean(name, get_args(Directions))
            raise InputError(
                f"directions: expected one of {known} or a matrix, got {shown(name)}{meant}"
            )
        return _core.directions("identity" if name == "t1" else str(name), n)
    what = f"finite numbers of shape ({n}, n_experiments)"
    matrix = reals("directions", name, what, 2).copy()
    if len(matrix) != n:
        raise InputError(f"directions: expected {what}, got {matrix.shape}")
    rank = int(np.linalg.matrix_rank(matrix))
    if rank < n:
        raise InputError(f"directions: expected rank {n}, one per input, got rank {rank}")
    return matrix


def dft_matrix(n_inputs: int) -> NDArray[np.complex128]:
    """Return the DFT matrix ``W[i, e] = exp(2 pi i i e / n)``, (n_inputs, n_experiments).

    If every input has its own random phases, ``U(k) = diag(exp(i phi(k))) W`` has orthogonal rows at
    every line, for any number of inputs (Dobrowiecki, Schoukens and Guillaume 2006).
    """
    index = np.arange(whole("n_inputs", n_inputs, 1, MOST_INPUTS))
    return np.asarray(np.exp(2j * np.pi * np.outer(index, index) / len(index)))
