"""Equivalent effects: they give the same logs of commands and motor angles.

A torque sensor with an offset gives the logs of an axis with a torque offset. On a single axis, a position that is
read late gives the logs of a torque that is applied late. The more common effect of such a set is tried and named;
the others get a share of its probability.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from axisight.effects import Effect, effect_info, phrase
from axisight.gap.facts.named_cause import NamedCause
from axisight.gap.facts.result import Candidate

TWIN_SHARE = 0.2
"""Prior probability of the less common effect of two equivalent ones: odds of four to one for the common one."""


def twins_of(effect: str, n_axes: int) -> tuple[str, ...]:
    """Return the effects that give the same logs of a robot with ``n_axes`` axes.

    A late position is equivalent to a late torque on a robot of one axis only: other axes feel the motion itself.
    """
    info = effect_info(effect)
    return () if info.twins_alone and n_axes > 1 else info.twins


def with_twins(ranking: Sequence[Candidate], n_axes: int) -> tuple[Candidate, ...]:
    """Return the ranking with equivalent effects added, each with its share of the probability."""
    out = []
    for one in ranking:
        names = twins_of(one.effect, n_axes)
        out.append(replace(one, probability=one.probability * (1 - TWIN_SHARE * len(names))))
        out += [replace(one, effect=n, probability=one.probability * TWIN_SHARE) for n in names]
    return tuple(sorted(out, key=lambda c: -c.probability))


def less_their_twins(causes: Sequence[NamedCause], n_axes: int) -> tuple[NamedCause, ...]:
    """Return the causes less the probability of their equivalent effects."""
    counts = [len(twins_of(c.effect, n_axes)) for c in causes]
    return tuple(
        c.adjusted("twins", 1 - TWIN_SHARE * count) if count else c
        for c, count in zip(causes, counts, strict=True)
    )


def open_twins(causes: Sequence[NamedCause], n_axes: int) -> tuple[tuple[str, ...], ...]:
    """Return the sets of equivalent labels, one for each cause that has any."""
    named = [(c, (c.effect, *twins_of(c.effect, n_axes))) for c in causes]
    return tuple(tuple(Effect(n, c.axis).label for n in s) for c, s in named if len(s) > 1)


def about_twins(causes: Sequence[NamedCause], n_axes: int) -> tuple[str, ...]:
    """Return a sentence for each cause that has equivalent effects."""
    out = []
    for c in causes:
        there = "" if c.axis is None else f" on axis {c.axis}"
        others = " or ".join(phrase(n) for n in twins_of(c.effect, n_axes))
        if others:
            out.append(
                f"{phrase(c.effect)[:1].upper()}{phrase(c.effect)[1:]}{there} gives the same logs as {others}. "
                "The more common one is named. A second sensor, on the joint or of the torque, would tell them apart."
            )
    return tuple(out)
