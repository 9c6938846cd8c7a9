"""A richer law is never judged without its plainer law, in whichever place it stands."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from axisight import Effect
from axisight.gap.search.rivals import with_plainer_laws


def ranked(name: str, axis: int = 3):
    effect = Effect(name, axis)
    hypothesis = SimpleNamespace(effect=effect)
    return SimpleNamespace(trial=SimpleNamespace(label=effect.label, hypothesis=hypothesis))


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
        (UNEVEN, [SIDED], [PLAIN], [PLAIN, SIDED]),
        (ranked("torque_offset"), [SIDED, UNEVEN], [PLAIN], [SIDED, PLAIN, UNEVEN]),
        # A law without a plainer one; another axis has one of its own; nobody tried one.
        (SIDED, [], [PLAIN], []),
        (UNEVEN, [SIDED], [ELSEWHERE], [SIDED]),
        (UNEVEN, [], [], []),
    ],
)
def test_the_plainer_law_comes_along(cause, rivals, seen, expected):
    assert with_plainer_laws(cause, rivals, seen) == expected
