"""Causes that leave too much of what is seen stand for a law that is not among the effects."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from axisight import Settings
from axisight.gap.closed_loop import ClosedLoopView
from axisight.gap.verdict import _too_little
from gap_data import PLAN, bare_axis, logs_of


@pytest.mark.parametrize(
    ("explained", "left", "by_axis", "too_little"),
    [
        (0.5, 0.1, False, True),  # less than is asked for
        (0.79, 68.0, False, True),  # a fifth left, and seen
        (0.79, 1.0, False, False),  # a fifth left, of the size of noise
        (0.95, 68.0, False, False),  # what two formulas of one law differ by
        (0.79, 68.0, True, False),  # axes that are judged alone have much that nothing explains
    ],
)
def test_what_is_left_is_held_against_noise_and_against_what_is_explained(
    explained: float, left: float, by_axis: bool, too_little: bool
) -> None:
    samples = np.array([10.0, 30.0])
    found = SimpleNamespace(
        left=lambda: left * samples,
        layout=SimpleNamespace(samples=lambda: samples),
        by_axis=by_axis,
    )
    assert _too_little(found, explained, Settings()) is too_little


def test_a_load_on_a_single_axis_is_open_with_what_its_link_may_be() -> None:
    view = ClosedLoopView(bare_axis(), logs_of(bare_axis(), [], PLAN, seconds=2.0), Settings())
    offered = {o.effect.label for o in view.candidates(view.fitter.fit([]), axes=[1])}
    assert {"payload", "link_mass@1"} <= offered
