"""The document of a posterior's ranges and joint draws for any simulator."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from axisight.arguments import instance, switch
from axisight.posterior.randomization.document import (
    SCHEMA,
    HypothesisEntry,
    JointDraw,
    NumberEntry,
    RandomizationDocument,
)
from axisight.posterior.randomization.engines import places_of
from axisight.posterior.randomization.fields import Fields, RandomizedField, bounds_of, fields_of
from axisight.posterior.randomization.homes import Number, homes
from axisight.posterior.randomization.layout import mode_of
from axisight.posterior.result import Posterior

Array = NDArray[np.float64]


def randomization_document(
    posterior: Posterior, *, elastic_gears: bool = False
) -> RandomizationDocument:
    """Return ranges and joint draws of all parameters for any simulator.

    Numbers of engines are on the joint side, as in `randomization`. Parameters without one keep the name, side and unit
    of the posterior. No parameter is left out.

    posterior
        Posterior of a diagnosis.
    elastic_gears
        As in `randomization`: stiffness and damping of gears are numbers of the model's joints. Otherwise they are of
        the kind ``own``.

    Raises InputError for a wrong argument.
    """
    known = instance("posterior", posterior, Posterior)
    numbers, homeless = homes(known, elastic_gears=switch("elastic_gears", elastic_gears))
    numbers += [
        Number("own", name, False, terms={name: 1.0}, stated_unit=known.parameter(name).unit)
        for name in homeless
    ]
    fields = fields_of(known, numbers, no_range=())
    entries = [
        _entry(known, number, f, homeless) for number, f in zip(numbers, fields.every, strict=True)
    ]
    return RandomizationDocument(
        schema=SCHEMA,
        name=known.name,
        verdict=known.verdict,
        robot=known.simulated.robot,
        version=known.version,
        numbers=entries,
        joint_draw=_joint(known, fields, entries),
    )


def _entry(
    posterior: Posterior, number: Number, f: RandomizedField, homeless: Mapping[str, str]
) -> NumberEntry:
    lower, upper = bounds_of(posterior, number)
    return NumberEntry(
        id=_id(f),
        kind=f.kind,
        joint="" if f.kind == "own" else f.joint,
        unit=f.unit,
        mean=f.mean,
        std=f.std,
        low=f.low,
        high=f.high,
        lower=lower if np.isfinite(lower) else None,
        upper=upper if np.isfinite(upper) else None,
        distribution="joint" if f.together else "uniform",
        varies_between_runs=_said(f.varies),
        between_runs_std=_between_runs(posterior, number),
        draw=_when([f]),
        parameters=list(f.parameters),
        correlated_with={name.removeprefix("own of "): float(x) for name, x in f.with_others},
        simulators=places_of(f.kind),
        note=homeless.get(f.joint, "") if f.kind == "own" else "",
    )


def _id(f: RandomizedField) -> str:
    return f.joint if f.kind == "own" else f.label


def _said(word: str) -> Literal["yes", "no", "not known"]:
    return "yes" if word == "yes" else "no" if word == "no" else "not known"


def _when(fields: Sequence[RandomizedField]) -> Literal["episode", "once"]:
    return "episode" if mode_of(fields) == "reset" else "once"


def _between_runs(posterior: Posterior, number: Number) -> float:
    """Return the standard deviation of a number between runs."""
    parts = [
        slope * x.std
        for name, slope in number.terms.items()
        if (x := posterior.variation(name)) is not None and x.varies
    ]
    return float(np.sqrt(np.sum(np.square(parts))))


def _joint(posterior: Posterior, fields: Fields, entries: list[NumberEntry]) -> JointDraw | None:
    place = fields.together
    if not place:
        return None
    pick = np.ix_(place, place)
    return JointDraw(
        order=[entries[i].id for i in place],
        draw=_when([fields.every[i] for i in place]),
        hypotheses=[
            HypothesisEntry(
                causes=list(h.causes),
                weight=float(w),
                mean=m[place].tolist(),
                covariance=c[pick].tolist(),
            )
            for h, w, m, c in zip(
                posterior.hypotheses,
                fields.weights,
                fields.means,
                fields.covariances,
                strict=True,
            )
        ],
    )
