"""The result of a study from its stored blocks."""

from __future__ import annotations

from collections import deque
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from axisight import _core
from axisight.arguments import short
from axisight.errors import StoreError, StudyError
from axisight.montecarlo.design import Arrays, Task, core_study, settings_of
from axisight.montecarlo.store import Store
from axisight.montecarlo.study import Study

_UNITS = {"position": "rad/Nm", "velocity": "rad/s/Nm", "acceleration": "rad/s^2/Nm"}
_TITLES = {
    "arithmetic_mean": "arithmetic mean",
    "log_mean": "logarithmic mean: geometric mean magnitude, mean direction",
    "harmonic_mean": "harmonic mean: inverse of the mean inverse matrix",
    "variance_real": "sample variance of the real part",
    "variance_imag": "sample variance of the imaginary part",
    "covariance": "sample covariance of real and imaginary part",
    "standard_error": "standard error of the arithmetic mean",
    "log_standard_error": "standard error of the mean log magnitude",
    "count": "responses counted",
}
_SQUARED = ("variance_real", "variance_imag", "covariance")


class Fold:
    """Accumulator that merges blocks in the order of their runs, whatever order they arrive in.

    Blocks that arrive early are kept until their turn.
    """

    def __init__(self, study: Study, design: str, tasks: list[Task]) -> None:
        self._study = study
        self._core = core_study(design)
        self._ensemble = _core.MonteCarloEnsemble(
            len(self._core.frequency_hz), self._core.n_axes, study.statistics.relative_accuracy
        )
        self._order = deque(tasks)
        self._early: dict[Task, Arrays] = {}
        self._failed: list[NDArray[np.uint64]] = []

    def add(self, task: Task, arrays: Arrays) -> None:
        """Merge a block as soon as all earlier ones are merged."""
        self._early[task] = arrays
        while self._order and self._order[0] in self._early:
            block = self._early.pop(self._order.popleft())
            self._ensemble.merge(
                block["count"],
                block["moments"],
                block["bucket_start"],
                block["bucket"],
                block["bucket_count"],
            )
            if len(block["failures"]):
                self._failed.append(block["failures"])

    def result(self) -> xr.Dataset:
        """Return the statistics."""
        failed = np.concatenate([np.empty((0, 4), np.uint64), *self._failed])
        return _dataset(self._study, self._core, self._ensemble, failed)


def _dataset(
    study: Study,
    core: _core.MonteCarloStudy,
    ensemble: _core.MonteCarloEnsemble,
    failed: NDArray[np.uint64],
) -> xr.Dataset:
    dims = ("frequency_hz", "output", "input")
    unit = _UNITS[study.measurement.output]
    summary = ensemble.summary(study.statistics.quantiles)
    variables: dict[str, Any] = {}
    for name, title in _TITLES.items():
        own = f"({unit})^2" if name in _SQUARED else unit
        own = "1" if name in ("count", "log_standard_error") else own
        variables[name] = (dims, summary[name], {"units": own, "long_name": title})
    variables["magnitude_quantile"] = (
        ("quantile", *dims),
        summary["magnitude_quantile"],
        {"units": unit, "relative_accuracy": study.statistics.relative_accuracy},
    )
    kinds = _core.failure_kinds()
    flags = {"flag_values": list(range(len(kinds))), "flag_meanings": " ".join(kinds)}
    variables["failed_run"] = ("failure", failed[:, 0])
    variables["failed_kind"] = ("failure", failed[:, 1], flags)
    variables["failed_experiment"] = ("failure", failed[:, 2] + np.uint64(1))
    variables["failed_detail"] = (
        "failure",
        failed[:, 3],
        {"long_name": "sample at which the run stopped, or number of singular lines"},
    )
    axes = list(range(1, core.n_axes + 1))
    return xr.Dataset(
        variables,
        coords={
            "frequency_hz": ("frequency_hz", core.frequency_hz, {"units": "Hz"}),
            "output": axes,
            "input": axes,
            "quantile": list(study.statistics.quantiles),
        },
    )


def failures(result: xr.Dataset) -> pd.DataFrame:
    """Return the failed runs of a result, one row each: run, seed, experiment, kind, detail.

    ``detail`` is the sample at which the run stopped, or the number of singular lines. For a run of
    kind ``singular_lines`` the statistics include its other lines.
    """
    kinds = str(result["failed_kind"].attrs["flag_meanings"]).split()
    return pd.DataFrame(
        {
            "run": result["failed_run"].values,
            "seed": result.attrs["seed"],
            "experiment": result["failed_experiment"].values,
            "kind": [kinds[int(k)] for k in result["failed_kind"].values],
            "detail": result["failed_detail"].values,
        }
    )


def responses(out: Path | str) -> xr.DataArray:
    """Return every response of a study stored with ``keep_responses``.

    ``out`` is the folder of the study. Dims (run, frequency_hz, output, input), complex; NaN for a
    failed run. Raises StoreError if the store holds no responses or is damaged.
    """
    store = Store(Path(out))
    design, seed = store.begun_with()
    try:
        core = core_study(design)
        output = settings_of(design)["measurement"]["output"]
    except StudyError as error:
        raise store.damaged(short(str(error))) from None
    parts = []
    runs: list[int] = []
    for first, count in sorted(store.stored().items()):
        block = store.read(first, count)
        if block is None or "responses" not in block:
            reason = "damaged; resume" if block is None else "stored without keep_responses"
            raise StoreError(f"{store.path(first, count)}: {reason}")
        parts.append(block["responses"])
        runs += range(first, first + count)
    if not parts:
        raise StoreError(f"{store.root}: expected blocks of runs, got none")
    axes = list(range(1, core.n_axes + 1))
    return xr.DataArray(
        np.concatenate(parts),
        dims=("run", "frequency_hz", "output", "input"),
        coords={"run": runs, "frequency_hz": core.frequency_hz, "output": axes, "input": axes},
        attrs={"units": _UNITS[output], "seed": seed},
    )
