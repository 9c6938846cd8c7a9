"""Work shared by processes, with progress; what waits is dropped where one is interrupted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from typing import TypeVar

Progress = Callable[[str, int, int], None]
A = TypeVar("A")
B = TypeVar("B")


def shared_out(
    work: Callable[[A], B], items: Sequence[A], workers: int, label: str, progress: Progress
) -> list[B]:
    """Return what ``work`` makes of every item, in their order; it has to be a plain function."""
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        try:
            jobs = [pool.submit(work, item) for item in items]
            for done, job in enumerate(as_completed(jobs)):
                progress(label, done, len(jobs))
                job.result()
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    progress(label, len(items), len(items))
    return [job.result() for job in jobs]
