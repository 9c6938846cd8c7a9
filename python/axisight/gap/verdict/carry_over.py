"""Whether the verdict of the estimation logs holds on the validation logs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from axisight.effects import effect_info
from axisight.gap.facts.axis_names import hides_all
from axisight.gap.facts.compared_quantity import torque_of
from axisight.gap.facts.result import Gap
from axisight.gap.facts.settings import Settings
from axisight.gap.facts.withdrawal import Contradiction, Withdrawal
from axisight.gap.facts.wording import listed, percent
from axisight.gap.fit.tolerance_edges import BENT
from axisight.gap.measure.by_axis import OwnAxes
from axisight.gap.measure.gap_figures import Stage, Stages
from axisight.gap.measure.gear_deflections import GearErrors
from axisight.gap.verdict.conclusion import Conclusion, advice_unknown

Array = NDArray[np.float64]

# Excess of the gap over the floor on one log and axis that counts as clear. A re-fitted simulator without a fault
# leaves less, with its formula errors.
_FACTOR = 1.3
_SEEN = 0.03
# Gap with the causes, relative to the floor, from which the rest counts as unknown.
_FAR = 2.0
# Share of the explainable squared gap on validation logs that causes must remove: less than half of the amplitude is
# left then. One of two equal causes removes less.
_ENOUGH = 0.8
# Share of the excess over the floor that a cause of the size of noise must remove.
_HALF = 0.5
# Excess over the squared floor that encoder steps may leave: a motor that is held between two steps may oscillate.
_BY_STEPS = 0.5
# Noise cannot be this much larger than a gap that contains it.
_ABSURD = 1.25


def carried_over(
    conclusion: Conclusion,
    stages: Stages,
    gap: Gap,
    names: Sequence[str],
    settings: Settings,
    own: OwnAxes | None = None,
    bent: float = 0.0,
    removed: float | None = None,
    stepped: NDArray[np.bool_] | None = None,
    *,
    differentiated: bool = False,
    refuted: Array | float = 1.0,
    gears: GearErrors | None = None,
) -> Conclusion:
    """Return the conclusion, or *unknown* with the reason where the validation logs contradict it.

    | estimation logs say | validation logs contradict where | verdict then |
    |---|---|---|
    | causes | they do not shrink the gap there | *unknown* |
    | causes of the size of noise | they do not shrink it, and no log stands above the floor | *none* |
    | *none* | a log stands above the floor, or both encoders contradict a gear | *unknown* |
    | anything | the estimated noise is larger than a gap that is seen | *unknown* |
    | anything | noise of differentiated positions hides any gap | *unknown* |

    - ``own``: causes that are judged on their own axes alone; they must shrink the gap there.
    - ``bent``: share of the own parameters at the edge of their tolerance in the fit with the causes.
    - ``removed``: share of the validation residual above noise that the causes remove; None if unknown.
    - ``differentiated``: whether torques are predicted from differentiated positions. Their noise lies in the band
      that is compared, so that no average over the log removes it.
    - ``refuted`` (n_axes,): factors by which the model lowered the noise of the estimation logs [1]. Noise as large as
      the torque is no less doubtful for that.
    - ``gears``: errors of gears. Causes of one gear that remove its errors need not shrink a gap near the floor.
    - ``stepped`` (n_axes,): axes whose noise comes from encoder steps; none by default.
    """
    withdrawn = None
    labels = tuple(cause.label for cause in conclusion.causes)
    if gap.refitted > _SEEN and gap.floor > _ABSURD * gap.refitted:
        withdrawn = Withdrawal("noise", gap.before, gap.refitted, gap.floor)
    elif differentiated and hides_all(_estimated(gap, refuted)):
        withdrawn = Withdrawal("loud", gap.before, gap.refitted, gap.floor)
    elif own is not None:
        # Another motion may show more of what no effect explains, and as much of the causes.
        withdrawn = _no_fall_there(own, stages, names)
    elif conclusion.causes and removed is not None and _of_no_size(conclusion, stages, removed):
        return _nothing(conclusion)
    elif conclusion.causes:
        withdrawn = _no_fall(stages, gap, names, settings, stepped, labels)
        little = withdrawn is not None and withdrawn.why in ("fall", "part")
        near = gap.after <= _FAR * gap.floor
        if little and near and _mend_gears(conclusion, gears, settings):
            withdrawn = None
        if withdrawn is None and bent >= BENT:
            withdrawn = Withdrawal(
                "bent", gap.before, gap.after, gap.floor, None, None, labels, bent
            )
    elif conclusion.verdict == "none":
        withdrawn = _above_floor(stages, names)
        if withdrawn is None and gears is not None and gears.after > settings.significance:
            withdrawn = Withdrawal("gear", axis=gears.axis, share=gears.after)
    if withdrawn is None:
        return conclusion
    return replace(
        conclusion.without_causes("unknown"),
        next_experiment=_advice(withdrawn),
        withdrawn=withdrawn,
    )


def _estimated(gap: Gap, refuted: Array | float) -> float:
    """Return the floor of the arm [1] as it was before the model refuted that of single axes."""
    return float(np.sqrt(np.nanmean((gap.floor_per_axis / refuted) ** 2)))


def _mend_gears(conclusion: Conclusion, gears: GearErrors | None, settings: Settings) -> bool:
    """Whether all causes are of one gear, and remove its errors that both encoders show."""
    if gears is None or gears.before <= settings.significance:
        return False
    of_gear = all(
        c.axis == gears.axis and effect_info(c.effect).acts == "transmission"
        for c in conclusion.causes
    )
    return of_gear and gears.before**2 - gears.after**2 >= _ENOUGH * (gears.before**2 - 1.0)


def _advice(withdrawn: Withdrawal) -> str:
    if withdrawn.why == "loud":
        return (
            "Lower the cutoff of the comparison (--cutoff-hz), record larger motions, or log positions with a "
            "finer resolution."
        )
    if withdrawn.why == "noise":
        return (
            "Run `axisight check` on the logs. Look for glitches and for frozen or missing samples."
        )
    if withdrawn.log is None:
        return advice_unknown()
    return (
        f"Compare axis {withdrawn.axis} of {withdrawn.log} with the estimation logs: load, pose, speed, torque "
        "range. Record more runs like it for estimation."
    )


def _of_no_size(conclusion: Conclusion, stages: Stages, removed: float) -> bool:
    """Whether no validation log stands above the floor, and the causes remove less than half of the little excess."""
    small = all(a.excess <= _FACTOR**2 - 1.0 for a in conclusion.axes)
    return small and removed < _HALF and not np.any(above_floor(stages.refitted, stages) > 0)


def _nothing(conclusion: Conclusion) -> Conclusion:
    """Return *none* in place of causes of the size of noise; a check names them."""
    names = listed([c.label for c in conclusion.causes])
    return replace(
        conclusion.without_causes("none"),
        next_experiment=None,
        checks=(
            *conclusion.checks,
            f"Not a cause: {names}. It explains a gap of about the size of noise on the estimation logs, and "
            "nothing on the validation logs.",
        ),
    )


def above_floor(left: Stage, stages: Stages) -> Array:
    """Return by how much mean squares (n_logs, n_axes) exceed the floor with its allowances [1].

    Positive where a log and axis stand above the floor by more than formula errors explain.
    """
    passing = _FACTOR**2 * _squares(stages.floor) + _SEEN**2
    return _squares(left) - passing - (0.0 if stages.open is None else _squares(stages.open))


def far_above_floor(stages: Stages, model_error: float) -> NDArray[np.bool_]:
    """Return a mask (n_axes,) of the axes where the causes leave at least twice the floor.

    The floor has the error of formulas [1] added in squares, and what no data can explain.
    """
    least = _squares(stages.floor) + model_error**2
    passing = _FAR**2 * least + (0.0 if stages.open is None else _squares(stages.open))
    return np.asarray(_squares(stages.after).mean(axis=0) >= np.mean(passing, axis=0))


def open_check(stages: Stages) -> tuple[str, ...]:
    """Return sentences about gaps above the noise that no data can explain."""
    if stages.open is None or stages.after.mean() <= _FACTOR**2 * stages.floor.mean() + _SEEN**2:
        return ()
    share = percent(float(np.sqrt(stages.open.mean())))
    return (
        f"Dry friction can hold any torque within its band while a motor stands or reverses. Up to {share} of "
        f"the {torque_of(stages.compared)} cannot be known there. It counts as gap, but neither for nor against "
        "a cause.",
    )


def _squares(stage: Stage) -> Array:
    return np.array(stage.per_log())


def _floor(stages: Stages, stepped: NDArray[np.bool_] | None) -> float:
    """Return the mean square of the floor, raised for axes with coarse encoder steps."""
    noise, left = _squares(stages.floor), _squares(stages.after)
    more = np.clip(left - noise, 0.0, _BY_STEPS * noise)
    return float(np.nanmean(noise if stepped is None else noise + np.where(stepped, more, 0.0)))


def _no_fall(
    stages: Stages,
    gap: Gap,
    names: Sequence[str],
    settings: Settings,
    stepped: NDArray[np.bool_] | None,
    causes: tuple[str, ...],
) -> Withdrawal | None:
    """Return the contradiction where the causes, by label, remove too little of the gap."""
    floor = _floor(stages, stepped)
    if gap.after**2 - gap.refitted**2 > settings.smallest_gain * gap.floor**2:
        return Withdrawal("refit", gap.refitted, gap.after, gap.floor, causes=causes)
    # A small excess over the noise is within the error of the floor itself.
    if gap.after**2 - floor <= settings.smallest_gain * floor:
        return None
    explainable = gap.before**2 - floor
    share = (gap.before**2 - gap.after**2) / explainable if explainable > 0 else 0.0
    if share >= _ENOUGH:
        return None
    if share >= 0.5 * settings.explained_share:
        return Withdrawal("part", gap.before, gap.after, gap.floor, causes=causes)
    before, after = _squares(stages.given), _squares(stages.after)
    log, axis = divmod(int(np.nanargmax(after - before)), after.shape[1])
    return _on("fall", stages, (log, axis), before, after, names, causes)


def _no_fall_there(own: OwnAxes, stages: Stages, names: Sequence[str]) -> Withdrawal | None:
    """Return the contradiction where the causes of an axis do not shrink its gap."""
    axis = own.not_carried()
    if axis is None:
        return None
    given, left = _squares(stages.given), _squares(stages.after)
    log = int(np.argmax((left - given)[:, axis]))
    return _on("axis", stages, (log, axis), given, left, names, own.axes[axis])


def _above_floor(stages: Stages, names: Sequence[str]) -> Withdrawal | None:
    """Return the contradiction where the re-fitted simulator leaves more than noise."""
    left = _squares(stages.refitted)
    excess = above_floor(stages.refitted, stages)
    if not np.any(excess > 0):
        return None
    log, axis = divmod(int(np.nanargmax(excess)), excess.shape[1])
    return _on("none", stages, (log, axis), left, left, names)


def _on(
    why: Contradiction,
    stages: Stages,
    place: tuple[int, int],
    before: Array,
    after: Array,
    names: Sequence[str],
    causes: tuple[str, ...] = (),
) -> Withdrawal:
    """Return the contradiction with the figures of one log and axis (from 0), of squares (n_logs, n_axes)."""
    was, left, noise = (float(np.sqrt(x[place])) for x in (before, after, _squares(stages.floor)))
    return Withdrawal(why, was, left, noise, place[1] + 1, names[place[0]], causes)
