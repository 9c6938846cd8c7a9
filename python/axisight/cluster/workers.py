"""Parallel work in processes of this machine, which end in any case when the work ends."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from typing import TypeVar

A = TypeVar("A")
B = TypeVar("B")


def each_done(work: Callable[[A], B], items: Sequence[A], workers: int) -> Iterator[tuple[int, B]]:
    """Yield the index of every item and the result of ``work``, in the order in which they finish.

    ``work`` is a module-level function. Ctrl-C or an error of an item ends the processes.
    """
    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_begin)
    try:
        with _deaf_to_interrupts():
            jobs: dict[Future[B], int] = {pool.submit(work, x): i for i, x in enumerate(items)}
        for job in as_completed(jobs):
            yield jobs[job], job.result()
    except BaseException:
        # A shutdown would wait for items in progress; a method to end processes needs Python 3.14.
        for process in list((pool._processes or {}).values()):
            process.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


@contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """Make processes started here ignore Ctrl-C, so that only this process reports it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    # Processes inherit the mask, so that it acts before their first import.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin() -> None:
    """End this process when its parent process ends, even if killed."""
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
