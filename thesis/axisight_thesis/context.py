"""What items share: the robot, the seed, and studies simulated once."""

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
        Rules phases and noise; items draw further streams by the run index.
    threads
        For simulations; 0 takes every core. No result depends on it.
    quick
        Fewer realizations, for a look and for tests; claims then may not hold.
    report
        Called with one line when a longer piece of work begins.
    """

    robot: Robot
    seed: int = 0
    threads: int = 0
    quick: bool = False
    report: Callable[[str], None] = lambda _: None
    _studies: dict[Hashable, Any] = field(default_factory=dict, repr=False)

    def shared(self, key: Hashable, make: Callable[[], T]) -> T:
        """Return what ``make`` gives, computed once per context for each ``key``."""
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
