"""Work beside the server's loop, whose results come back into it."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

from tornado.ioloop import IOLoop


class Beside:
    """One thread for the work of one visit of the page; made in the server's loop.

    ``document``: the page's, in whose turn results are taken.
    """

    def __init__(self, document: Any) -> None:
        self._document, self._loop = document, IOLoop.current()
        self._pool = ThreadPoolExecutor(1)
        self._closed = False

    def submit(self, task: Callable[[], Any], then: Callable[[Any], None]) -> None:
        """Do a task in the thread, and call ``then`` with its result, or its error, in the loop."""
        self._pool.submit(self._do, task, then)

    def close(self) -> None:
        """Take no more work, and give no more results."""
        self._closed = True
        self._pool.shutdown(wait=False, cancel_futures=True)

    def _do(self, task: Callable[[], Any], then: Callable[[Any], None]) -> None:
        try:
            found = task()
        except Exception as error:
            # Whatever it is: a page that waits for an answer that never comes looks alive.
            found = error
        # Through the loop, not straight to the document: that may be holding back events just now, and an
        # event that another thread adds to those is lost when they are taken out of it.
        self._loop.add_callback(self._hand_over, partial(then, found))

    def _hand_over(self, result: Callable[[], None]) -> None:
        if not self._closed:
            self._document.add_next_tick_callback(result)
