"""Execution of a study."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

import numpy as np
import xarray as xr

from axisight.errors import InputError, StoreError, StudyError
from axisight.montecarlo import backends
from axisight.montecarlo.design import Arrays, Task, core_study, digest, freeze
from axisight.montecarlo.progress import Meter, Report
from axisight.montecarlo.result import Fold
from axisight.montecarlo.store import FORMAT, Store, check_same, open_store
from axisight.montecarlo.study import Study, read_study


def run(
    study: Study | Path | str,
    *,
    runs: int | None = None,
    seed: int | None = None,
    out: Path | str | None = None,
    resume: bool = False,
    backend: Literal["local", "dask"] = "local",
    scheduler: str | None = None,
    threads: int | None = None,
    patience_s: float = 30.0,
    progress: Report | None = None,
) -> xr.Dataset:
    """Run a Monte Carlo study and return its statistics.

    Parameters
    ----------
    study : a study, or its TOML file.
    runs, seed : values that replace those of the study.
    out : folder for the results; without it nothing is stored.
    resume : whether to continue the study in ``out``, after an interruption or to more runs. The
        result has the same bits as an uninterrupted run. If ``out`` has no study, a new one starts.
    backend : ``"local"`` computes on ``threads`` threads (default: all processors),
        ``"dask"`` on the workers of ``scheduler`` (default: the current client).
    patience_s : longest time without workers of a Dask cluster [s].
    progress : function called with a :class:`Progress` after every block.

    Returns
    -------
    Dataset with dims (frequency_hz, output, input): complex ``arithmetic_mean``,
    ``log_mean`` and ``harmonic_mean``, ``variance_real``, ``variance_imag``,
    ``covariance``, ``standard_error``, ``log_standard_error`` and ``count``;
    ``magnitude_quantile`` with dim ``quantile``; the failed runs with dim ``failure`` (see
    :func:`failures`). Attributes hold seed, versions and the whole design.

    Raises StudyError naming the field for an invalid study or one that differs from the stored one,
    StoreError for a folder that cannot be written, BackendError for a cluster that cannot be reached,
    and InputError for invalid options. Finished blocks stay in ``out``. Failed runs raise nothing; the
    result lists them.

    """
    study = study if isinstance(study, Study) else read_study(study)
    given = {"runs": runs, "seed": seed}
    study = study.changed(**{name: value for name, value in given.items() if value is not None})
    if backend not in ("local", "dask"):
        raise InputError(f"backend: expected local or dask, got {backend!r}")
    if scheduler is not None and backend == "local":
        raise InputError("scheduler: expected backend='dask', got 'local'")
    threads = backends.available_threads() if threads is None else threads
    if threads < 1:
        raise InputError(f"threads: expected at least 1, got {threads}")
    design = freeze(study)
    core_study(design)
    tasks = _tasks(study)
    meter = Meter(study.runs, progress)

    def compute(missing: list[Task]) -> Iterator[tuple[Task, Arrays]]:
        if backend == "local":
            blocks = backends.local_blocks(missing, design, study.seed, threads)
        else:
            blocks = backends.dask_blocks(missing, design, study.seed, scheduler, patience_s)
        for task, arrays in blocks:
            yield task, arrays
            meter.finished(task[1], _n_failed(arrays))

    fold = Fold(study, design, tasks)
    if out is None:
        for task, arrays in compute(tasks):
            fold.add(task, arrays)
        return fold.result().assign_attrs(_provenance(study, design), runs=study.runs)
    with open_store(Path(out)) as store:
        _prepare(store, study, design, resume)
        for task, arrays in compute(_missing(store, tasks, meter)):
            store.write(*task, arrays)
        for task in tasks:
            stored = store.read(*task)
            if stored is None:
                raise StoreError(f"{store.path(*task)}: damaged while the study ran; resume")
            fold.add(task, stored)
        result = fold.result().assign_attrs(_provenance(study, design), runs=study.runs)
        store.write_result(result)
    return result


def _n_failed(arrays: Arrays) -> int:
    return len(np.unique(arrays["failures"][:, 0]))


def _tasks(study: Study) -> list[Task]:
    """Return the blocks as first run and length; the last may be short."""
    size = study.block_runs
    return [(first, min(size, study.runs - first)) for first in range(0, study.runs, size)]


def _prepare(store: Store, study: Study, design: str, resume: bool) -> None:
    if not store.root.exists():
        others = [p.name for p in store.folder.iterdir() if not p.name.startswith(".")]
        if others and others != ["study.toml"]:
            raise StudyError(f"{store.folder}: expected a new or empty folder, got {others[0]!r}")
        store.create(study.to_toml(), _provenance(study, design))
        return
    if not resume:
        raise StudyError(f"{store.folder}: holds a study already; resume it or name another")
    check_same(store, design, study.seed)
    stored = max((first + count for first, count in store.stored().items()), default=0)
    if stored > study.runs:
        raise StudyError(f"runs: expected at least the {stored} stored, got {study.runs}")


def _missing(store: Store, tasks: list[Task], meter: Meter) -> list[Task]:
    """Return the blocks to compute: those absent, too short or damaged."""
    stored, out = store.stored(), []
    for first, count in tasks:
        if stored.get(first) != count:
            out.append((first, count))
            continue
        block = store.read(first, count)
        if block is None:
            meter.report(f"{store.path(first, count)}: damaged, computed again")
            out.append((first, count))
        else:
            meter.found(count, _n_failed(block))
    return out


def _provenance(study: Study, design: str) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "study": study.to_toml(),
        "design": design,
        "design_sha256": digest(design),
        "seed": study.seed,
        "block_runs": study.block_runs,
        "dtype": "float64",
        "axisight_version": version("axisight"),
        "numpy_version": version("numpy"),
        "zarr_version": version("zarr"),
    }
