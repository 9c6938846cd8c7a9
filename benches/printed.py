"""What benches of whole diagnoses print alike: a line for every machine and their counts, or a table."""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from axisight import Log, Robot, diagnose

COMPLETE = [f"nothing, run {i + 1}" for i in range(5)]
"""Names of machines that lack nothing."""


class Counted:
    """Machines that were diagnosed: how often the first cause was right, how often one was invented."""

    def __init__(self) -> None:
        self.first = self.invented = self.lacking = self.complete = 0

    def diagnose(self, robot: Robot, lacks: str, logs: Sequence[Log]) -> None:
        """Diagnose a machine, the last log held out, and print a line; ``lacks`` is one of COMPLETE or a cause."""
        start = time.perf_counter()
        found = diagnose(robot=robot, estimation=logs[:-1], validation=logs[-1:])
        names = [cause.label for cause in found.causes]
        self.lacking += lacks not in COMPLETE
        self.complete += lacks in COMPLETE
        self.first += bool(names) and names[0].startswith(lacks)
        self.invented += lacks in COMPLETE and bool(names)
        print(
            f"{lacks:20s} {time.perf_counter() - start:5.1f} s  {found.verdict:11s} "
            f"{100 * found.gap.before:5.1f} -> {100 * found.gap.after:4.1f} % "
            f"(noise {100 * found.gap.floor:4.1f})  "
            + ", ".join(f"{c.label} {c.probability:.2f}" for c in found.causes),
            flush=True,
        )

    def print_counts(self) -> None:
        """Print how many there were of each."""
        print(f"{self.first} of {self.lacking} first, {self.invented} of {self.complete} invented")


def table(
    columns: Sequence[str],
    names: Iterable[str],
    row: Callable[[str, Path], tuple[Sequence[str], str]],
) -> None:
    """Print a row for every name, and beside the table how long it took.

    ``row`` makes the other cells, and what is to be said beside, of a name and an empty folder.
    """
    print(f"| {' | '.join(columns)} |")
    print("|---" * len(columns) + "|")
    for name in names:
        started = time.monotonic()
        with tempfile.TemporaryDirectory() as folder:
            cells, remark = row(name, Path(folder))
        print(f"| {' | '.join((name, *cells))} |", flush=True)
        print(f"{name}: {time.monotonic() - started:.0f} s, {remark}", file=sys.stderr)
