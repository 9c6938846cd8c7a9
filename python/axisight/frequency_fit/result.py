"""Result of a frequency-domain fit."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from axisight import _core
from axisight.display import html
from axisight.display.summary import summarized
from axisight.frequency_fit.trust import Trust
from axisight.identifiability import Combination, Identifiability
from axisight.robot import Robot

Real = NDArray[np.float64]

NORMAL_95 = 1.959963984540054
STATUS_ADVICE = dict(_core.status_advice())


@summarized
@dataclass(frozen=True)
class FrequencyFit:
    """Parameters fitted to frequency responses.

    names, values
        Free parameters in their units.
    std, interval
        Standard deviations in the same units, and 95 % intervals (n_parameters, 2); an
        interval of a positive parameter is symmetric in its logarithm.
    std_response, std_sandwich
        Standard deviations from the uncertainty of the response (NaN without one and without
        residuals), and from the scatter of the residuals over blocks of lines. The second stays valid
        if the model is incomplete. ``std_from`` says which of them ``std`` is.
    covariance, correlation
        (n_parameters, n_parameters), from the source that ``std_from`` names.
    status
        ``loss_converged``, ``step_converged``, ``exact`` (no residual is left), ``max_iterations`` or
        ``stalled``.
    misfit
        Mean square of a whitened residual, corrected for degrees of freedom: 1 if model and
        uncertainty are right.
    loss, initial_loss, n_residuals
        Loss at the end and at the start, and the number of residuals; real and imaginary part count
        as two.
    iterations, evaluations
        Totals over all passes from the best start.
    at_bound
        Names of parameters on a bound.
    identifiability, information
        Identifiability from the data used, with combinations that they do not determine; and their
        information (n_parameters, n_parameters), per logarithm, or per metre for centres of mass.
    starts
        Loss, status and iterations of the search from every starting point, best first.
    robot
        The robot with the fitted values.

    ``warnings`` say in words what to check.
    """

    names: tuple[str, ...]
    values: Real
    std: Real
    interval: Real
    covariance: Real
    correlation: Real
    std_response: Real
    std_sandwich: Real
    std_from: Literal["response", "sandwich"]
    status: str
    misfit: float
    loss: float
    initial_loss: float
    n_residuals: int
    iterations: int
    evaluations: int
    at_bound: tuple[str, ...]
    identifiability: Identifiability
    information: Real
    warnings: tuple[str, ...]
    starts: pd.DataFrame = field(repr=False)
    robot: Robot = field(repr=False)
    core: _core.FrequencyFitResult = field(repr=False)

    def _repr_html_(self) -> str:
        """Return the values with standard errors and 95 % intervals, for notebooks."""
        columns = (self.values, self.std, self.interval[:, 0], self.interval[:, 1])
        return html.page(
            f"fit to frequency responses: {self.status} after {self.iterations} iterations, "
            f"misfit {self.misfit:.3g}",
            html.table(
                ("parameter", "value", "standard error", "95 % from", "to"),
                zip(self.names, *(map(html.number, column) for column in columns), strict=True),
                "Parameters with standard errors",
            ),
            html.lines(self.warnings),
        )

    def to_xarray(self) -> xr.Dataset:
        """Return values and uncertainty as a Dataset over ``parameter``."""
        return xr.Dataset(
            {
                "value": ("parameter", self.values),
                "std": ("parameter", self.std),
                "interval": (("parameter", "bound"), self.interval),
                "correlation": (("parameter", "other"), self.correlation),
            },
            coords={
                "parameter": list(self.names),
                "other": list(self.names),
                "bound": ["lower", "upper"],
            },
            attrs={
                "status": self.status,
                "loss": self.loss,
                "misfit": self.misfit,
                "std_from": self.std_from,
                "condition": self.identifiability.condition,
            },
        )

    def table(self) -> pd.DataFrame:
        """Return one row per parameter: value, std, relative std, interval."""
        return pd.DataFrame(
            {
                "parameter": self.names,
                "value": self.values,
                "std": self.std,
                "relative_std": self.std / np.abs(self.values),
                "lower": self.interval[:, 0],
                "upper": self.interval[:, 1],
            }
        )


@summarized
@dataclass(frozen=True)
class Covariances:
    """Covariances of the searched numbers: from the response's uncertainty, and from blocks of residuals."""

    response: Real
    sandwich: Real
    misfit: float


def covariances(result: _core.FrequencyFitResult, prior: Real, blocks: int) -> Covariances:
    """Return covariances from the normal equations, infinite if these are singular.

    ``prior`` is the information of the priors, (n_parameters,); ``blocks`` is the number of
    blocks of the sandwich, which loses a degree of freedom for every parameter.
    """
    information = result.information
    n = len(information)
    misfit = result.loss / max(result.n_residuals - n, 1)
    size = np.sqrt(np.diag(information))
    nothing = np.full((n, n), np.inf)
    if not (size > 0).all():
        return Covariances(nothing, nothing, misfit)
    try:
        factor = np.linalg.cholesky(information / np.outer(size, size))
    except np.linalg.LinAlgError:
        return Covariances(nothing, nothing, misfit)
    root = np.linalg.solve(factor, np.diag(1 / size))
    inverse = root.T @ root
    expected = result.expected_scatter
    if expected is None:
        expected = misfit * (information - np.diag(prior))
    sandwich = nothing
    if blocks > n:
        middle = result.block_scatter * (blocks / (blocks - n))
        sandwich = inverse @ (middle + np.diag(prior)) @ inverse
    return Covariances(inverse @ (expected + np.diag(prior)) @ inverse, sandwich, misfit)


def warn(
    result: _core.FrequencyFitResult,
    found: Identifiability,
    at_bound: tuple[str, ...],
    *,
    doubt: Trust,
    dropped: int,
    sandwich: bool,
) -> tuple[str, ...]:
    """Return the warnings of a fit; ``doubt`` tells whether the variance of the responses holds."""
    out = []
    if result.status in STATUS_ADVICE:
        remedy = ": start closer, or take several starts" if result.status == "stalled" else ""
        out.append(STATUS_ADVICE[result.status] + remedy)
    if at_bound:
        out.append(f"on a bound: {', '.join(at_bound)}: widen it, or freeze the parameter")
    source = "taken from the scatter of residuals" if sandwich else "too small: use the sandwich"
    out.extend(f"{reason}; standard deviations are {source}" for reason in doubt.reasons())
    out.extend(_advice(combination) for combination in found.combinations)
    if dropped:
        out.append(f"{dropped} flagged lines without numbers were left out")
    return tuple(out)


def _advice(combination: Combination) -> str:
    several = combination.parameters
    what = f"one of {', '.join(several)}" if len(several) > 1 else several[0]
    return (
        f"{combination}; freeze {what}, give it a prior, or add lines and operating points that "
        "tell (see choose_poses)"
    )
