"""Verdicts of the axes that agree with the verdict of the arm and with the table of the gap.

The estimation logs say how much of each axis's residual stands above the floor, and what the causes remove of
it. The validation logs say what the table shows. One rule makes the label of an axis from both:

| arm | label of an axis |
|---|---|
| *none* | *none* |
| *explained* | *explained* where a cause acts or the axis has a gap; else *none* |
| *explained in part* | as *explained*, or as *unknown* |
| *undecidable* | as above, and *undecidable* where a cause acts that stays open |
| *unknown* | *explained* where a cause removes the gap, *unknown* where a gap is left, else *none* |

By inverse dynamics, an axis of such an arm is *unknown* where no cause acts and a gap is left. An axis that would be
*explained* is *explained in part* where the gap with the causes is at least twice the floor, with the error of formulas
added in squares. The arm is *explained in part* where an axis of an *explained* arm is, or is *unknown*. At least one
axis has the verdict of the arm, or of its part. An axis that is *none* has no cause, and no place where the gap lies.

An axis whose torque carries nothing is *not judged*, whatever the arm is.

An axis has a gap where one of these holds:

| evidence | limit |
|---|---|
| a validation log stands above what passes for the floor | as `carry_over.above_floor` |
| the simulation of a validation log broke off | |
| both encoders contradict its gear, and the verdict was withdrawn for that | as `carry_over.carried_over` |
| the residual of the estimation logs has an excess, and the validation logs a gap | 0.3; 10 % above the floor |
| the same excess is too large for noise of another colour, by inverse dynamics | 1.0 |

Excess is that of `AxisVerdict`; 0.3 is ``Settings.largest_scatter``. In a closed loop the residual of one axis
shows on the others, so the last row needs inverse dynamics.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from axisight.gap.facts.axis_names import at_floor
from axisight.gap.facts.result import AxisVerdict, AxisVerdictKind, Gap, VerdictKind
from axisight.gap.facts.settings import Settings
from axisight.gap.measure.gap_figures import Stages
from axisight.gap.ranking.twins import open_twins
from axisight.gap.verdict.carry_over import above_floor, far_above_floor
from axisight.gap.verdict.conclusion import OF_COLOUR, Conclusion


@dataclass(frozen=True)
class AxisEvidence:
    """What is known of one axis, all relative to the torque or its noise [1].

    ``excess`` and ``explained`` as in `AxisVerdict`; ``refitted``, ``after`` and ``floor`` as in `Gap`;
    ``above``: whether a validation log stands above what passes for the floor; ``left``: whether the causes leave
    a gap of at least twice the floor; ``silent``: whether its torque carries nothing; ``gear``: whether the verdict was
    withdrawn because both encoders contradict its gear.
    """

    excess: float
    explained: float
    refitted: float
    after: float
    floor: float
    above: bool = False
    left: bool = False
    silent: bool = False
    gear: bool = False

    @property
    def quiet(self) -> bool:
        """Whether the re-fitted simulator is at the floor on the validation logs."""
        return not self.above and at_floor(self.refitted, self.floor)

    def has_gap(self, settings: Settings, *, own_residual: bool) -> bool:
        """Whether anything is to be explained; ``own_residual``: residuals of other axes do not show here."""
        if self.silent:
            return False
        seen = self.excess > settings.largest_scatter and not self.quiet
        broke_off = not np.isfinite(self.refitted)
        colour = own_residual and self.excess > OF_COLOUR
        return self.above or self.gear or seen or broke_off or colour


@dataclass(frozen=True)
class Acting:
    """Where a cause acts: ``axes`` from 1, none of the whole arm; ``open``: something else may be it."""

    axes: tuple[int, ...]
    open: bool = False


def axis_verdicts(
    arm: VerdictKind,
    evidence: Sequence[AxisEvidence],
    causes: Sequence[Acting],
    settings: Settings,
    *,
    own_residual: bool,
) -> tuple[AxisVerdict, ...]:
    """Return the verdict of each axis, in agreement with that of the ``arm``.

    ``causes``: all of the diagnosis, in its order. ``own_residual``: by inverse dynamics, where errors of
    axes add up.
    """
    gaps = [e.has_gap(settings, own_residual=own_residual) for e in evidence]
    acting = [
        tuple(k for k, c in enumerate(causes) if i in c.axes or (gap and not c.axes))
        for i, gap in enumerate(gaps, start=1)
    ]
    acting = [() if e.silent else mine for e, mine in zip(evidence, acting, strict=True)]
    labels = [
        _label(arm, e, gap, mine, causes, settings, own_residual=own_residual)
        for e, gap, mine in zip(evidence, gaps, acting, strict=True)
    ]
    known = {arm, "explained_in_part"} if arm == "explained" else {arm}
    if arm != "none" and known.isdisjoint(labels):
        # A cause of the whole arm that leaves no axis above the floor acts on all of them alike.
        whole = tuple(k for k, c in enumerate(causes) if not c.axes)
        for i in _stand_for_the_arm(arm, evidence, labels, acting, whole):
            labels[i] = "explained_in_part" if arm == "explained" and evidence[i].left else arm
            acting[i] = acting[i] if arm == "unknown" else tuple(sorted({*acting[i], *whole}))
    return tuple(
        AxisVerdict(i, label, *(0.0, 0.0) if e.silent else (e.excess, e.explained), mine)
        for i, (label, e, mine) in enumerate(zip(labels, evidence, acting, strict=True), start=1)
    )


def _label(
    arm: VerdictKind,
    evidence: AxisEvidence,
    gap: bool,
    acting: Sequence[int],
    causes: Sequence[Acting],
    settings: Settings,
    *,
    own_residual: bool,
) -> AxisVerdictKind:
    if evidence.silent:
        return "not_judged"
    if arm == "none" or not (gap or acting):
        return "none"
    if own_residual and not acting and evidence.left:
        return "unknown"
    if arm == "undecidable" and any(causes[k].open for k in acting):
        return "undecidable"
    if arm == "unknown" and gap and not _removed(evidence, acting, causes, settings):
        return "unknown"
    return "explained_in_part" if evidence.left else "explained"


def _removed(
    evidence: AxisEvidence, acting: Sequence[int], causes: Sequence[Acting], settings: Settings
) -> bool:
    """Whether the causes remove the gap of an axis: those that act there, or all with the re-fit beside them."""
    gone = bool(acting) or at_floor(evidence.after, evidence.floor)
    return bool(causes) and gone and evidence.explained >= settings.explained_share


def _stand_for_the_arm(
    arm: VerdictKind,
    evidence: Sequence[AxisEvidence],
    labels: Sequence[AxisVerdictKind],
    acting: Sequence[Sequence[int]],
    whole: Sequence[int],
) -> list[int]:
    """Return the axes (from 0) that take the verdict of the arm where none has it by itself."""
    if arm == "unknown":
        return [_leading(evidence, labels)]
    if whole:
        return [i for i, e in enumerate(evidence) if not e.silent]
    return [i for i, mine in enumerate(acting) if mine] or [_leading(evidence, labels)]


def _leading(evidence: Sequence[AxisEvidence], labels: Sequence[AxisVerdictKind]) -> int:
    """Return the axis (from 0) with the largest gap of those without an explanation, if there are any."""
    free = [i for i, label in enumerate(labels) if label == "none"]
    free = free or [i for i, e in enumerate(evidence) if not e.silent]

    def size(i: int) -> tuple[float, float]:
        above = evidence[i].refitted ** 2 - evidence[i].floor ** 2
        return (above if np.isfinite(above) else np.inf) if above > 0 else 0.0, evidence[i].excess

    return max(free, key=size)


def with_axes_agreed(
    conclusion: Conclusion, stages: Stages, gap: Gap, settings: Settings, *, own_residual: bool
) -> Conclusion:
    """Return the conclusion with verdicts of the axes that agree with it and with the gap of the validation logs.

    ``stages``: as they are judged; ``gap``: as it is told.
    """
    above = np.any(above_floor(stages.refitted, stages) > 0, axis=0)
    left = far_above_floor(stages, settings.model_error)
    figures = zip(
        conclusion.axes,
        gap.refitted_per_axis.tolist(),
        gap.after_per_axis.tolist(),
        gap.floor_per_axis.tolist(),
        above.tolist(),
        left.tolist(),
        strict=True,
    )
    silent, why = stages.given.silent, conclusion.withdrawn
    gear = None if why is None or why.why != "gear" else why.axis
    evidence = [
        AxisEvidence(
            a.excess,
            a.explained,
            before,
            after,
            floor,
            above,
            left,
            silent=a.axis - 1 in silent,
            gear=a.axis == gear,
        )
        for a, before, after, floor, above, left in figures
    ]
    still_open = {x for group in open_groups(conclusion, len(evidence)) for x in group}
    causes = [
        Acting(c.axes or (() if c.axis is None else (c.axis,)), c.label in still_open)
        for c in conclusion.causes
    ]
    axes = axis_verdicts(conclusion.verdict, evidence, causes, settings, own_residual=own_residual)
    return replace(conclusion, axes=axes)


def verdict_told(conclusion: Conclusion) -> VerdictKind:
    """Return the verdict of the arm as it is told: *explained in part* where its causes leave a gap unexplained."""
    parts = {a.verdict for a in conclusion.axes} & {"explained_in_part", "unknown"}
    if conclusion.verdict == "explained" and parts:
        return "explained_in_part"
    return conclusion.verdict


def open_groups(conclusion: Conclusion, n_axes: int) -> tuple[tuple[str, ...], ...]:
    """Return what stays open: groups of labels, the cause first, without twins that no logs tell apart.

    None where the verdict is not *undecidable*.
    """
    if conclusion.verdict != "undecidable":
        return ()
    twins = set(open_twins(conclusion.causes, n_axes))
    return tuple(g for g in conclusion.equivalent if g not in twins) or conclusion.equivalent
