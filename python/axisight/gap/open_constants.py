"""Causes that torque constants nobody knows may be instead: what masses and poses do scales as they do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from axisight.effects import Effect
from axisight.effects.stated import CONSTANT, ONE_FORMULA, TORQUE_CONSTANT
from axisight.gap.verdict import Conclusion

# Torques of gravity and inertia.
_SCALED = ONE_FORMULA - {TORQUE_CONSTANT[0], CONSTANT[0]}
_ADVICE = (
    "State the torque constants (scale in the column map, or torque_constant in the drive data): without them "
    "masses and constants do much the same."
)


def open_with_constants(conclusion: Conclusion, axes: Sequence[int]) -> Conclusion:
    """Return a conclusion that takes no weight or inertia for certain beside constants that nobody knows.

    ``axes`` (from 1) of these. *Undecidable* instead of *explained*, each such cause open against the constants.
    """
    scaled = {c.label for c in conclusion.causes if c.effect in _SCALED}
    if not axes or not scaled or conclusion.verdict not in ("explained", "undecidable"):
        return conclusion
    constants = tuple(Effect(TORQUE_CONSTANT[0], axis).label for axis in axes)
    causes = tuple(
        replace(c, probability=0.5 * c.probability) if c.label in scaled else c
        for c in conclusion.causes
    )
    return replace(
        conclusion,
        verdict="undecidable",
        causes=causes,
        equivalent=(*conclusion.equivalent, *((label, *constants) for label in sorted(scaled))),
        next_experiment=_ADVICE,
    )
