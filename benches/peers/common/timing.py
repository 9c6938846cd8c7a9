"""Clocks and tables."""

from __future__ import annotations

import gc
import platform
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any


def timed(action: Callable[[], Any], repeats: int = 1) -> tuple[float, Any]:
    """Shortest CPU time of this process [s] over some runs, and the last result.

    CPU time, because everything here runs on one thread and other programs on the machine
    would only blur a wall clock.
    """
    shortest, result = float("inf"), None
    for _ in range(repeats):
        gc.collect()
        begin = time.process_time()
        result = action()
        shortest = min(shortest, time.process_time() - begin)
    return shortest, result


def cpu() -> str:
    """Model name of the processor, as far as the system tells."""
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()
