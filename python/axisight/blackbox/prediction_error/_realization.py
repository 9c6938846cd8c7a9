"""Polynomial models in innovations form.

Coefficients of A, and of B and C without a denominator, act on one observer chain that all outputs
share. Every fraction B/F and C/D has states of its own, whose output enters the chain.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import linalg

from axisight.blackbox._data import Real
from axisight.blackbox._model import StateSpaceModel
from axisight.blackbox.prediction_error._row import RowPolynomials


def innovations_form(
    rows: Sequence[RowPolynomials], noise_covariance: Real, sample_time_s: float
) -> StateSpaceModel:
    """Return the state-space model of the equations of all outputs."""
    p, m = len(rows), len(rows[0].b)
    lags = max(len(x) for row in rows for x in (*row.a, *row.b, row.c)) - 1
    a, b, c = np.zeros((lags + 1, p, p)), np.zeros((lags + 1, p, m)), np.zeros((lags + 1, p, p))
    parts: list[tuple[Real, Real, Real, Real]] = []
    direct = np.zeros((p, m))
    for i, row in enumerate(rows):
        for j, x in enumerate(row.a):
            a[: len(x), i, j] = x
        for j in range(m):
            if len(row.f[j]) == 1:
                b[: len(row.b[j]), i, j] = row.b[j]
            else:
                direct[i, j] = row.b[j][0]
                parts.append(_fraction(row.b[j], row.f[j], (p, m), i, input_=j))
        if len(row.d) == 1:
            c[: len(row.c), i, i] = row.c
        else:
            c[0, i, i] = 1.0
            parts.append(_fraction(row.c, row.d, (p, m), i, input_=None))
    used = max((k for k in range(lags + 1) if a[k].any() or b[k].any() or c[k].any()), default=0)
    n = p * used
    own = linalg.block_diag(*(part[0] for part in parts)) if parts else np.zeros((0, 0))
    drive = np.vstack([np.zeros((0, m)), *(part[1] for part in parts)])
    gain = np.vstack([np.zeros((0, p)), *(part[2] for part in parts)])
    seen = np.hstack([np.zeros((p, 0)), *(part[3] for part in parts)])
    d = b[0] + direct
    # The chain takes the outputs of the fractions and y itself: z_k+ = z_{k+1} - A_k y + B_k u + C_k e.
    first = np.eye(p, n)
    output = np.hstack([first, seen])
    past = np.vstack([np.zeros((0, p)), *a[1 : used + 1]])
    into_u = np.vstack([np.zeros((0, m)), *b[1 : used + 1]]) - past @ d
    into_e = np.vstack([np.zeros((0, p)), *c[1 : used + 1]]) - past
    chain = np.hstack([np.eye(n, k=p), np.zeros((n, len(own)))]) - past @ output
    below = np.hstack([np.zeros((len(own), n)), own])
    return StateSpaceModel(
        sample_time_s,
        np.vstack([chain, below]),
        np.vstack([into_u, drive]),
        output,
        d,
        np.vstack([into_e, gain]),
        noise_covariance,
    )


def _fraction(
    top: Real, bottom: Real, shape: tuple[int, int], output: int, input_: int | None
) -> tuple[Real, Real, Real, Real]:
    """Return transition, columns of u, columns of e, and output row of one fraction."""
    p, m = shape
    n = max(len(top), len(bottom)) - 1
    top, bottom = (np.pad(x, (0, n + 1 - len(x))) for x in (top, bottom))
    transition = np.eye(n, k=1)
    transition[:, 0] -= bottom[1:]
    column = top[1:] - bottom[1:] * top[0]
    drive, gain, seen = np.zeros((n, m)), np.zeros((n, p)), np.zeros((p, n))
    seen[output, 0] = 1.0
    if input_ is None:
        gain[:, output] = column
    else:
        drive[:, input_] = column
    return transition, drive, gain, seen
