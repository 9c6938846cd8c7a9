"""Everyone at the loosest tolerance that is good enough, and the table of results."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from common.loops import Task, relative_rms
from common.timing import timed

Array = np.ndarray
Prepare = Callable[[Task, float], Callable[[], Array]]
RTOL = [float(10.0**-e) for e in np.arange(3.0, 11.1, 0.5)]
SHORT_S = 2.0


@dataclass
class Row:
    """One line of a table; ``options`` are the arguments of a run of ours."""

    label: str
    settings: str
    error: float
    seconds: float
    options: dict[str, Any] = field(default_factory=dict)


def loosest(run: Callable[[Any], float], settings: list[Any], wanted: float) -> Any:
    """First of the settings, loosest first, whose error is at most ``wanted``.

    The last one is taken if none is good enough.
    """
    for setting in settings:
        if run(setting) <= wanted:
            return setting
    return settings[-1]


def fixed(label: str, prepare: Prepare, task: Task, reference: Array, rtol: float) -> Row:
    """The whole run at one tolerance; the better of two if it is short."""
    run = prepare(task, rtol)
    seconds, out = timed(run)
    if seconds < SHORT_S:
        seconds = min(seconds, timed(run, 2)[0])
    return Row(label, f"rtol {rtol:.0e}", relative_rms(out, reference), seconds)


def peer(
    label: str, prepare: Prepare, task: Task, reference: Array, wanted: float, scan_s: float
) -> Row:
    """Scan the tolerance on the first ``scan_s`` of the run, then time the whole run.

    The whole run may turn out better or worse than its beginning, so the tolerance is
    loosened or tightened from there.
    """
    part = task.for_seconds(scan_s)

    def error(rtol: float) -> float:
        return relative_rms(prepare(part, rtol)(), reference[: part.n_samples])

    place = RTOL.index(loosest(error, RTOL, wanted))
    best = fixed(label, prepare, task, reference, RTOL[place])
    direction = -1 if best.error <= wanted else 1
    while 0 <= place + direction < len(RTOL):
        place += direction
        row = fixed(label, prepare, task, reference, RTOL[place])
        if direction < 0 and row.error > wanted:
            break
        best = row
        if direction > 0 and row.error <= wanted:
            break
    return best


def print_rows(title: str, rows: list[Row], ours: Row | None) -> None:
    """The table, with ratios if there is something of ours to relate to."""
    print(f"\n{title}")
    print(f"{'':28}{'settings':18}{'rel. RMS error':>15}{'CPU s':>10}{'peer/ours':>11}")
    for r in rows:
        ratio = f"{r.seconds / ours.seconds:11.2f}" if ours else f"{'-':>11}"
        print(f"{r.label:28}{r.settings:18}{r.error:15.1e}{r.seconds:10.4f}{ratio}")
