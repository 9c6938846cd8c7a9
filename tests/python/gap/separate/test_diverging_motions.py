"""Designs leave out a motion along which a model diverges, and compare all others."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from axisight.gap.separate import design

DIVERGES = 5


class Route:
    """A route of motions by number: its fitter is the group of motions that it compares."""

    view = SimpleNamespace(robot=SimpleNamespace(n_axes=1))

    def __init__(self) -> None:
        self.groups: list[list[int]] = []

    def fitter(self, _runs: object, which: list[int], *, alone: bool) -> list[int]:
        del alone
        self.groups.append(which)
        return which


class Compared:
    """Leaves the number of a motion, unless a model diverges along one of the group."""

    def __init__(self, fitter: list[int], n_axes: int) -> None:
        self.group, self.n_axes = fitter, n_axes

    def left(self, *_of: object) -> tuple[np.ndarray, list[float]] | None:
        if DIVERGES in self.group:
            return None
        return np.array([[float(k)] for k in self.group]), [1.0] * len(self.group)


@pytest.mark.parametrize("alone", [False, True])
def test_only_the_motion_that_diverges_is_left_out(
    alone: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(design, "_Compared", Compared)
    turn = SimpleNamespace(machine=object(), other=None, free=(), neither=())
    count = 16
    runs = SimpleNamespace(possible=np.arange(count) != 0)
    route: Any = Route()
    question: Any = SimpleNamespace(turns=[turn])
    seen: Any = design._seen(route, question, [runs], range(count), alone=alone)  # type: ignore[list-item]
    # Motion 0 is outside the limits.
    wanted = [0.0 if k in (0, DIVERGES) else float(k) for k in range(count)]
    assert [float(seen[k][0].left[0]) for k in range(count)] == wanted
    # Halving: two groups at each of log2(16) levels at most, beside the first group.
    assert len(route.groups) <= (count - 1 if alone else 1 + 2 * 4)
