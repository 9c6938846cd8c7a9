"""Comparisons of designs over realizations, with their uncertainty."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from axisight_thesis.chapter8_setting import (
    Design,
    excited_lines,
    square_lines,
    strong_square_lines,
)
from axisight_thesis.chapter8_study import experiments, true_response
from axisight_thesis.chapter8_tables import mean_error_runs, realizations
from axisight_thesis.context import Context

Real = NDArray[np.float64]

T1, T1_SQUARE, T2, T2_SQUARE = range(4)
"""Places in DESIGNS."""
DIAGONAL = np.eye(3, dtype=bool)
COUPLING = ((0, 1), (0, 2), (1, 0), (2, 0))
"""The coupling between axis one and axes two and three."""
LOW_HZ = 3.0
STANDARD_ERRORS = 3.0
"""Standard errors above which an average counts as biased."""

# Standard errors for a decision; three, because nine elements are tested at a time.
_DECIDED = 3.0


@dataclass(frozen=True)
class Ratio:
    """A geometric mean over realizations and the standard error of its logarithm."""

    value: float
    error: float

    @classmethod
    def of(cls, logs: Real) -> Ratio:
        """Return the ratio of logarithms (n_realizations,)."""
        value, error = _mean(logs)
        return cls(float(value), float(error))

    @property
    def decided(self) -> bool:
        """Whether the ratio is not one, by three standard errors."""
        return bool(abs(np.log(self.value)) > _DECIDED * self.error)

    def __str__(self) -> str:
        """Return the value and two standard errors as text."""
        return f"{self.value:.2f} ± {2 * self.error * self.value:.2f}"


@dataclass(frozen=True)
class Ratios:
    """Ratios like :class:`Ratio` for every element, (output, input)."""

    value: Real
    error: Real


def comparison_runs(context: Context) -> int:
    """Return the number of realizations over which designs are compared."""
    return 2 if context.quick else 12


def errors(context: Context, design: Design, runs: int | None = None) -> Real:
    """Return relative errors under ripple, (realization, n_freq, output, input)."""
    count = runs or comparison_runs(context)
    found = [experiments(context, design, run) for run in range(count)]
    true = true_response(context, found[0].frequency_hz)
    return np.array([np.abs(f.estimate / true - 1) for f in found])


def compare(context: Context, over: int, under: int) -> Ratios:
    """Return the mean error of a design over that of another, by their places in DESIGNS."""
    logs = np.log(mean_error_runs(context, comparison_runs(context)))
    return Ratios(*_mean(logs[:, over] - logs[:, under]))


def except_for(ratios: Ratios, expected: set[tuple[int, int]], other: str) -> tuple[bool, str]:
    """Return whether a design has smaller errors except at the ``expected`` elements, and the evidence.

    ``ratios`` are its errors over those of the ``other`` design. Elements within three standard errors
    of one are undecided and do not count as exceptions.
    """
    logs = np.log(ratios.value)
    bound = _DECIDED * ratios.error
    worse, undecided = logs > bound, np.abs(logs) <= bound
    text = f"{other} better in {_where(worse)}, undecided in {_where(undecided)}; ratios "
    text += ", ".join(
        str(Ratio(float(v), float(e)))
        for v, e in zip(ratios.value.ravel(), ratios.error.ravel(), strict=True)
    )
    return {(int(i), int(j)) for i, j in np.argwhere(worse)} == expected, text


def at_square_lines(
    context: Context,
    errors_of: Callable[[Context, Design], Real],
    without: Design,
    with_: Design,
    element: tuple[int, int] | None = None,
) -> tuple[Ratio, Ratio]:
    """Return the ratio of errors with to those without square wave, at its lines and at all others.

    The lines of the square wave are those at which it is stronger than the multisine. ``element`` None
    takes all elements.
    """
    logs = np.log(errors_of(context, with_)) - np.log(errors_of(context, without))
    logs = logs.mean(axis=(2, 3)) if element is None else logs[:, :, element[0], element[1]]
    own = strong_square_lines(context.robot)
    others = ~square_lines(excited_lines())
    return Ratio.of(logs[:, own].mean(axis=1)), Ratio.of(logs[:, others].mean(axis=1))


def disturbance(
    context: Context, design: Design, at: NDArray[np.bool_] | None = None
) -> tuple[Real, Real, Real]:
    """Return root mean square V_u, V_y and G V_u + V_y over lines and realizations."""
    kept = slice(None) if at is None else at
    found = [experiments(context, design, run) for run in range(realizations(context))]
    frequency = found[0].frequency_hz
    velocity = true_response(context, frequency) / (2j * np.pi * frequency[:, None, None])
    v_u = np.array([f.input_disturbance for f in found])
    v_y = np.array([f.output_disturbance for f in found])

    def size(values: NDArray[np.complex128]) -> Real:
        return np.asarray(np.sqrt(np.mean(np.abs(values[:, kept]) ** 2, axis=(0, 1))))

    return size(v_u), size(v_y), size(velocity @ v_u + v_y)


def rank(values: Real) -> Real:
    """Return ranks from 1."""
    return np.asarray(pd.Series(values).rank().to_numpy(float))


def listed(values: Real, form: str = ".2f") -> str:
    """Return numbers as text."""
    return ", ".join(format(float(v), form) for v in np.ravel(values))


def _mean(logs: Real) -> tuple[Real, Real]:
    """Return geometric mean and standard error over the first axis."""
    return np.exp(logs.mean(axis=0)), logs.std(axis=0, ddof=1) / np.sqrt(len(logs))


def _where(elements: NDArray[np.bool_]) -> str:
    return ", ".join(f"({i + 1},{j + 1})" for i, j in np.argwhere(elements)) or "none"
