"""Work on a Dask cluster that may lose its workers."""

from __future__ import annotations

import importlib
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from typing import Any, TypeVar

from axisight.errors import AxisightError, BackendError, InputError

T = TypeVar("T")

_FETCH_S = 10.0
"""Longest time to fetch one result from a worker [s], after which it is requested again."""
_MOST_MISSES = 20


def on_cluster(
    tasks: Iterable[T],
    call: Callable[[T], tuple[Any, ...]],
    scheduler: str | None,
    patience_s: float,
) -> Iterator[tuple[T, Any]]:
    """Yield every task with its result, in the order in which they finish.

    ``call`` returns a function and its arguments for a task, when the workers have room for it. Workers
    send results in full. Other workers repeat the tasks of a worker that dies. ``scheduler`` is an
    address, or None for the current
    client. Raises BackendError if the scheduler cannot be reached or has no worker for ``patience_s``
    seconds, and the exceptions of tasks.
    """
    with _Cluster(scheduler, patience_s) as cluster:
        waiting = deque(tasks)
        active: dict[Any, T] = {}
        misses: Counter[int] = Counter()
        try:
            while waiting or active:
                while waiting and len(active) < cluster.window():
                    task = waiting.popleft()
                    active[cluster.submit(*call(task))] = task
                for future in cluster.finished(list(active)):
                    found = _outcome(future)
                    if found is not None:
                        yield active.pop(future), found
                        continue
                    misses[id(future)] += 1
                    if misses[id(future)] > _MOST_MISSES:
                        raise BackendError(f"{active[future]}: its result cannot be fetched")
        finally:
            cluster.forget(list(active))


class _Cluster:
    """A Dask client that notices the loss of all workers."""

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
        """Return the number of tasks to keep submitted, enough that no worker waits."""
        return self._window

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Any:
        # Without a new key each time, Dask would return a forgotten result.
        return self._client.submit(function, *arguments, pure=False, retries=3)

    def finished(self, futures: list[Any]) -> list[Any]:
        """Return the finished futures, after one second at most."""
        # Polling works without `distributed.wait`, which needs ours to be the default client of the
        # process.
        self._look()
        end = time.monotonic() + 1.0
        done: list[Any] = []
        while not done and time.monotonic() < end:
            time.sleep(0.005)
            # The result of a dead worker is "lost" until another worker computes it again.
            done = [f for f in futures if f.done() and f.status != "lost"]
        return done

    def forget(self, futures: list[Any]) -> None:
        if futures and self._client.status == "running":
            self._client.cancel(futures, force=True)

    def _look(self) -> None:
        """Query the number of workers, once a second; raises BackendError without any for too long."""
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
                f"{self._patience_s:g} s; what is finished is kept, resume to go on"
            )


def _distributed() -> Any:
    """Return the module ``distributed``; raises InputError if it is not installed."""
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


def _outcome(future: Any) -> Any:
    """Return a finished result, or None if its worker died before it was fetched."""
    if future.status == "finished":
        try:
            return future.result(timeout=_FETCH_S)
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
    reason = f"{type(error).__name__}: {error}" if error else f"task {future.status}"
    raise BackendError(f"{reason}; what is finished is kept, resume to go on")
