"""Diagnoses of a folder of cases, which never look at a truth; resumable."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

from axisight.errors import AxisightError
from axisight.gap import Settings, diagnose
from axisight.storage import write_whole

Progress = Callable[[str, int, int], None]


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
    failed: dict[str, str] = {}
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        jobs = {pool.submit(_solve, path, verdicts, each): path.name for path in todo}
        for done, job in enumerate(as_completed(jobs)):
            progress("diagnosing cases", done, len(todo))
            reason = job.result()
            if reason is not None:
                failed[jobs[job]] = reason
    progress("diagnosing cases", len(todo), len(todo))
    return failed


def _solve(case: Path, verdicts: Path, settings: Settings) -> str | None:
    """Write the verdict of one case, or return why there is none."""
    try:
        found = diagnose(case, settings=settings)
    except AxisightError as error:
        return str(error)
    path = verdicts / f"{case.name}.json"
    partial = path.with_suffix(".partial")
    partial.parent.mkdir(parents=True, exist_ok=True)
    found.save_verdict(partial)
    write_whole(path, partial.read_text("utf-8"))
    partial.unlink()
    return None
