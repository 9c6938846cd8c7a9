"""The joint posterior of the parameters of causes and simulator: hypotheses with weights, each a Gaussian."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.arguments import did_you_mean, seed_of, switch, whole
from axisight.display.summary import MOST, summarized
from axisight.effects import Effect
from axisight.errors import InputError
from axisight.posterior.between_runs import BetweenRuns
from axisight.posterior.parameter import PosteriorParameter, Simulated
from axisight.posterior.sampling import Mixture, Part
from axisight.posterior.settings import CORRELATED
from axisight.statistics.intervals import NORMAL_DEVIATIONS

Array = NDArray[np.float64]


@summarized
@dataclass(frozen=True)
class PosteriorHypothesis:
    """One hypothesis of a posterior: a set of causes, and the Gaussian of its parameters.

    - ``effects``: its causes, with all their values at the mean; ``weight``: its probability among the hypotheses [1].
    - ``names``: the p parameters that were fitted; ``mean`` (p,); ``covariance`` (p, p) of the fit.
    - ``formula_std`` (p,): error of formulas and own scatter, independent of the fit, added in squares.
    """

    effects: tuple[Effect, ...]
    weight: float
    names: tuple[str, ...]
    mean: Array
    covariance: Array
    formula_std: Array

    @property
    def causes(self) -> tuple[str, ...]:
        """Labels of its causes (``effect@axis``)."""
        return tuple(effect.label for effect in self.effects)

    def total(self, *, formula_error: bool = True) -> Array:
        """Return the covariance (p, p), with the error of formulas unless that is left out."""
        more = np.diag(self.formula_std**2) if formula_error else 0.0
        return np.asarray(self.covariance + more)


@summarized
@dataclass(frozen=True)
class Posterior:
    """Joint posterior of a diagnosis.

    - ``parameters``: parameters of all hypotheses, own parameters of the simulator first.
    - ``hypotheses``: the leading one first. There are several where the verdict leaves rivals open.
    - ``between_runs``: variation between the estimation logs, for the parameters of the leading hypothesis.
    - ``bootstrap_std``: standard deviations of the leading hypothesis by block bootstrap, to compare with its
      covariance; by name.
    - ``held_out``: for each validation log a Dataset over (time_s, axis), as in `axisight.gap.diagnose`.
    - ``without_values``: labels that stay open, but have no fitted values here, with the reason.
    """

    name: str
    verdict: str
    simulated: Simulated
    parameters: tuple[PosteriorParameter, ...]
    hypotheses: tuple[PosteriorHypothesis, ...]
    between_runs: tuple[BetweenRuns, ...] = ()
    bootstrap_std: Mapping[str, float] = field(default_factory=dict)
    held_out: tuple[xr.Dataset, ...] = ()
    without_values: Mapping[str, str] = field(default_factory=dict)
    seed: int = 0
    version: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all parameters."""
        return tuple(p.name for p in self.parameters)

    @property
    def best(self) -> PosteriorHypothesis:
        """The leading hypothesis."""
        return self.hypotheses[0]

    def parameter(self, name: str) -> PosteriorParameter:
        """Return a parameter by name; raises InputError, with the nearest name, for an unknown one."""
        for one in self.parameters:
            if one.name == name:
                return one
        hint = did_you_mean(name, self.names) or "."
        raise InputError(
            f"parameter: expected one of the {len(self.names)} of the posterior, got {name!r}{hint}"
        )

    def variation(self, name: str) -> BetweenRuns | None:
        """Return the variation of a parameter between runs; None for one of another than the leading hypothesis."""
        return next((x for x in self.between_runs if x.parameter == name), None)

    def gaussian(self, *, formula_error: bool = True, between_runs: bool = False) -> xr.Dataset:
        """Return the Gaussian of the leading hypothesis as a Dataset over (parameter, other).

        ``value`` and ``deviation``: mean and standard deviation. ``low`` and ``high``: 95 % interval within the bounds.
        ``covariance``, ``correlation``. ``varies``: whether it varies between runs (``yes``, ``no``, ``not known``).

        ``formula_error``: with the error of formulas and own scatter, as in the intervals of the verdict.
        ``between_runs``: with the variation between runs.
        """
        names = list(self.best.names)
        covariance = self.covariance_of(0, formula_error=formula_error, between_runs=between_runs)
        mean, std = self.best.mean, np.sqrt(np.diag(covariance))
        known = [self.parameter(n) for n in names]
        reach = NORMAL_DEVIATIONS * std
        apart = np.where(np.outer(std, std) > 0, np.outer(std, std), 1.0)
        said = [self.variation(n) for n in names]
        return xr.Dataset(
            {
                "value": ("parameter", mean),
                "deviation": ("parameter", std),
                "low": ("parameter", np.maximum(mean - reach, [p.lower for p in known])),
                "high": ("parameter", np.minimum(mean + reach, [p.upper for p in known])),
                "covariance": (("parameter", "other"), covariance),
                "correlation": (("parameter", "other"), covariance / apart),
                "varies": ("parameter", ["not known" if x is None else x.says for x in said]),
            },
            coords={"parameter": names, "other": names, "unit": ("parameter", _units(known))},
            attrs={"causes": list(self.best.causes), "weight": self.best.weight},
        )

    def covariance_of(self, place: int, *, formula_error: bool, between_runs: bool) -> Array:
        """Return the covariance (p, p) of the hypothesis at a place, with the parts that are asked for."""
        one = self.hypotheses[place]
        out = one.total(formula_error=formula_error)
        if between_runs:
            known = {x.parameter: x.std for x in self.between_runs if x.varies}
            out = out + np.diag([known.get(n, 0.0) ** 2 for n in one.names])
        return out

    def correlated(self, least: float = CORRELATED) -> list[tuple[str, str, float]]:
        """Return pairs of parameters of the leading hypothesis with an absolute correlation above ``least`` [1].

        The strongest pair comes first.
        """
        found = self.gaussian()
        matrix, names = found.correlation.values, self.best.names
        pairs = [
            (names[i], names[j], float(matrix[i, j]))
            for i in range(len(names))
            for j in range(i)
            if abs(matrix[i, j]) > least
        ]
        return sorted(pairs, key=lambda p: -abs(p[2]))

    def samples(
        self,
        number: int,
        *,
        seed: int | None = None,
        first_run: int = 0,
        formula_error: bool = True,
        between_runs: bool = False,
    ) -> xr.Dataset:
        """Return samples of all parameters, over ``draw``, with the number of their ``hypothesis`` from 0.

        Sample ``i`` depends on seed and run ``first_run + i`` only. Values beyond a bound are set to the bound. A
        parameter that a hypothesis lacks has its neutral value there.

        number
            Number of samples, from 1.
        seed
            Seed; by default that of the diagnosis.
        first_run
            Run of the first sample, from 0.
        formula_error
            Include the error of formulas and own scatter, as the intervals of the verdict do.
        between_runs
            Include the variation between runs of the parameters that vary.

        Raises InputError for a number, seed or run that is no whole number.
        """
        count = whole("number", number)
        start = whole("first_run", first_run, 0)
        parts = {
            "formula_error": switch("formula_error", formula_error),
            "between_runs": switch("between_runs", between_runs),
        }
        used = self.seed if seed is None else seed_of("seed", seed)
        which, values = self._mixture(**parts).drawn(used, range(start, start + count))
        return xr.Dataset(
            {
                p.name: ("draw", values[:, k], {"units": p.unit})
                for k, p in enumerate(self.parameters)
            }
            | {"hypothesis": ("draw", which)},
            coords={"draw": np.arange(start, start + count)},
            attrs={"seed": used},
        )

    def _mixture(self, *, formula_error: bool, between_runs: bool) -> Mixture:
        """Return the mixture of all hypotheses over all parameters."""
        parts = [
            Part(
                one.weight,
                np.array([self.names.index(n) for n in one.names], dtype=np.int64),
                one.mean,
                self.covariance_of(k, formula_error=formula_error, between_runs=between_runs),
            )
            for k, one in enumerate(self.hypotheses)
        ]
        neutral = np.array([p.neutral for p in self.parameters])
        bounds = np.array([(p.lower, p.upper) for p in self.parameters]).reshape(-1, 2)
        return Mixture(tuple(parts), neutral, bounds)

    def _summary(self) -> tuple[str, list[tuple[str, str]]]:
        """Return title and rows of the repr."""
        found = self.gaussian()
        rows = [
            (
                name,
                f"{float(found.value[k]):.4g} ({float(found.low[k]):.4g} to {float(found.high[k]):.4g}) "
                f"{found.unit.values[k]}, varies between runs: {found.varies.values[k]}",
            )
            for k, name in enumerate(self.best.names[: 2 * MOST])
        ]
        rows += [
            (" or ".join(h.causes) or "no cause", f"weight {h.weight:.2f}") for h in self.hypotheses
        ]
        return f"Posterior of {self.name!r}: {len(self.parameters)} parameters", rows


def _units(known: list[PosteriorParameter]) -> list[Any]:
    return [p.unit for p in known]
