"""The context that items share: the robot, the seed, and cached studies."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from typing import Any, TypeVar

from axisight.robot import Robot, load_robot

T = TypeVar("T")


@dataclass(frozen=True)
class Context:
    """The setting of a reproduction.

    robot
        The robot of the study.
    seed
        Seed of phases and noise; items draw further streams by the run index.
    threads
        Number of threads of simulations, 0 for every core. Results do not depend on it.
    quick
        Whether to take fewer realizations, for a preview and for tests; claims may then not hold.
    report
        Function called with one line when a longer computation begins.
    """

    robot: Robot
    seed: int = 0
    threads: int = 0
    quick: bool = False
    report: Callable[[str], None] = lambda _: None
    _studies: dict[Hashable, Any] = field(default_factory=dict, repr=False)

    def shared(self, key: Hashable, make: Callable[[], T]) -> T:
        """Return the result of ``make``, computed once per context for each ``key``."""
        if key not in self._studies:
            self._studies[key] = make()
        value: T = self._studies[key]
        return value


def context(
    *,
    seed: int = 0,
    threads: int = 0,
    quick: bool = False,
    report: Callable[[str], None] = lambda _: None,
) -> Context:
    """Return the context of the preset robot, ``irb6600_like``."""
    robot = load_robot("irb6600_like")
    return Context(robot, seed=seed, threads=threads, quick=quick, report=report)
