"""Where blocks are computed: threads of this process, or the workers of a Dask cluster."""

from __future__ import annotations

import importlib
import os
import time
from collections import Counter, deque
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import Any

from axisight import _core
from axisight.errors import AxisightError, BackendError, InputError
from axisight.montecarlo.design import Arrays, Task, compute_block

_FETCH_S = 10.0
"""Longest time to fetch one block from a worker [s]; it is asked for again after that."""
_MOST_MISSES = 20


def available_threads() -> int:
    """Return how many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def local_blocks(
    tasks: Iterable[Task], design: str, seed: int, threads: int
) -> Iterator[tuple[Task, Arrays]]:
    """Compute blocks on threads of this process, in whatever order they finish."""
    cancel = _core.CancelToken()
    pool = ThreadPoolExecutor(threads, thread_name_prefix="axisight")
    waiting = deque(tasks)
    active: dict[Future[Arrays | None], Task] = {}
    try:
        while waiting or active:
            # No more than this is ever held, however many runs there are.
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
    """Compute blocks on the workers of a Dask scheduler.

    A worker that dies has its blocks computed elsewhere. Raises BackendError when the
    scheduler cannot be reached, or no worker has been there for ``patience_s`` seconds.
    """
    with _Cluster(scheduler, patience_s) as cluster:
        waiting = deque(tasks)
        active: dict[Any, Task] = {}
        misses: Counter[Task] = Counter()
        try:
            while waiting or active:
                while waiting and len(active) < cluster.window():
                    task = waiting.popleft()
                    active[cluster.submit(design, seed, *task)] = task
                for future in cluster.finished(list(active)):
                    arrays = _outcome(future)
                    if arrays is not None:
                        yield active.pop(future), arrays
                        continue
                    misses[active[future]] += 1
                    if misses[active[future]] > _MOST_MISSES:
                        raise BackendError(f"runs from {active[future][0]}: cannot be fetched")
        finally:
            cluster.forget(list(active))


class _Cluster:
    """A Dask client that notices when nobody is left."""

    def __init__(self, scheduler: str | None, patience_s: float) -> None:
        self._patience_s = patience_s
        self._last_seen = time.monotonic()
        self._next_look = 0.0
        self._window = 2
        self._address = scheduler or "the current client"
        self._client, self._own = _connect(scheduler, min(patience_s, 10.0))

    def __enter__(self) -> _Cluster:
        return self

    def __exit__(self, *_: object) -> None:
        if self._own:
            self._client.close(timeout=2)

    def window(self) -> int:
        """Return how many blocks to keep in flight: enough that no worker waits."""
        return self._window

    def submit(self, design: str, seed: int, first: int, count: int) -> Any:
        # A new key each time: Dask would otherwise hand back a forgotten result.
        return self._client.submit(compute_block, design, seed, first, count, pure=False, retries=3)

    def finished(self, futures: list[Any]) -> list[Any]:
        """Return the futures that are done, after a second at most."""
        # Futures learn of their end by themselves; `distributed.wait` would need ours to be
        # the default client of the process.
        self._look()
        end = time.monotonic() + 1.0
        done: list[Any] = []
        while not done and time.monotonic() < end:
            time.sleep(0.005)
            # A result that died with its worker is "lost" until another computes it again.
            done = [f for f in futures if f.done() and f.status != "lost"]
        return done

    def forget(self, futures: list[Any]) -> None:
        if futures and self._client.status == "running":
            self._client.cancel(futures, force=True)

    def _look(self) -> None:
        """Ask for the workers, once a second."""
        if time.monotonic() < self._next_look:
            return
        self._next_look = time.monotonic() + 1.0
        workers = {}
        if self._client.status == "running":
            try:
                workers = self._client.nthreads()
            except (OSError, TimeoutError):
                workers = {}
        now = time.monotonic()
        if workers:
            self._last_seen = now
            self._window = 2 * sum(workers.values()) + 2
        elif now - self._last_seen > self._patience_s:
            raise BackendError(
                f"scheduler {self._address}: expected at least one worker, got none for "
                f"{self._patience_s:g} s; finished blocks are kept, resume to go on"
            )


def _distributed() -> Any:
    """Return the module of the optional extra."""
    try:
        return importlib.import_module("distributed")
    except ImportError:
        raise InputError(
            "backend: expected 'local', or the extra axisight[dask] installed, got 'dask'"
        ) from None


def _connect(scheduler: str | None, timeout_s: float) -> tuple[Any, bool]:
    client_class = _distributed().Client
    if scheduler is None:
        try:
            return client_class.current(), False
        except ValueError:
            raise InputError(
                "scheduler: expected the address of a scheduler, or a current "
                "distributed.Client, got neither"
            ) from None
    try:
        client = client_class(scheduler, timeout=timeout_s, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise BackendError(f"scheduler {scheduler}: cannot be reached: {error}") from error
    return client, True


def _outcome(future: Any) -> Arrays | None:
    """Return a finished block, or None if its worker died before it was fetched."""
    if future.status == "finished":
        try:
            arrays: Arrays = future.result(timeout=_FETCH_S)
            return arrays
        except TimeoutError:
            return None
        except Exception:
            if future.status in ("finished", "lost", "pending"):
                return None
    if future.status in ("lost", "pending"):
        return None
    error = future.exception() if future.status == "error" else None
    if isinstance(error, AxisightError):
        raise error
    reason = f"{type(error).__name__}: {error}" if error else f"block {future.status}"
    raise BackendError(f"{reason}; finished blocks are kept, resume to go on")
