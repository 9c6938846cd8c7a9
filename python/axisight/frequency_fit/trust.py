"""Whether the variance of the responses accounts for the residuals of a fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisight.display.summary import summarized
from axisight.frequency_fit.measured import MeasuredResponse
from axisight.frf.pooled import MISFIT_EXPLAINED, OwnWeights, few_words

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

RELATED = 3.0
"""Standard deviations; by chance 0.3 % of fits lie beyond."""
CHANCE = 1e-3
"""Probability that the line furthest off in a fit is called an outlier by chance."""


@summarized
@dataclass(frozen=True)
class Trust:
    """What speaks against standard deviations from the variance of the responses.

    ``excess``: mean square of the whitened residuals over what the variance explains, None if
    unknown. ``related``: correlation of residuals at neighbouring lines, in standard deviations
    of chance. ``outlier``: the line that is furthest off, in words, if it is too far for chance,
    else None. ``own_weights``: fewest complex degrees of freedom of a variance that weighs its
    own line, None where all are known, pooled or many. ``inflation``: by which weights from
    their own variance make the covariance of the parameters larger than they claim.
    """

    excess: float | None
    related: float
    outlier: str | None
    own_weights: float | None
    inflation: float

    @property
    def holds(self) -> bool:
        """Whether nothing does."""
        return not self.reasons()

    def reasons(self) -> list[str]:
        """Return in words what does."""
        out = []
        if self.excess is not None and self.excess > MISFIT_EXPLAINED:
            out.append(
                f"the mean square residual is {self.excess:.3g} times what the variance of the "
                "response explains: the model is incomplete or the variance too small"
            )
        if abs(self.related) > RELATED:
            out.append(
                "residuals of neighbouring lines resemble each other "
                f"({self.related:.1f} standard deviations): the model is incomplete, or the noise "
                "is correlated over the lines (drift, leakage, smoothing)"
            )
        if self.outlier is not None:
            out.append(self.outlier)
        if self.own_weights is not None:
            out.append(few_words(self.own_weights))
        return out


def trust(
    data: Sequence[MeasuredResponse],
    weighing: Sequence[Real | None],
    residual: Real,
    misfit: float,
    *,
    weighted: bool,
) -> Trust:
    """Compare residuals with the variance of the responses.

    ``weighing`` is what `MeasuredResponse.pooled` returned, ``residual`` (n, 2) the whitened
    residuals of all responses, ``misfit`` their mean square, degrees of freedom counted.
    """
    known = all(one.variance is not None or one.covariance is not None for one in data)
    few = [
        one.degrees_of_freedom
        for one, weights in zip(data, weighing, strict=True)
        if weights is None and one.degrees_of_freedom is not None and _own(one).few
    ]
    values: Complex = residual[:, 0] + 1j * residual[:, 1]
    return Trust(
        excess=misfit / _explained(data, weighing) if weighted and known else None,
        related=_related(data, values),
        outlier=_outlier(data, values, misfit) if weighted and not few else None,
        own_weights=min(few) if weighted and few else None,
        inflation=_inflation(data, weighing) if weighted else 1.0,
    )


def _inflation(data: Sequence[MeasuredResponse], weighing: Sequence[Real | None]) -> float:
    factors = [
        1.0 if weights is not None else _own(one).variance
        for one, weights in zip(data, weighing, strict=True)
    ]
    found = float(np.average(factors, weights=[one.response.size for one in data]))
    # Without bound the sandwich is taken, or the user insists.
    return found if np.isfinite(found) else 1.0


def _own(one: MeasuredResponse) -> OwnWeights:
    return OwnWeights.of(one.degrees_of_freedom, one.elements_weighed_together)


def _outlier(data: Sequence[MeasuredResponse], residual: Complex, misfit: float) -> str | None:
    """Return in words the residual furthest off, if normal ones of this mean square are not so far.

    The squared magnitude over its mean is exponential: n of them exceed ln(n / p) with
    probability p. The mean is that of all, so a model that misses everywhere has no outlier.
    """
    size = np.abs(residual)
    place = int(np.argmax(size))
    mean = max(2 * misfit, 1e-300)
    if size[place] ** 2 / mean < np.log(len(size) / CHANCE):
        return None
    for number, one in enumerate(data, 1):
        if place < one.response.size:
            line, output, source = np.unravel_index(place, one.response.shape)
            return (
                f"response {number}: the line at {one.frequency_hz[line]:.4g} Hz (output "
                f"{output + 1}, input {source + 1}) is {size[place] / np.sqrt(mean):.1f} times as "
                "far off as the others: look at it, leave it out (infinite variance), or use "
                "loss='huber'"
            )
        place -= one.response.size
    return None


def _explained(data: Sequence[MeasuredResponse], weighing: Sequence[Real | None]) -> float:
    """Mean square of whitened residuals that the variance explains.

    Weighed by other lines, that is the mean ratio of both variances; by the own one, see
    `OwnWeights`.
    """
    out, count = 0.0, 0
    for one, weights in zip(data, weighing, strict=True):
        n = one.response.size
        ratio = 1.0
        if weights is not None and one.variance is not None:
            used = np.isfinite(weights)
            n = int(used.sum())
            ratio = float(np.mean(one.variance[used] / weights[used])) if n else 1.0
        elif np.isfinite(_own(one).misfit):
            ratio = _own(one).misfit
        out, count = out + n * ratio, count + n
    return out / max(count, 1)


def _related(data: Sequence[MeasuredResponse], residual: Complex) -> float:
    """Correlation of residuals one line apart, in standard deviations.

    The products at every line, of all elements together, are their own yardstick, so elements
    may be correlated with each other and lines unequal.
    """
    products, first = [], 0
    for one in data:
        n = one.response.size
        part = residual[first : first + n].reshape(len(one.frequency_hz), -1)
        part = part[np.argsort(one.frequency_hz)]
        products.append(np.sum(part[1:] * part[:-1].conj(), axis=1).real)
        first += n
    all_products = np.concatenate(products)
    size = float(np.sqrt(np.sum(all_products**2)))
    return float(np.sum(all_products)) / size if size > 0 else 0.0
