"""Result of a diagnosis: data only, from which every figure and page can be made again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from axisight.display import html
from axisight.display.summary import MOST, summarized
from axisight.documents import finite
from axisight.effects import Effect
from axisight.errors import InputError
from axisight.gap.facts.axis_names import axis_label, in_words, verdict_word
from axisight.gap.facts.compared_quantity import MOTION_HEAD, Compared, VelocityFrom, motion_words
from axisight.gap.facts.experiment import Experiment
from axisight.gap.facts.faults import Finding
from axisight.gap.facts.schema import VERDICT_SCHEMA
from axisight.gap.facts.shown import cause_in_words, cause_rows, percent
from axisight.gap.facts.trace import Trace
from axisight.posterior.result import Posterior
from axisight.remainder import ModelledRemainder
from axisight.robot.axis_names import axis_number
from axisight.storage import write_whole

VerdictKind = Literal["none", "explained", "explained_in_part", "unknown", "undecidable"]
AxisVerdictKind = Literal[VerdictKind, "not_judged"]
Mode = Literal["closed_loop", "inverse_dynamics"]
Hidden = Literal["tolerances", "motion"]
Array = NDArray[np.float64]


@summarized
@dataclass(frozen=True)
class Interval:
    """A value with its 95 % interval."""

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        """Return ``0.61 (0.58 to 0.64)``."""
        return f"{self.value:.4g} ({self.low:.4g} to {self.high:.4g})"


@summarized
@dataclass(frozen=True)
class Pooled:
    """Torque error of the whole arm as identification papers give it: sqrt(sum e^2 / sum u^2) [1].

    Sums over all samples, axes and validation logs; e is simulated minus measured torque, u the measured torque
    itself, not about its mean. Axes with large torques weigh more than in `Gap`. Stages as in `Gap`.
    """

    before: float
    refitted: float
    after: float
    floor: float


@summarized
@dataclass(frozen=True)
class AxisStages:
    """Errors of the simulator at each stage, by axis (n_axes,); ``before`` to ``floor`` as in `Gap`."""

    before: Array
    refitted: Array
    after: Array
    floor: Array


@summarized
@dataclass(frozen=True)
class MotionErrors:
    """Errors of position and velocity on the validation logs where positions are compared, rms over time and logs.

    Motor side, ``position_rad`` without its mean along a log [rad], ``velocity_rad_s`` [rad/s] (m and m/s of an
    axis that slides without a gear), both below the frequency up to which positions are compared.
    ``velocity_from``: ``"logged"``, or ``"positions"`` where a log has no velocity, or one that is not that of
    its position.
    """

    position_rad: AxisStages
    velocity_rad_s: AxisStages
    velocity_from: VelocityFrom

    def rows(self) -> list[tuple[float, ...]]:
        """Return a row an axis: position before, after and noise alone, then velocity; columns as `MOTION_HEAD`."""
        stages = [
            getattr(of, stage)
            for of in (self.position_rad, self.velocity_rad_s)
            for stage in ("before", "after", "floor")
        ]
        return [tuple(map(float, row)) for row in zip(*stages, strict=True)]

    def to_dict(self) -> dict[str, Any]:
        """Return what stands in the verdict."""
        of = {"position_rad": self.position_rad, "velocity_rad_s": self.velocity_rad_s}
        told = {k: {s: getattr(v, s).tolist() for s in _STAGES} for k, v in of.items()}
        return {**told, "velocity_from": self.velocity_from}


@summarized
@dataclass(frozen=True)
class Gap:
    """Relative torque error on the validation logs, rms over axes and logs [1].

    ``before``: the simulator as given; ``refitted``: its own parameters fitted
    within their tolerances, no effect added; ``after``: with the causes added;
    ``floor``: the gap that a perfect simulator would still have (sensor noise). The
    ``*_per_axis`` arrays have shape (n_axes,). ``pooled`` is None where the robot has axes that turn and
    axes that slide. Where ``compared`` is ``"positions"``, torques are those that the stated gains command along
    the positions of machine and simulator, and ``motion`` has the errors of positions and velocities; else None.
    """

    before: float
    refitted: float
    after: float
    floor: float
    before_per_axis: Array
    refitted_per_axis: Array
    after_per_axis: Array
    floor_per_axis: Array
    pooled: Pooled | None = None
    compared: Compared = "torques"
    motion: MotionErrors | None = None

    @property
    def stages(self) -> tuple[float, float, float, float]:
        """Before, re-fitted, after and floor [1]."""
        return self.before, self.refitted, self.after, self.floor


@summarized
@dataclass(frozen=True)
class Where:
    """One place where the gap lies.

    ``share`` [1] of the squared gap above the floor: of an *unknown* arm on axes that are *unknown*, else of the
    gap before the causes. ``evidence``: the same in words.
    """

    axis: int
    share: float
    band_hz: tuple[float, float] | None
    regime: str | None
    evidence: str


@summarized
@dataclass(frozen=True)
class Remainder:
    """The gap above the floor that is left on the validation logs with the causes in.

    ``gap``: sqrt(after^2 - floor^2) [1], zero where only noise is left; ``per_axis``: the same by axis, (n_axes,).
    ``where``: places above the floor, with shares of the squared remainder. ``varies_with``: the variable that it
    follows at the first place (``speed``, ``direction``, ``position``, ``acceleration``, ``load``, ``time``, or ``the
    speed of axis`` and its number), if any. ``modelled``: its model, if it was asked for.
    """

    gap: float
    per_axis: Array
    where: tuple[Where, ...] = ()
    varies_with: str | None = None
    modelled: ModelledRemainder | None = None


@summarized
@dataclass(frozen=True)
class Reproduction:
    """How far the model reproduces the user's own simulator along the same references.

    ``per_axis`` (n_axes,): rms of the difference of torques over the rms of the user's torque about its mean
    [1]. ``of_gap`` (n_axes,): the same over the rms error of the user's simulator, or of the model where nothing
    was taken off. ``taken_off``: whether the difference was subtracted from the logs, so that the gap is that of
    the user's simulator; not by inverse dynamics along motions that are too far apart. ``where`` the
    difference exceeds the noise of the logs.
    """

    per_axis: Array
    of_gap: Array
    taken_off: bool
    where: tuple[Where, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return what stands in the verdict."""
        return {
            "per_axis": self.per_axis.tolist(),
            "of_gap": self.of_gap.tolist(),
            "taken_off": self.taken_off,
        }


def label(effect: str, axis: int | None, axes: tuple[int, int] | None = None) -> str:
    """Return ``effect@axis`` or ``effect@5,6``; the effect alone when it belongs to the whole arm."""
    if axes is not None:
        return f"{effect}@{axes[0]},{axes[1]}"
    return effect if axis is None else f"{effect}@{axis}"


@summarized
@dataclass(frozen=True)
class Cause:
    """An effect that explains (part of) the gap; ``axis`` is 1-based or None for the arm.

    ``axes``: both of an effect between two, of which ``axis`` is the first; None of others, as in
    `Candidate` and `DetectionLimit`. ``rivals``: labels of what the data cannot tell from it, of
    `Diagnosis.equivalent`.
    """

    effect: str
    axis: int | None
    probability: float
    parameters: dict[str, Interval]
    units: dict[str, str]
    gap_reduction: Interval
    family: str = ""
    family_probability: float = 1.0
    axes: tuple[int, int] | None = None
    rivals: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        """``effect@axis``, or the effect alone when it belongs to the whole arm."""
        return label(self.effect, self.axis, self.axes)

    def as_effect(self) -> Effect:
        """Return the effect with the values that were found."""
        values = {name: p.value for name, p in self.parameters.items()}
        return Effect(self.effect, None if self.axes else self.axis, values, self.axes)


@summarized
@dataclass(frozen=True)
class AxisVerdict:
    """Verdict of one axis (from 1); `axisight.gap.verdict.axis_verdicts` has the rule.

    ``excess``: mean square of the residual of the re-fitted simulator above the floor on the estimation logs, in units
    of noise plus model error. ``explained``: share of it that the causes remove. ``causes``: places of those that act
    here; one of the whole arm acts on axes with a gap. Where a torque carries nothing (*not judged*) the gap is NaN.
    """

    axis: int
    verdict: AxisVerdictKind
    excess: float
    explained: float
    causes: tuple[int, ...]


@summarized
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
    axes: tuple[int, int] | None = None

    @property
    def label(self) -> str:
        """``effect@axis``, or the effect alone when it belongs to the whole arm."""
        return label(self.effect, self.axis, self.axes)


@summarized
@dataclass(frozen=True)
class DetectionLimit:
    """The smallest amplitude of an effect that the logs would have shown with 95 % probability.

    ``parameter`` is the first amplitude that no plainer law has; ``others`` are the values of the other
    parameters. ``value`` in ``unit``; None where no possible size would show. Then ``hidden`` says why:
    ``"tolerances"`` of the simulator's own parameters make up for it, together with a plainer law, or the
    ``"motion"`` hardly excites it. ``axis`` from 1, None for the arm.
    """

    effect: str
    axis: int | None
    parameter: str
    value: float | None
    unit: str
    axes: tuple[int, int] | None = None
    others: Mapping[str, float] = field(default_factory=dict)
    hidden: Hidden | None = None


@summarized
@dataclass(frozen=True)
class Overlay:
    """Measured and simulated torque on one axis of one validation log, as they are compared.

    Arrays (n,) are thinned for plotting; torque in Nm (N on a prismatic axis). Both torques passed the same low-pass
    of ``lowpass_hz``, or none. Where positions are compared, it is that of their errors. ``counted`` (n,): weight of
    each error, of mean square one; zero at ends that do not count. ``gap_before``, ``gap_after``: rms error of the
    whole log over ``torque_std_nm``, the standard deviation of the measured torque [1]; their rms over logs is that
    of `Gap`.
    """

    log: str
    axis: int
    time_s: Array
    measured_nm: Array
    before_nm: Array
    after_nm: Array
    counted: Array
    gap_before: float
    gap_after: float
    torque_std_nm: float
    lowpass_hz: float | None = None

    @property
    def curves_nm(self) -> tuple[Array, Array, Array]:
        """Measured torque, and simulated before and after (n,); NaN where an error does not count."""
        hidden = np.where(self.counted > 0, 0.0, np.nan)
        return self.measured_nm + hidden, self.before_nm + hidden, self.after_nm + hidden

    @property
    def errors_nm(self) -> tuple[Array, Array]:
        """Simulated minus measured, before and after (n,); NaN where an error does not count."""
        measured, before, after = self.curves_nm
        return before - measured, after - measured

    @property
    def rms_nm(self) -> tuple[float, float]:
        """Rms error of the whole log, before and after [Nm, N], as the gap has it."""
        return self.gap_before * self.torque_std_nm, self.gap_after * self.torque_std_nm


@summarized
@dataclass(frozen=True)
class Diagnosis:
    """Everything a diagnosis found.

    ``band_map``: dims (axis, band), ``regime_maps[name]``: dims (axis, bin); each a Dataset with ``share`` (of the
    axis's squared baseline error above the floor), ``excess`` (ratio of the squared error to the floor) and
    ``significance`` (in standard errors). Band and bin coordinates are labels.
    ``detection_limits``: of effects that are no cause. ``settings``: what was set.
    ``refit``: relative change of the simulator's own parameters [1]. ``findings``: faults of robot file and logs that
    rule out no diagnosis, and re-fitted parameters at the edge of their tolerance. ``experiment``: what was asked for.
    ``simulator``: how far the model reproduces the user's own simulator, where its logs were given.
    ``signals``, if asked for: a Dataset for each log, estimation logs first, with the dims (time_s, axis), of motors.
    ``measured_torque_nm`` [Nm, N on a prismatic axis]; ``simulated_before_torque_nm`` of the simulator as given,
    ``simulated_after_torque_nm`` of the re-fitted one with the causes: those behind ``gap.before`` and
    ``gap.after``. ``residual_before_torque_nm``, ``residual_after_torque_nm``: simulated less measured. Measured and
    simulated ``..._position_rad`` [rad, m]; none simulated by inverse dynamics. Coordinate ``gap_before``: that of
    ``gap``. Attributes: ``log``, ``role``, ``mode``, ``torque``, and ``lowpass_hz`` if torques are low-passed.
    ``trace``: the comparisons and moves of the search, with every rule that changed a log-weight.
    ``posterior``, if asked for: the joint distribution of the parameters of causes and simulator.
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
    p_none: float = 0.0
    p_unknown: float = 0.0
    remainder: Remainder | None = None
    detection_limits: tuple[DetectionLimit, ...] = ()
    findings: tuple[Finding, ...] = ()
    settings: dict[str, Any] = field(default_factory=dict)
    provenance: dict[str, Any] = field(default_factory=dict)
    experiment: Experiment | None = None
    simulator: Reproduction | None = None
    signals: tuple[xr.Dataset, ...] = ()
    trace: Trace = field(default_factory=Trace)
    posterior: Posterior | None = None

    @property
    def joints(self) -> tuple[str, ...]:
        """Name of the joint that each axis drives, where the provenance has them."""
        return tuple(self.provenance.get("axis_names", ()))

    def axis(self, axis: int | str) -> AxisVerdict:
        """Return the verdict of one axis, given by its number from 1 or by the name of its joint.

        Raises InputError for an axis that is not there, with the nearest joint name, and where the
        diagnosis has no verdicts by axis.
        """
        number = axis_number(axis, self.joints or len(self.gap.before_per_axis))
        for one in self.axes:
            if one.axis == number:
                return one
        raise InputError(f"axis: expected an axis with a verdict of its own, got {number}")

    def axis_rows(self) -> list[tuple[int, str, tuple[float, ...]]]:
        """Return of each axis number (from 1), verdict in words (empty without one), and gap as in `Gap.stages` [1]."""
        gap, verdicts = self.gap, {a.axis: a.verdict for a in self.axes}
        stages = (
            gap.before_per_axis,
            gap.refitted_per_axis,
            gap.after_per_axis,
            gap.floor_per_axis,
        )
        out = []
        for i, row in enumerate(zip(*(x.tolist() for x in stages), strict=True), start=1):
            out.append((i, verdict_word(verdicts.get(i, ""), row), row))
        return out

    def _summary(self) -> tuple[str, list[tuple[str, str]]]:
        """Return a title and rows for the repr: verdict, gap, causes with values, axes."""
        before, refitted, after, floor = map(percent, self.gap.stages)
        gap = (
            f"{before} as given, {refitted} re-fitted, {after} with the causes, {floor} noise alone"
        )
        rows = [("verdict", self.headline), ("gap", gap)]
        rows += [(cause.label, cause_in_words(cause)) for cause in self.causes[:MOST]]
        rows += [("causes", f"{len(self.causes)} in all")] if len(self.causes) > MOST else []
        for number, verdict, row in self.axis_rows()[:MOST]:
            name = f"axis {axis_label(number, self.joints)}"
            rows.append((name, f"{verdict}: {percent(row[0])} to {percent(row[2])}".lstrip(": ")))
        rows += [("next", self.next_experiment)] if self.next_experiment else []
        return f"Diagnosis {self.name!r}: {in_words(self.verdict)}", rows

    def _repr_html_(self) -> str:
        """Verdict, causes with values, and the gap by axis, for notebooks."""
        causes = [row for cause in self.causes for row in cause_rows(cause)]
        gap, joints = self.gap, self.joints
        rows = [
            (axis_label(i, joints), verdict, *map(percent, row))
            for i, verdict, row in self.axis_rows()
        ]
        rows.append(("all", self.verdict, *map(percent, gap.stages)))
        moved = [] if gap.motion is None else gap.motion.rows()
        then = [] if self.next_experiment is None else [f"next experiment: {self.next_experiment}"]
        return html.page(
            f"{self.name}: {self.verdict}",
            html.lines([self.headline]),
            html.table(
                ("cause and its values", "value", "95 % interval", "probability"), causes, "Causes"
            ),
            html.table(
                ("axis", "verdict", "gap before", "re-fitted", "after", "noise"),
                rows,
                "Gap by axis on the validation logs",
            ),
            html.table(
                ("axis", *MOTION_HEAD),
                ((str(i), *map(html.number, row)) for i, row in enumerate(moved, start=1)),
                "Errors of motion"
                if gap.motion is None
                else motion_words(gap.motion.velocity_from),
            ),
            html.lines([*(f"finding: {finding}" for finding in self.findings), *then]),
        )

    def to_verdict(self) -> dict[str, Any]:
        """Return the verdict as ``axisight.verdict/2``; `axisight.gap.verdict_schema` describes it.

        Numbers that are not finite, as the gap of a simulation that broke off, become None.
        """
        out = {
            "schema": VERDICT_SCHEMA,
            "name": self.name,
            "mode": self.mode,
            "verdict": self.verdict,
            "headline": self.headline,
            "gap": _gap(self.gap),
            "where": [_where(w) for w in self.where],
            "causes": [_cause(c) for c in self.causes],
            "alternatives": [
                {"effect": c.effect, **_place(c), "probability": c.probability}
                for c in self.alternatives
            ],
            "equivalent": [list(group) for group in self.equivalent],
            "next_experiment": self.next_experiment,
            "p_none": self.p_none,
            "p_unknown": self.p_unknown,
            "axes": [_axis(a, self.gap) for a in self.axes],
            "remainder": None if self.remainder is None else _remainder(self.remainder),
            "detection_limits": [_limit(limit) for limit in self.detection_limits],
            "refit": {name: _interval(change) for name, change in self.refit.items()},
            "ranking": [_ranked(c) for c in self.ranking],
            "simulator": None if self.simulator is None else self.simulator.to_dict(),
            "checks": list(self.checks),
            "findings": [f.to_dict() for f in self.findings],
            "settings": self.settings,
            "provenance": self.provenance,
            "trace": self.trace.to_dict(),
        }
        return dict(finite(out))

    def to_json(self) -> str:
        """Return the verdict as the text of its JSON file."""
        return json.dumps(self.to_verdict(), indent=2, allow_nan=False) + "\n"

    def save_verdict(self, path: Path | str) -> None:
        """Write the verdict as JSON; the file appears whole or not at all."""
        write_whole(Path(path), self.to_json())


_STAGES = ("before", "after", "floor", "refitted")


def _gap(gap: Gap) -> dict[str, Any]:
    return {
        **{stage: getattr(gap, stage) for stage in _STAGES},
        "pooled": None if gap.pooled is None else asdict(gap.pooled),
        "per_axis": {stage: getattr(gap, f"{stage}_per_axis").tolist() for stage in _STAGES},
        "compared": gap.compared,
        "motion": None if gap.motion is None else gap.motion.to_dict(),
    }


def _where(where: Where) -> dict[str, Any]:
    return {
        "axis": where.axis,
        "share": where.share,
        "band_hz": None if where.band_hz is None else list(where.band_hz),
        "regime": where.regime,
        "evidence": where.evidence,
    }


def _axis(axis: AxisVerdict, gap: Gap) -> dict[str, Any]:
    mine = {stage: float(getattr(gap, f"{stage}_per_axis")[axis.axis - 1]) for stage in _STAGES}
    return {
        "axis": axis.axis,
        "verdict": axis.verdict,
        "gap": mine,
        "excess": axis.excess,
        "explained": axis.explained,
        "causes": list(axis.causes),
    }


def _remainder(remainder: Remainder) -> dict[str, Any]:
    return {
        "gap": remainder.gap,
        "per_axis": remainder.per_axis.tolist(),
        "where": [_where(w) for w in remainder.where],
        "varies_with": remainder.varies_with,
    } | ({} if remainder.modelled is None else {"modelled": remainder.modelled.to_dict()})


def _place(item: Cause | Candidate | DetectionLimit) -> dict[str, Any]:
    """Return ``axis``, and ``axes`` beside it where there are two."""
    return {"axis": item.axis} | ({} if item.axes is None else {"axes": list(item.axes)})


def _limit(limit: DetectionLimit) -> dict[str, Any]:
    rest = {name: getattr(limit, name) for name in ("parameter", "value", "unit", "hidden")}
    return {"effect": limit.effect, **_place(limit), **rest, "others": dict(limit.others)}


def _interval(interval: Interval) -> dict[str, Any]:
    return {"value": interval.value, "ci95": [interval.low, interval.high]}


def _ranked(candidate: Candidate) -> dict[str, Any]:
    return {
        "effect": candidate.effect,
        **_place(candidate),
        "probability": candidate.probability,
        "score": candidate.score,
        "significance": candidate.significance,
        "status": candidate.status,
    }


def _cause(cause: Cause) -> dict[str, Any]:
    return {
        "effect": cause.effect,
        **_place(cause),
        "probability": cause.probability,
        "family": cause.family,
        "family_probability": cause.family_probability,
        "parameters": {
            name: {**_interval(p), "unit": cause.units.get(name, "1")}
            for name, p in cause.parameters.items()
        },
        "gap_reduction": _interval(cause.gap_reduction),
    }
