"""Effects that nobody can tell apart by the logs of commands and motor angles: said, not hidden.

A torque that is reported with an offset gives the very logs of one that has it; of an axis alone a
position that is read late those of a torque that is applied late. The usual one of such twins is tried
and named; the others stand beside it with a share of its probability.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from axisight.effects import Effect, effect_info, phrase
from axisight.gap.facts.named_cause import NamedCause
from axisight.gap.facts.result import Candidate

TWIN_SHARE = 0.2
"""How often it is the twin, of machines that give such logs: as nothing tells, what is usual has the odds
of four to one."""


def twins_of(effect: str, n_axes: int) -> tuple[str, ...]:
    """Return the effects that give the very same logs of a robot.

    What is late on one axis of several is none: the others feel its motion when it is.
    """
    info = effect_info(effect)
    return () if info.twins_alone and n_axes > 1 else info.twins


def with_twins(ranking: Sequence[Candidate], n_axes: int) -> tuple[Candidate, ...]:
    """Return the ranking with twins beside those they are twins of, each with its share."""
    out = []
    for one in ranking:
        names = twins_of(one.effect, n_axes)
        out.append(replace(one, probability=one.probability * (1 - TWIN_SHARE * len(names))))
        out += [replace(one, effect=n, probability=one.probability * TWIN_SHARE) for n in names]
    return tuple(sorted(out, key=lambda c: -c.probability))


def less_their_twins(causes: Sequence[NamedCause], n_axes: int) -> tuple[NamedCause, ...]:
    """Return the causes without the share of probability that their twins have."""
    counts = [len(twins_of(c.effect, n_axes)) for c in causes]
    return tuple(
        c.adjusted("twins", 1 - TWIN_SHARE * count) if count else c
        for c, count in zip(causes, counts, strict=True)
    )


def open_twins(causes: Sequence[NamedCause], n_axes: int) -> tuple[tuple[str, ...], ...]:
    """Return the sets of labels that stay open, one for each cause that has twins."""
    named = [(c, (c.effect, *twins_of(c.effect, n_axes))) for c in causes]
    return tuple(tuple(Effect(n, c.axis).label for n in s) for c, s in named if len(s) > 1)


def about_twins(causes: Sequence[NamedCause], n_axes: int) -> tuple[str, ...]:
    """Return a sentence for each cause that has twins."""
    out = []
    for c in causes:
        there = "" if c.axis is None else f" on axis {c.axis}"
        others = " or ".join(phrase(n) for n in twins_of(c.effect, n_axes))
        if others:
            out.append(
                f"The logs of {phrase(c.effect)}{there} are those of {others}: what is met more "
                "often is named. A second sensor, on the joint or of the torque, would tell."
            )
    return tuple(out)
