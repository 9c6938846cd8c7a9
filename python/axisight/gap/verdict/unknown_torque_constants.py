"""Torque constants that nobody knows as rivals of masses and inertias: both scale the torque alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from axisight.effects import Effect, effect_info, effect_table
from axisight.gap.facts.named_cause import NamedCause
from axisight.gap.verdict.conclusion import Conclusion
from axisight.robot import Robot
from axisight.robot.branches import carriers

_ADVICE = (
    "State the torque constants (scale in the column map, or torque_constant in the drive data). Without them "
    "a wrong mass and a wrong constant look alike."
)


def open_with_constants(conclusion: Conclusion, axes: Sequence[int], robot: Robot) -> Conclusion:
    """Return a conclusion in which weights and inertias stay open against unknown torque constants.

    ``axes`` (from 1) of these constants. *Explained* becomes *undecidable*, and each such cause has half its
    probability.
    """
    like = {c.label: found for c in conclusion.causes if (found := _constants_like(c, axes, robot))}
    if not like or conclusion.verdict not in ("explained", "undecidable"):
        return conclusion
    causes = tuple(c.adjusted("either", 0.5) if c.label in like else c for c in conclusion.causes)
    return replace(
        conclusion,
        verdict="undecidable",
        causes=causes,
        equivalent=(*conclusion.equivalent, *((label, *like[label]) for label in sorted(like))),
        next_experiment=" ".join(filter(None, (_ADVICE, conclusion.next_experiment))),
    )


def _constants_like(cause: NamedCause, axes: Sequence[int], robot: Robot) -> tuple[str, ...]:
    """Return the labels of the constants among ``axes`` that change the torque as a cause does."""
    scales = effect_info(cause.effect).scales
    if scales is None:
        return ()
    felt = list(axes)
    if cause.axis is not None and scales == "own":
        felt = [axis for axis in axes if axis == cause.axis]
    elif cause.axis is not None and scales == "carriers":
        # A link weighs on what carries it.
        carrying = carriers(robot)[cause.axis]
        felt = [axis for axis in axes if axis in carrying]
    units = [info.name for info in effect_table().values() if info.torque_unit]
    return tuple(Effect(name, axis).label for axis in felt for name in units)
