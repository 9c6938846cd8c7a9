"""A richer law is never judged without the simpler law that it is like, in whichever place it stands."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from axisight import Effect
from axisight.gap.search.rivals import with_simpler_laws


def ranked(name: str, axis: int = 3):
    effect = Effect(name, axis)
    hypothesis = SimpleNamespace(effect=effect)
    return SimpleNamespace(trial=SimpleNamespace(label=effect.label, hypothesis=hypothesis))


OFFSET, DRAG, LOOP, DELAY = (
    ranked("torque_offset"),
    ranked("quadratic_drag"),
    ranked("current_loop"),
    ranked("input_delay"),
)
UNEVEN, SIDED, PLAIN, ELSEWHERE = (
    ranked("position_dependent_friction"),
    ranked("asymmetric_friction"),
    ranked("coulomb_friction"),
    ranked("coulomb_friction", 1),
)


@pytest.mark.parametrize(
    ("cause", "rivals", "seen", "expected"),
    [
        # Of the cause, and of a rival.
        (UNEVEN, [OFFSET], [PLAIN], [PLAIN, OFFSET]),
        (OFFSET, [DRAG, UNEVEN], [PLAIN], [DRAG, PLAIN, UNEVEN]),
        # The first part of a composite, not its second.
        (SIDED, [], [OFFSET, PLAIN], [PLAIN]),
        # The delay that a current loop is like.
        (LOOP, [], [DELAY, PLAIN], [DELAY]),
        # A law without a simpler one; another axis has one of its own; nobody tried one.
        (OFFSET, [], [PLAIN], []),
        (UNEVEN, [SIDED], [ELSEWHERE], [SIDED]),
        (UNEVEN, [], [], []),
    ],
)
def test_the_simpler_law_comes_along(cause, rivals, seen, expected):
    assert with_simpler_laws(cause, rivals, seen) == expected
