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
"""Threshold in standard deviations; by chance 0.3 % of fits exceed it."""
CHANCE = 1e-3
"""Probability of calling the line with the largest residual an outlier by chance."""


@summarized
@dataclass(frozen=True)
class Trust:
    """Reasons to doubt standard deviations that come from the variance of the responses.

    - ``excess``: mean square of the whitened residuals, relative to the mean square that the variance
      explains; None if unknown.
    - ``related``: correlation of residuals at neighbouring lines, in standard deviations of chance.
    - ``outlier``: text on the line with the largest residual if chance does not explain it, else None.
    - ``own_weights``: fewest complex degrees of freedom of a variance that weights its own line; None
      if all variances are known, pooled or have many degrees of freedom.
    - ``inflation``: factor by which such weights enlarge the covariance of the parameters.
    """

    excess: float | None
    related: float
    outlier: str | None
    own_weights: float | None
    inflation: float

    @property
    def holds(self) -> bool:
        """Whether there is no reason to doubt."""
        return not self.reasons()

    def reasons(self) -> list[str]:
        """Return the reasons to doubt as text."""
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
    """Return a comparison of the residuals with the variance of the responses.

    ``weighing`` is the result of `MeasuredResponse.pooled` per response. ``residual`` (n, 2) are the
    whitened residuals of all responses, and ``misfit`` is their mean square, corrected for degrees
    of freedom.
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
    # An unbounded inflation is not used: the fit takes the sandwich unless the user chose otherwise.
    return found if np.isfinite(found) else 1.0


def _own(one: MeasuredResponse) -> OwnWeights:
    return OwnWeights.of(one.degrees_of_freedom, one.elements_weighed_together)


def _outlier(data: Sequence[MeasuredResponse], residual: Complex, misfit: float) -> str | None:
    """Return text on the largest residual if it is too large for a normal one of this mean square.

    The squared magnitude over its mean is exponential, so the largest of n exceeds ln(n / p) with
    probability p. The mean is over all residuals, so a model that is wrong everywhere has no outlier.
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
                "far off as the others: look at it, leave the line out, or give it less weight "
                "(loss='huber', --robust)"
            )
        place -= one.response.size
    return None


def _explained(data: Sequence[MeasuredResponse], weighing: Sequence[Real | None]) -> float:
    """Return the mean square of whitened residuals that the variance explains.

    For lines weighted by their neighbours it is the mean ratio of own to pooled variance. For lines
    weighted by their own variance see `OwnWeights`.
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
    """Return the correlation of residuals one line apart, in standard deviations.

    The scatter of the products themselves, summed over elements at every line, gives the standard
    deviation. Elements may therefore be correlated, and lines may differ in size.
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
