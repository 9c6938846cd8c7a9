"""Work outside the server's event loop, with results handed back into it."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

from tornado.ioloop import IOLoop


class Beside:
    """A worker thread for one visit of the page; create it in the server's event loop.

    ``document``: the document of the page, which takes the results.
    """

    def __init__(self, document: Any) -> None:
        self._document, self._loop = document, IOLoop.current()
        self._pool = ThreadPoolExecutor(1)
        self._closed = False

    def submit(self, task: Callable[[], Any], then: Callable[[Any], None]) -> None:
        """Run a task in the thread; call ``then`` with its result or its exception in the event loop."""
        self._pool.submit(self._do, task, then)

    def close(self) -> None:
        """Stop accepting work and delivering results."""
        self._closed = True
        self._pool.shutdown(wait=False, cancel_futures=True)

    def _do(self, task: Callable[[], Any], then: Callable[[Any], None]) -> None:
        try:
            found = task()
        except Exception as error:
            # Every error: a page whose answer never comes looks alive.
            found = error
        # Through the loop, not straight to the document. The document may be holding back events, and loses
        # those that another thread adds while it takes them out.
        self._loop.add_callback(self._hand_over, partial(then, found))

    def _hand_over(self, result: Callable[[], None]) -> None:
        if not self._closed:
            self._document.add_next_tick_callback(result)
