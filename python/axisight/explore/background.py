"""A diagnosis beside the page: it says how far it is, and can be stopped."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from typing import Any

from axisight.errors import AxisightError
from axisight.gap import Settings, diagnose
from axisight.logs import Log
from axisight.robot import Robot


class _StoppedError(BaseException):
    """Asked to stop; of no kind that anything on the way would take for a failed fit."""


class Background:
    """A diagnosis in a thread of its own.

    ``state``: ``idle``, ``running``, ``stopping``, ``stopped``, ``failed`` or ``done``; ``says``: how far it
    is, or why it failed; ``share`` of the present step that is done [1]; ``document``: the verdict, once it is done.
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

    @property
    def busy(self) -> bool:
        """Whether it is at work."""
        return self.state in ("running", "stopping")

    def start(self) -> None:
        """Begin, unless it is at work already."""
        if self.busy:
            return
        self._stop.clear()
        self.state, self.says = "running", "begins"
        self._thread = threading.Thread(target=self._diagnose, daemon=True, name="diagnosis")
        self._thread.start()

    def stop(self) -> None:
        """Ask it to end; it does so at its next step."""
        if self.state == "running":
            self.state = "stopping"
            self._stop.set()

    def wait(self, timeout_s: float | None = None) -> None:
        """Wait for its end."""
        if self._thread is not None:
            self._thread.join(timeout_s)

    def _progress(self, label: str, done: int, total: int) -> None:
        if self._stop.is_set():
            raise _StoppedError
        self.says, self.share = f"{label}: {done} of {total}", done / max(total, 1)

    def _diagnose(self) -> None:
        try:
            found = self._run(**self._work, progress=self._progress)
            self.document = found.to_verdict()
        except _StoppedError:
            self.state, self.says = "stopped", "nothing was kept"
        except AxisightError as error:
            self.state, self.says = "failed", str(error)
        except Exception as error:
            # A thread that dies silently would leave the page waiting.
            self.state, self.says = "failed", f"{type(error).__name__}: {error}"
            raise
        else:
            self.state, self.says = "done", ""
