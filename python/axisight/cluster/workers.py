"""Work shared by processes of this machine that end with the work, however it ends."""

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
    """Yield the place of every item and what ``work``, a plain function, makes of it, as it is done.

    Where the work stops half way, by Ctrl-C or an error of an item, the processes are ended.
    """
    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_begin)
    try:
        with _deaf_to_interrupts():
            jobs: dict[Future[B], int] = {pool.submit(work, x): i for i, x in enumerate(items)}
        for job in as_completed(jobs):
            yield jobs[job], job.result()
    except BaseException:
        # Python 3.14 has a method for it; before, to shut down waits for what is being worked on.
        for process in list((pool._processes or {}).values()):
            process.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


@contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """Start processes here: Ctrl-C goes to all of a terminal, and only this one is to say something."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    # Inherited, from before the first import of a process on.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin() -> None:
    """End this process when the one that wants its work is gone, even killed."""
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
