"""Work in parallel processes, with progress."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from axisight.cluster.workers import each_done

Progress = Callable[[str, int, int], None]
A = TypeVar("A")
B = TypeVar("B")


def shared_out(
    work: Callable[[A], B], items: Sequence[A], workers: int, label: str, progress: Progress
) -> list[B]:
    """Return ``work(item)`` for every item, in order; ``work`` must be a module-level function."""
    made: dict[int, B] = {}
    progress(label, 0, len(items))
    for place, result in each_done(work, items, workers):
        made[place] = result
        progress(label, len(made), len(items))
    return [made[place] for place in range(len(items))]
