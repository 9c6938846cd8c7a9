"""Ranges and joint draws as plain data, for any simulator: schema ``axisight.randomization/1``."""

from __future__ import annotations

from typing import Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

from axisight.arguments import seed_of, whole
from axisight.posterior.sampling import Mixture, Part

Array = NDArray[np.float64]

SCHEMA: Literal["axisight.randomization/1"] = "axisight.randomization/1"
"""Name of the layout."""

# Keeps these random numbers apart from those of joint draws with the same seed.
_ALONE = 0x616C6F6E65


class _Strict(BaseModel):
    """A model that refuses unknown keys and wrong types."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, populate_by_name=True)


class NumberEntry(_Strict):
    """One number of a simulator, on the joint side.

    - ``id``: ``kind of joint``; of the kind ``own``, the parameter's name.
    - ``kind``, ``joint``, ``unit``: as in `RandomizedField`. ``unit`` ``1``: a factor on the value of the model, except
      for the kind ``own``. ``own``: a parameter without a number in rigid-body engines, on the motor side; ``note``
      says why, and what to do.
    - ``mean``, ``std``: over all hypotheses; ``low``, ``high``: range that holds 95 %.
    - ``lower``, ``upper``: values that are never exceeded; None without such a bound.
    - ``distribution``: ``uniform`` from ``low`` to ``high``, or ``joint``: drawn in ``joint_draw``.
    - ``varies_between_runs``: ``yes``, ``no`` or ``not known``. ``between_runs_std``: its part of ``std``.
    - ``draw``: ``episode`` for a number that varies between runs, ``once`` for one that is only unknown.
    - ``parameters``: those of the posterior that it comes from.
    - ``correlated_with``: correlations beyond 0.5 by ``id``.
    - ``simulators``: its parameter by simulator.
    """

    id: str
    kind: str
    joint: str
    unit: str
    mean: float
    std: float
    low: float
    high: float
    lower: float | None
    upper: float | None
    distribution: Literal["uniform", "joint"]
    varies_between_runs: Literal["yes", "no", "not known"]
    between_runs_std: float
    draw: Literal["episode", "once"]
    parameters: list[str]
    correlated_with: dict[str, float]
    simulators: dict[str, str]
    note: str


class HypothesisEntry(_Strict):
    """One hypothesis of a joint draw: its causes, probability, mean (n,) and covariance (n, n)."""

    causes: list[str]
    weight: float = Field(gt=0)
    mean: list[float]
    covariance: list[list[float]]


class JointDraw(_Strict):
    """The numbers that are drawn together, in this order: first a hypothesis by its weight, then its Gaussian."""

    order: list[str]
    draw: Literal["episode", "once"]
    hypotheses: list[HypothesisEntry] = Field(min_length=1)

    @model_validator(mode="after")
    def _sizes(self) -> JointDraw:
        n = len(self.order)
        for one in self.hypotheses:
            if len(one.mean) != n or np.shape(one.covariance) != (n, n):
                raise ValueError(f"expected a mean of {n} and a covariance of {n} x {n} numbers")
        return self


class RandomizationDocument(_Strict):
    """Ranges and joint draws for any simulator, as `axisight.posterior.randomization_document` returns them.

    - ``name``, ``verdict``, ``robot``, ``version``: of the diagnosis.
    - ``numbers``: every number that is drawn; ``joint_draw``: those that are drawn together, None if none are.
    """

    format: Literal["axisight.randomization/1"] = Field(alias="schema")
    name: str
    verdict: str
    robot: str
    version: str
    numbers: list[NumberEntry]
    joint_draw: JointDraw | None

    @model_validator(mode="after")
    def _same(self) -> RandomizationDocument:
        joint = [n.id for n in self.numbers if n.distribution == "joint"]
        order = [] if self.joint_draw is None else self.joint_draw.order
        if joint != order:
            raise ValueError(f"joint_draw: expected the order {joint}, got {order}")
        return self

    def number(self, name: str) -> NumberEntry:
        """Return a number by its ``id``; raises KeyError for an unknown one."""
        return {n.id: n for n in self.numbers}[name]

    def samples(self, number: int, *, seed: int, first_run: int = 0) -> xr.Dataset:
        """Return samples of all numbers by ``id``, over ``draw``.

        Sample ``i`` depends on seed and run ``first_run + i`` only. Raises InputError for a number, seed or run that is
        no whole number.
        """
        runs = range(start := whole("first_run", first_run, 0), start + whole("number", number))
        used = seed_of("seed", seed)
        values = {
            n.id: _uniform(n, used, k, runs)
            for k, n in enumerate(self.numbers)
            if n.distribution == "uniform"
        }
        if self.joint_draw is not None:
            _, drawn = self._mixture(self.joint_draw).drawn(used, runs)
            values |= dict(zip(self.joint_draw.order, drawn.T, strict=True))
        return xr.Dataset(
            {n.id: ("draw", values[n.id], {"units": n.unit}) for n in self.numbers},
            coords={"draw": np.array(runs)},
            attrs={"seed": used},
        )

    def _mixture(self, joint: JointDraw) -> Mixture:
        used = [n for n in self.numbers if n.distribution == "joint"]
        places = np.arange(len(used))
        parts = [
            Part(h.weight, places, np.array(h.mean), np.array(h.covariance))
            for h in joint.hypotheses
        ]
        bounds = [
            (-np.inf if n.lower is None else n.lower, np.inf if n.upper is None else n.upper)
            for n in used
        ]
        return Mixture(tuple(parts), np.zeros(len(used)), np.array(bounds))


def _uniform(n: NumberEntry, seed: int, place: int, runs: range) -> Array:
    share = [np.random.default_rng([seed, _ALONE, place, run]).random() for run in runs]
    return n.low + np.array(share) * (n.high - n.low)
