"""Causes that torque constants nobody knows may be instead: what masses and poses do scales as they do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from axisight.effects import Effect, effect_info, effect_table
from axisight.gap.facts.named_cause import NamedCause
from axisight.gap.verdict.conclusion import Conclusion

_ADVICE = (
    "State the torque constants (scale in the column map, or torque_constant in the drive data): without them "
    "masses and constants do much the same."
)


def open_with_constants(conclusion: Conclusion, axes: Sequence[int]) -> Conclusion:
    """Return a conclusion that takes no weight or inertia for certain beside constants that nobody knows.

    ``axes`` (from 1) of these. *Undecidable* instead of *explained*, each such cause open against the constants.
    """
    like = {c.label: found for c in conclusion.causes if (found := _constants_like(c, axes))}
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


def _constants_like(cause: NamedCause, axes: Sequence[int]) -> tuple[str, ...]:
    """Return the labels of the constants, of ``axes``, whose torques a cause changes."""
    scales = effect_info(cause.effect).scales
    if scales is None:
        return ()
    felt = list(axes)
    if cause.axis is not None and scales == "own":
        felt = [axis for axis in axes if axis == cause.axis]
    elif cause.axis is not None and scales == "carriers":
        # A link weighs on what carries it.
        felt = [axis for axis in axes if axis <= cause.axis]
    units = [info.name for info in effect_table().values() if info.torque_unit]
    return tuple(Effect(name, axis).label for axis in felt for name in units)
