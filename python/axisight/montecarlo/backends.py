"""Backends that compute blocks: threads of this process, or the workers of a Dask cluster."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import Any

from axisight import _core
from axisight.cluster import on_cluster
from axisight.montecarlo.design import Arrays, Task, compute_block


def available_threads() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def local_blocks(
    tasks: Iterable[Task], design: str, seed: int, threads: int
) -> Iterator[tuple[Task, Arrays]]:
    """Yield blocks computed on threads of this process, in the order in which they finish."""
    cancel = _core.CancelToken()
    pool = ThreadPoolExecutor(threads, thread_name_prefix="axisight")
    waiting = deque(tasks)
    active: dict[Future[Arrays | None], Task] = {}
    try:
        while waiting or active:
            # The limit keeps memory independent of the number of runs.
            while waiting and len(active) < threads + 1:
                task = waiting.popleft()
                active[pool.submit(compute_block, design, seed, *task, cancel)] = task
            # The time limit lets Ctrl-C through.
            finished, _ = wait(active, timeout=0.2, return_when=FIRST_COMPLETED)
            for future in finished:
                arrays = future.result()
                task = active.pop(future)
                if arrays is not None:
                    yield task, arrays
    finally:
        cancel.cancel()
        pool.shutdown(wait=True, cancel_futures=True)


def dask_blocks(
    tasks: Iterable[Task], design: str, seed: int, scheduler: str | None, patience_s: float
) -> Iterator[tuple[Task, Arrays]]:
    """Yield blocks computed on the workers of a Dask scheduler; see `axisight.cluster.on_cluster`."""

    def call(task: Task) -> tuple[Any, ...]:
        return (compute_block, design, seed, *task)

    return on_cluster(tasks, call, scheduler, patience_s)
