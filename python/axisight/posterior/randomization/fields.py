"""Distribution of the numbers of an engine, and which of them must be drawn together."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.display.summary import summarized
from axisight.posterior.randomization.homes import Kind, Number
from axisight.posterior.result import Posterior
from axisight.posterior.settings import CORRELATED
from axisight.statistics.intervals import NORMAL_DEVIATIONS

Array = NDArray[np.float64]


@summarized
@dataclass(frozen=True)
class RandomizedField:
    """One number of an engine with its range, on the joint side.

    - ``kind``: which number: ``armature``, ``damping``, ``frictionloss``, ``spring``, ``gear_stiffness``,
      ``gear_damping``, ``force_limit`` in ``unit``; ``mass``, ``inertia``, ``kp``, ``kd``, ``torque`` as factors.
    - ``joint``: joint that it belongs to; of a body, the joint that moves it.
    - ``mean``, ``std``, ``low``, ``high``: with all hypotheses; the range holds 95 %.
    - ``parameters``: those of the posterior that it comes from. ``varies``: whether one varies between runs, in
      words as in `BetweenRuns.says`.
    - ``with_others``: the kinds and joints that it correlates with beyond 0.5, strongest first.
    - ``together``: whether it is drawn together with other numbers.
    """

    kind: Kind
    joint: str
    unit: str
    mean: float
    std: float
    low: float
    high: float
    parameters: tuple[str, ...]
    varies: str
    with_others: tuple[tuple[str, float], ...]
    together: bool

    @property
    def label(self) -> str:
        """``kind of joint``."""
        return f"{self.kind} of {self.joint}"


@dataclass(frozen=True)
class Fields:
    """All numbers, and the joint distribution by hypothesis.

    ``means`` (n_hypotheses, n_fields); ``covariances`` (n_hypotheses, n_fields, n_fields); ``weights``
    (n_hypotheses,).
    """

    every: tuple[RandomizedField, ...]
    means: Array
    covariances: Array
    weights: Array

    @property
    def together(self) -> list[int]:
        """Places of the numbers that are drawn together."""
        return [i for i, f in enumerate(self.every) if f.together]

    @property
    def alone(self) -> list[RandomizedField]:
        """Numbers with a range of their own."""
        return [f for f in self.every if not f.together]


def fields_of(posterior: Posterior, numbers: list[Number], *, no_range: Collection[Kind]) -> Fields:
    """Return the distribution of numbers.

    Numbers that correlate beyond 0.5 with another are drawn together, as are all where rivals are open, and those of a
    kind in ``no_range``, for which a project has no range.
    """
    weights = np.array([h.weight for h in posterior.hypotheses])
    moments = [_moments(posterior, numbers, k) for k in range(len(weights))]
    means = np.array([m for m, _ in moments]).reshape(len(weights), len(numbers))
    covariances = np.array([c for _, c in moments])
    share = weights / weights.sum()
    mean = share @ means
    apart = means - mean
    whole = np.tensordot(share, covariances, 1) + np.einsum("h,hi,hj->ij", share, apart, apart)
    std = np.sqrt(np.diag(whole))
    outer = np.outer(std, std)
    correlation = whole / np.where(outer > 0, outer, 1.0)
    every = []
    for i, number in enumerate(numbers):
        strong = [
            (f"{numbers[j].kind} of {numbers[j].joint}", float(correlation[i, j]))
            for j in np.argsort(-np.abs(correlation[i]), kind="stable")
            if j != i and abs(correlation[i, j]) > CORRELATED
        ]
        together = bool(strong) or len(weights) > 1 or number.kind in no_range
        reach = NORMAL_DEVIATIONS * float(std[i])
        low, high = bounds_of(posterior, number)
        every.append(
            RandomizedField(
                number.kind,
                number.joint,
                number.unit,
                float(mean[i]),
                float(std[i]),
                max(float(mean[i]) - reach, low),
                min(float(mean[i]) + reach, high),
                tuple(number.terms),
                _varies(posterior, number),
                tuple(strong),
                together,
            )
        )
    return Fields(tuple(every), means, covariances, share)


def _moments(posterior: Posterior, numbers: list[Number], place: int) -> tuple[Array, Array]:
    """Return mean (n,) and covariance (n, n) of the numbers in one hypothesis."""
    one = posterior.hypotheses[place]
    slopes = np.array([[n.terms.get(name, 0.0) for name in one.names] for n in numbers]).reshape(
        len(numbers), len(one.names)
    )
    # Parameters that this hypothesis lacks are at their neutral values.
    rest = [
        sum(
            slope * posterior.parameter(name).neutral
            for name, slope in n.terms.items()
            if name not in one.names
        )
        for n in numbers
    ]
    mean = np.array([n.constant for n in numbers]) + np.array(rest) + slopes @ one.mean
    covariance = posterior.covariance_of(place, formula_error=True, between_runs=True)
    return mean, np.asarray(slopes @ covariance @ slopes.T)


def bounds_of(posterior: Posterior, number: Number) -> tuple[float, float]:
    """Return the values that a number may have: those of its parameters; numbers of engines are not below zero."""
    ends = np.full(2, number.constant)
    for name, slope in number.terms.items():
        p = posterior.parameter(name)
        ends += np.sort([slope * p.lower, slope * p.upper])
    least = -np.inf if number.kind == "own" else 0.0
    return max(least, float(ends[0])), float(ends[1])


def _varies(posterior: Posterior, number: Number) -> str:
    said = {x.says for n in number.terms if (x := posterior.variation(n)) is not None}
    return next((word for word in ("yes", "not known", "no") if word in said), "not known")
