"""Diagnoses of a folder of cases, which never look at a truth; resumable."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

from axisight.blind.processes import Progress, shared_out
from axisight.errors import AxisightError
from axisight.gap import Settings, diagnose
from axisight.storage import write_whole


def solve_cases(
    cases: Path, verdicts: Path, settings: Settings, workers: int, progress: Progress
) -> dict[str, str]:
    """Write a verdict for every case that has none yet; return those that failed with the reason.

    Threads are shared by ``workers`` processes; results do not depend on them.
    """
    todo = [
        path
        for path in sorted(p.parent for p in cases.glob("*/case.toml"))
        if not (verdicts / f"{path.name}.json").is_file()
    ]
    each = replace(settings, threads=max(1, settings.threads // workers))
    solve = partial(_solve, verdicts=verdicts, settings=each)
    reasons = shared_out(solve, todo, workers, "diagnosing cases", progress)
    named = ((path.name, reason) for path, reason in zip(todo, reasons, strict=True))
    return {name: reason for name, reason in named if reason is not None}


def _solve(case: Path, verdicts: Path, settings: Settings) -> str | None:
    """Write the verdict of one case, or return why there is none."""
    try:
        found = diagnose(case, settings=settings)
    except AxisightError as error:
        return str(error)
    path = verdicts / f"{case.name}.json"
    begun = path.with_suffix(".partial")
    begun.parent.mkdir(parents=True, exist_ok=True)
    found.save_verdict(begun)
    write_whole(path, begun.read_text("utf-8"))
    begun.unlink()
    return None
