"""What a diagnosis says: data only, so that a figure or a page can be made again."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.gap.faults import InputFinding
from axisight.storage import write_whole

VerdictKind = Literal["none", "explained", "unknown", "undecidable"]
Mode = Literal["closed_loop", "inverse_dynamics"]
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Interval:
    """A value with its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Gap:
    """Relative torque error on the validation logs, rms over axes and logs [1].

    ``before``: the simulator as given; ``refitted``: its own parameters fitted
    within their tolerances, no effect added; ``after``: with the causes added;
    ``floor``: what a perfect model would still leave (sensor noise). The
    ``*_per_axis`` arrays have shape (n_axes,).
    """

    before: float
    refitted: float
    after: float
    floor: float
    before_per_axis: Array
    refitted_per_axis: Array
    after_per_axis: Array
    floor_per_axis: Array


@dataclass(frozen=True)
class Where:
    """One place where the gap lies. ``share`` of the squared gap above the floor [1]."""

    axis: int
    share: float
    band_hz: tuple[float, float] | None
    regime: str | None
    evidence: str


@dataclass(frozen=True)
class Cause:
    """An effect that explains (part of) the gap; ``axis`` is 1-based or None for the arm."""

    effect: str
    axis: int | None
    probability: float
    parameters: dict[str, Interval]
    units: dict[str, str]
    gap_reduction: Interval
    family: str = ""
    family_probability: float = 1.0


@dataclass(frozen=True)
class AxisVerdict:
    """What the estimation logs say of one axis (from 1).

    ``excess``: mean square of the weighted residual of the re-fitted simulator above the floor,
    in units of noise plus model error; ``explained``: share of it that the causes remove;
    ``causes``: which of the diagnosis's causes act on the axis.
    """

    axis: int
    verdict: VerdictKind
    excess: float
    explained: float
    causes: tuple[int, ...]


@dataclass(frozen=True)
class Candidate:
    """One effect on one axis as it was ranked, held out.

    ``score``: share of the explainable squared error on held-out estimation
    data that the candidate removes [1]; ``significance``: how many standard
    errors (block jackknife) that is from zero.
    """

    effect: str
    axis: int | None
    probability: float
    score: float
    significance: float
    status: str

    @property
    def label(self) -> str:
        """``effect@axis``, or the effect alone when it belongs to the whole arm."""
        return self.effect if self.axis is None else f"{self.effect}@{self.axis}"


@dataclass(frozen=True)
class Overlay:
    """Measured and simulated torque on one axis of one held-out log, for plotting.

    Arrays have shape (n,); torque in Nm (N on a prismatic axis).
    """

    log: str
    axis: int
    time_s: Array
    measured_nm: Array
    before_nm: Array
    after_nm: Array


@dataclass(frozen=True)
class Diagnosis:
    """Everything a diagnosis found.

    ``band_map``: dims (axis, band), ``regime_maps[name]``: dims (axis, bin);
    each a Dataset with ``share`` (of that axis's squared baseline error above
    the floor), ``excess`` (ratio of the squared error to the floor) and
    ``significance`` (in standard errors). Band and bin coordinates are labels.
    ``findings``: faults of robot file and logs with which a diagnosis still makes sense;
    ``checks`` has them in words, after those of the diagnosis itself.
    """

    name: str
    mode: Mode
    verdict: VerdictKind
    headline: str
    gap: Gap
    where: tuple[Where, ...]
    causes: tuple[Cause, ...]
    alternatives: tuple[Candidate, ...]
    equivalent: tuple[tuple[str, ...], ...]
    next_experiment: str | None
    ranking: tuple[Candidate, ...]
    band_map: xr.Dataset
    regime_maps: dict[str, xr.Dataset]
    overlays: tuple[Overlay, ...]
    refit: dict[str, Interval]
    checks: tuple[str, ...]
    axes: tuple[AxisVerdict, ...] = ()
    findings: tuple[InputFinding, ...] = ()
    p_none: float = 0.0
    p_unknown: float = 0.0
    provenance: dict[str, Any] = field(default_factory=dict)

    def to_verdict(self) -> dict[str, Any]:
        """Return the verdict as ``axisight.verdict/1`` (plus keys that readers may ignore)."""
        gap = self.gap
        return {
            "schema": "axisight.verdict/1",
            "mode": self.mode,
            "verdict": self.verdict,
            "headline": self.headline,
            "gap": {
                "before": gap.before,
                "after": gap.after,
                "floor": gap.floor,
                "refitted": gap.refitted,
                "per_axis": {
                    "before": gap.before_per_axis.tolist(),
                    "after": gap.after_per_axis.tolist(),
                    "floor": gap.floor_per_axis.tolist(),
                    "refitted": gap.refitted_per_axis.tolist(),
                },
            },
            "where": [
                {
                    "axis": w.axis,
                    "share": w.share,
                    "band_hz": None if w.band_hz is None else list(w.band_hz),
                    "regime": w.regime,
                    "evidence": w.evidence,
                }
                for w in self.where
            ],
            "causes": [_cause(c) for c in self.causes],
            "alternatives": [
                {"effect": c.effect, "axis": c.axis, "probability": c.probability}
                for c in self.alternatives
            ],
            "equivalent": [list(group) for group in self.equivalent],
            "next_experiment": self.next_experiment,
            "p_none": self.p_none,
            "p_unknown": self.p_unknown,
            "axes": [
                {
                    "axis": a.axis,
                    "verdict": a.verdict,
                    "gap": {
                        "before": float(gap.before_per_axis[a.axis - 1]),
                        "after": float(gap.after_per_axis[a.axis - 1]),
                        "floor": float(gap.floor_per_axis[a.axis - 1]),
                    },
                    "explained": a.explained,
                    "causes": list(a.causes),
                }
                for a in self.axes
            ],
            "ranking": [_ranked(c) for c in self.ranking],
            "checks": list(self.checks),
            "findings": [f.to_dict() for f in self.findings],
            "provenance": self.provenance,
        }

    def save_verdict(self, path: Path | str) -> None:
        """Write the verdict as JSON; the file appears whole or not at all."""
        write_whole(Path(path), json.dumps(self.to_verdict(), indent=2, allow_nan=False) + "\n")


def _ranked(candidate: Candidate) -> dict[str, Any]:
    return {
        "effect": candidate.effect,
        "axis": candidate.axis,
        "probability": candidate.probability,
        "score": candidate.score,
        "significance": candidate.significance,
        "status": candidate.status,
    }


def _cause(cause: Cause) -> dict[str, Any]:
    return {
        "effect": cause.effect,
        "axis": cause.axis,
        "probability": cause.probability,
        "family": cause.family,
        "family_probability": cause.family_probability,
        "parameters": {
            name: {
                "value": p.value,
                "ci95": [p.low, p.high],
                "unit": cause.units.get(name, "1"),
            }
            for name, p in cause.parameters.items()
        },
        "gap_reduction": {
            "value": cause.gap_reduction.value,
            "ci95": [cause.gap_reduction.low, cause.gap_reduction.high],
        },
    }
