"""A diagnosis that runs in the background: it reports progress and can be stopped."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from typing import Any

from axisight.errors import AxisightError
from axisight.gap import Settings, diagnose
from axisight.logs import Log
from axisight.robot import Robot


class _StoppedError(BaseException):
    """A request to stop; a BaseException, so that no handler of failed fits catches it."""


class Background:
    """A diagnosis in its own thread.

    - ``state``: ``idle``, ``running``, ``stopping``, ``stopped``, ``failed`` or ``done``.
    - ``says``: the present step, or why the diagnosis failed.
    - ``share``: how much of the present step is done [1].
    - ``found``: the diagnosis, and ``document``: its verdict, once the state is ``done``.
    - ``error``: the exception that ended it, once the state is ``failed``.
    - ``steps``: how many times the diagnosis reported progress.
    """

    def __init__(
        self,
        name: str,
        robot: Robot,
        estimation: Sequence[Log],
        validation: Sequence[Log],
        settings: Settings,
        simulated: Sequence[Log] = (),
        run: Callable[..., Any] = diagnose,
    ) -> None:
        self._work = {"name": name, "robot": robot, "settings": settings}
        self._work |= {"estimation": list(estimation), "validation": list(validation)}
        self._work |= {"simulated": list(simulated)}
        self._run, self._stop = run, threading.Event()
        self._thread: threading.Thread | None = None
        self.state, self.says, self.share = "idle", "", 0.0
        self.document: dict[str, Any] | None = None
        self.found: Any = None
        self.error: Exception | None = None
        self.steps = 0

    @property
    def busy(self) -> bool:
        """Whether the diagnosis is running."""
        return self.state in ("running", "stopping")

    def start(self) -> None:
        """Start the diagnosis unless it is running."""
        if self.busy:
            return
        self._stop.clear()
        self.state, self.says = "running", "begins"
        self._thread = threading.Thread(target=self._diagnose, daemon=True, name="diagnosis")
        self._thread.start()

    def stop(self) -> None:
        """Ask the diagnosis to stop; it does so at its next step."""
        if self.state == "running":
            self.state = "stopping"
            self._stop.set()

    def wait(self, timeout_s: float | None = None) -> None:
        """Wait until the diagnosis ends, at most ``timeout_s`` seconds."""
        if self._thread is not None:
            self._thread.join(timeout_s)

    def _progress(self, label: str, done: int, total: int) -> None:
        if self._stop.is_set():
            raise _StoppedError
        self.says, self.share = f"{label}: {done} of {total}", done / max(total, 1)
        self.steps += 1

    def _diagnose(self) -> None:
        try:
            self.found = self._run(**self._work, progress=self._progress)
            self.document = self.found.to_verdict()
        except _StoppedError:
            self.state, self.says = "stopped", "nothing was kept"
        except AxisightError as error:
            self.error, self.says, self.state = error, str(error), "failed"
        except Exception as error:
            # A thread that dies silently would leave the page waiting.
            self.error, self.says = error, f"{type(error).__name__}: {error}"
            self.state = "failed"
            raise
        else:
            self.state, self.says = "done", ""
