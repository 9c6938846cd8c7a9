"""Whether the verdict of the estimation logs holds on the validation logs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from axisight.gap.facts.axis_names import placed
from axisight.gap.facts.compared_quantity import torque_of
from axisight.gap.facts.result import Gap
from axisight.gap.facts.settings import Settings
from axisight.gap.facts.wording import listed, percent
from axisight.gap.fit.tolerance_edges import BENT
from axisight.gap.measure.by_axis import OwnAxes
from axisight.gap.measure.gap_figures import Stage, Stages
from axisight.gap.verdict.conclusion import Conclusion

Array = NDArray[np.float64]

# A gap on one log and axis this much above the floor is seen by eye: a simulator without a fault,
# re-fitted within its tolerances, leaves less, the errors of its formulas included.
_FACTOR = 1.3
_SEEN = 0.03
# Causes have to remove this share of the explainable squared gap of validation logs: less than half
# of its amplitude is left then. One of two equal causes does not.
_ENOUGH = 0.8
# Share of what stands above the floor that a cause of the size of noise has to remove.
_HALF = 0.5
# By how much more of its squares than the floor says the steps of an encoder may leave: a motor that is
# held between two of them swings as it likes.
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
) -> Conclusion:
    """Return the conclusion, or *unknown* with the reason where the validation logs contradict it.

    A cause whose addition does not shrink the validation gap is withdrawn; where nothing stands above the
    floor there, and hardly anything on the estimation logs, it is none. *None* is withdrawn where a
    log stands above the floor; and nothing is said where the noise estimated from the logs is
    larger than a gap that is seen. ``own``: of causes whose axes are judged alone; they have to shrink the gap there.
    ``bent``: share of the simulator's own parameters that the re-fit beside the causes took to the edge
    of their tolerance, where that counts. ``removed``: share of what weighted residuals of the validation
    logs have above noise that the causes remove; None where it is not known. ``stepped`` (n_axes,): where the
    noise is that of an encoder's steps, of no axis by default.
    """
    withdrawn = None
    if gap.refitted > _SEEN and gap.floor > _ABSURD * gap.refitted:
        withdrawn = (
            f"No verdict: the noise estimated from the logs ({percent(gap.floor)} of the {torque_of(gap.compared)}) is "
            f"larger than the gap ({percent(gap.refitted)}): look for faults in the data, such as "
            f"glitches, frozen or missing samples, with `axisight check`."
        )
    elif own is not None:
        # Another motion may leave more of what nothing explains, and ask as much of the causes.
        withdrawn = _no_fall_there(own, stages, names)
    elif conclusion.causes and removed is not None and _of_no_size(conclusion, stages, removed):
        return _nothing(conclusion)
    elif conclusion.causes:
        labels = [cause.label for cause in conclusion.causes]
        withdrawn = _no_fall(stages, gap, names, settings, stepped, labels) or _out_of_shape(bent)
    elif conclusion.verdict == "none":
        withdrawn = _above_floor(stages, names)
    if withdrawn is None:
        return conclusion
    return replace(
        conclusion.without_causes("unknown"),
        next_experiment=(
            "Look at the log and axis named: what was different there (load, pose, speed, torque "
            "range)? Record more of it for estimation."
        ),
        withdrawn=withdrawn,
    )


def _of_no_size(conclusion: Conclusion, stages: Stages, removed: float) -> bool:
    """Whether causes explain what the simulator leaves anyway: no log stands above what passes for the floor.

    Half of what there is of them on the validation logs would do to let them stand.
    """
    small = all(a.excess <= _FACTOR**2 - 1.0 for a in conclusion.axes)
    return small and removed < _HALF and not np.any(above_floor(stages.refitted, stages) > 0)


def _nothing(conclusion: Conclusion) -> Conclusion:
    """Return *none* in the place of causes of no size; a check says which they were."""
    names = ", ".join(
        c.effect if c.axis is None else f"{c.effect}@{c.axis}" for c in conclusion.causes
    )
    return replace(
        conclusion.without_causes("none"),
        next_experiment=None,
        checks=(
            *conclusion.checks,
            f"{names} explains a little of the estimation logs, where the simulator leaves next to what noise "
            "does, and nothing of the validation logs: no cause.",
        ),
    )


def above_floor(left: Stage, stages: Stages) -> Array:
    """Return by how much mean squares (n_logs, n_axes) exceed what passes for the floor [1].

    Where it is positive, log and axis stand above the floor by more than the errors of formulas and
    what is left open.
    """
    passing = _FACTOR**2 * _squares(stages.floor) + _SEEN**2
    return _squares(left) - passing - (0.0 if stages.open is None else _squares(stages.open))


def open_check(stages: Stages) -> tuple[str, ...]:
    """Say what stands above the noise because it cannot be known."""
    if stages.open is None or stages.after.mean() <= _FACTOR**2 * stages.floor.mean() + _SEEN**2:
        return ()
    share = percent(float(np.sqrt(stages.open.mean())))
    return (
        f"Where motors stand or turn round, dry friction holds any torque in its band: up to {share} "
        f"of the {torque_of(stages.compared)} is left open there, counts as gap, and speaks for or against nothing.",
    )


def _squares(stage: Stage) -> Array:
    return np.array(stage.per_log())


def _floor(stages: Stages, stepped: NDArray[np.bool_] | None) -> float:
    """Return the mean square of the floor, with what the steps of encoders make of what is left."""
    noise, left = _squares(stages.floor), _squares(stages.after)
    more = np.clip(left - noise, 0.0, _BY_STEPS * noise)
    return float(np.mean(noise if stepped is None else noise + np.where(stepped, more, 0.0)))


def _no_fall(
    stages: Stages,
    gap: Gap,
    names: Sequence[str],
    settings: Settings,
    stepped: NDArray[np.bool_] | None,
    causes: Sequence[str],
) -> str | None:
    """Say so where the causes, by label, remove too little of the gap."""
    floor = _floor(stages, stepped)
    if gap.after**2 - gap.refitted**2 > settings.smallest_gain * gap.floor**2:
        return (
            f"What explains the estimation logs does not carry over to the validation logs: there the "
            f"simulator re-fitted within its tolerances leaves {percent(gap.refitted)} "
            f"of the {torque_of(gap.compared)}, with it {percent(gap.after)}."
        )
    # Where little stands above the noise, what is left of it is the noise of the floor.
    if gap.after**2 - floor <= settings.smallest_gain * floor:
        return None
    explainable = gap.before**2 - floor
    share = (gap.before**2 - gap.after**2) / explainable if explainable > 0 else 0.0
    if share >= _ENOUGH:
        return None
    if share >= 0.5 * settings.explained_share:
        return (
            f"What explains part of the gap ({listed([placed(c) for c in causes])}) leaves too much of it: on the "
            f"validation logs it goes from "
            f"{percent(gap.before)} to {percent(gap.after)} of the {torque_of(gap.compared)}, "
            f"{percent(gap.floor)} would be noise. Something else is missing."
        )
    before, after = _squares(stages.given), _squares(stages.after)
    log, axis = divmod(int(np.argmax(after - before)), after.shape[1])
    return (
        f"What explains the estimation logs does not carry over to the validation logs: with it the "
        f"gap goes from {percent(gap.before)} to {percent(gap.after)} of the {torque_of(gap.compared)}; "
        f"on axis {axis + 1} of {names[log]} from {percent(float(np.sqrt(before[log, axis])))} to "
        f"{percent(float(np.sqrt(after[log, axis])))}."
    )


def _out_of_shape(bent: float) -> str | None:
    """Say so where the simulator's own parameters make up for what the causes do not explain."""
    if bent < BENT:
        return None
    return (
        f"The causes found explain the gap only with {100 * bent:.0f} % of the simulator's own parameters at "
        f"the edge of their tolerance: something else is missing."
    )


def _no_fall_there(own: OwnAxes, stages: Stages, names: Sequence[str]) -> str | None:
    """Say so where the causes of an axis do not shrink its gap."""
    axis = own.not_carried()
    if axis is None:
        return None
    given, left = (_squares(s)[:, axis] for s in (stages.given, stages.after))
    log = int(np.argmax(left - given))
    before, after = (percent(float(np.sqrt(x[log]))) for x in (given, left))
    return (
        f"What explains axis {axis + 1} on the estimation logs does not carry over to the validation "
        f"logs: with it the gap of the axis goes from {before} to {after} of the "
        f"{torque_of(stages.compared)} on {names[log]}."
    )


def _above_floor(stages: Stages, names: Sequence[str]) -> str | None:
    """Say where the re-fitted simulator leaves more than noise."""
    left, noise = _squares(stages.refitted), _squares(stages.floor)
    excess = above_floor(stages.refitted, stages)
    if not np.any(excess > 0):
        return None
    log, axis = divmod(int(np.argmax(excess)), excess.shape[1])
    return (
        f"No effect is missing on the estimation logs, but that does not carry over to the validation "
        f"logs: on axis {axis + 1} of {names[log]} the simulator leaves "
        f"{percent(float(np.sqrt(left[log, axis])))} of the {torque_of(stages.compared)} unexplained; sensor noise "
        f"alone leaves {percent(float(np.sqrt(noise[log, axis])))}."
    )
