"""Estimate of time and disk space of a study, from a trial run."""

from __future__ import annotations

import time
from dataclasses import dataclass

from axisight.display.summary import summarized
from axisight.montecarlo.design import compute_block, core_study, freeze
from axisight.montecarlo.study import Study


@summarized
@dataclass(frozen=True)
class Estimate:
    """Time [s] and disk space [bytes] of a whole study; ``str`` gives them as a phrase."""

    runs: int
    threads: int
    seconds: float
    size_bytes: float

    def __str__(self) -> str:
        """Return the estimate as a phrase."""
        taken = f"{self.runs} runs take about {_duration(self.seconds)} on {self.threads} threads"
        return f"{taken} and {self.size_bytes / 1e9:.2g} GB"


def estimate(study: Study, threads: int) -> Estimate:
    """Return time and disk space of a whole study; raises StudyError as `run` does."""
    design = freeze(study)
    core_study(design)
    begun = time.perf_counter()
    block = compute_block(design, study.seed, 0, 1) or {}
    seconds = time.perf_counter() - begun
    size = sum(array.nbytes for array in block.values())
    # The size of a block does not depend on its runs, unless it keeps their responses.
    pieces = study.runs if study.statistics.keep_responses else -(-study.runs // study.block_runs)
    return Estimate(study.runs, threads, seconds * study.runs / threads, float(size) * pieces)


def _duration(seconds: float) -> str:
    for unit, length in (("years", 365.25 * 86400), ("days", 86400.0), ("hours", 3600.0)):
        if seconds >= 2 * length:
            return f"{seconds / length:.2g} {unit}"
    return f"{seconds / 60:.2g} minutes"
