"""Fits of one axis from many starts."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from axisight import _core
from axisight.display.summary import summarized
from axisight.errors import InputError
from axisight.graybox.axis_checks import data_warnings
from axisight.graybox.axis_findings import start_findings
from axisight.graybox.axis_model import AxisData, AxisModel, number
from axisight.graybox.axis_result import AxisFit, NoiseModel, conclude
from axisight.graybox.axis_search import FitSettings, Point, Task, first_point, search_rounds
from axisight.graybox.prediction_error import prepare
from axisight.statistics.starts import StartRange, drawn_start


@summarized
@dataclass(frozen=True)
class AxisMultistart:
    """Result of `multistart_axis`.

    ``best`` is the fit with the lowest loss. ``runs`` is a Dataset over ``run`` with ``start`` and
    ``value`` (run, parameter), ``loss``, ``status`` and ``iterations``. A run whose start cannot
    be simulated has the status ``diverged`` and an infinite loss.
    """

    best: AxisFit
    runs: xr.Dataset

    def success_rate(self, truth: Mapping[str, float], within: float) -> float:
        """Return the share of all starts that end within the relative distance ``within`` of ``truth``.

        All starts count, including diverged ones. ``truth`` holds the parameters to compare. Raises
        InputError for unknown names.
        """
        unknown = sorted(set(truth) - set(self.runs.parameter.values.tolist()))
        if unknown or not truth:
            raise InputError(
                f"truth: expected names out of {', '.join(self.runs.parameter.values)}, "
                f"got {', '.join(unknown) or 'none'}"
            )
        wanted = np.array(list(truth.values()), np.float64)
        found = self.runs.value.sel(parameter=list(truth)).values
        return float(np.mean(np.all(np.abs(found - wanted) <= within * np.abs(wanted), axis=1)))


def multistart_axis(
    model: AxisModel,
    data_sets: Sequence[AxisData] | AxisData,
    start: Mapping[str, float],
    *,
    n_starts: int = 50,
    seed: int = 0,
    spread: float = 3.0,
    ranges: Mapping[str, tuple[float, float]] | None = None,
    fixed: Iterable[str] = (),
    bounds: Mapping[str, tuple[float, float]] | None = None,
    settings: FitSettings | None = None,
    threads: int = 0,
) -> AxisMultistart:
    """Fit an axis by output error from ``n_starts`` random starts, and return the best fit and all runs.

    Every free parameter is drawn independently and uniformly in its logarithm, from
    ``start / spread`` to ``start * spread`` or between its limits in ``ranges`` (both positive or both
    negative). A parameter that starts at zero without a range starts at zero in every run. Draws are
    clipped to the bounds. They depend only on (seed, number of the run), and the result does not
    depend on ``threads`` (0 takes every core).

    ``model``, ``data_sets``, ``fixed``, ``bounds``, ``settings`` and errors are those of `fit_axis`.
    Also raises InputError if the motion diverges from every start.
    """
    chosen = settings or FitSettings()
    for field, value, least in (
        ("n_starts", n_starts, 1),
        ("seed", seed, 0),
        ("threads", threads, 0),
    ):
        if not isinstance(value, (int, np.integer)) or value < least:
            raise InputError(f"{field}: expected a whole number from {least}, got {value!r}")
    if number("spread", spread) < 1:
        raise InputError(f"spread: expected at least 1, got {spread}")
    task, values = prepare(
        model,
        data_sets,
        start,
        fixed=fixed,
        bounds=bounds,
        free_gear_ratio=False,
        settings=chosen,
    )
    limits = _ranges(task, values, spread, ranges or {})
    token = _core.CancelToken()
    middle = [values[name] for name in task.free_names]
    starts = [
        {
            **values,
            **dict(zip(task.free_names, drawn_start(middle, limits, seed, i), strict=True)),
        }
        for i in range(n_starts)
    ]

    def one(begin: Mapping[str, float]) -> Point:
        point = first_point(task, begin)
        try:
            return search_rounds(task, point, begin["r"], token)
        except InputError:
            return replace(point, status="diverged", loss=np.inf)

    with ThreadPoolExecutor(threads or os.cpu_count() or 1) as pool:
        try:
            ends = list(pool.map(one, starts))
        except BaseException:
            token.cancel()
            pool.shutdown(cancel_futures=True)
            raise
    best = min(ends, key=lambda p: p.loss)
    if not np.isfinite(best.loss):
        raise InputError(
            "start: expected at least one start that can be simulated, got none: the motion "
            "diverges from all of them"
        )
    warnings = (
        *data_warnings(model, task.data, task.free_names),
        *start_findings(task, best, token),
    )
    return AxisMultistart(
        conclude(task, best, NoiseModel("output_error"), warnings), _table(task, starts, ends)
    )


def _ranges(
    task: Task,
    values: Mapping[str, float],
    spread: float,
    ranges: Mapping[str, tuple[float, float]],
) -> list[StartRange | None]:
    """Return the ranges of the free parameters, None for those that start at zero."""
    unknown = sorted(set(ranges) - set(task.free_names))
    if unknown:
        raise InputError(
            f"ranges: expected free parameters, {', '.join(task.free_names)}, "
            f"got {', '.join(unknown)}"
        )
    out = {n: (values[n] / spread, values[n] * spread) for n in task.free_names if values[n]}
    for name, (low, high) in ranges.items():
        if not (np.isfinite([low, high]).all() and low * high > 0 and low <= high):
            raise InputError(
                f"ranges: {name}: expected two ascending numbers of one sign, got {low}, {high}"
            )
        out[name] = (float(low), float(high))
    return [
        StartRange(*out[name], True, task.bounds[name]) if name in out else None
        for name in task.free_names
    ]


def _table(task: Task, starts: Sequence[Mapping[str, float]], ends: Sequence[Point]) -> xr.Dataset:
    names, places = list(task.free_names), task.model.places()
    return xr.Dataset(
        {
            "start": (("run", "parameter"), [[s[n] for n in names] for s in starts]),
            "value": (("run", "parameter"), [[p.theta[places[n]] for n in names] for p in ends]),
            "loss": ("run", [p.loss for p in ends]),
            "status": ("run", [p.status for p in ends]),
            "iterations": ("run", [p.iterations for p in ends]),
            "evaluations": ("run", [p.evaluations for p in ends]),
        },
        coords={"run": np.arange(len(ends)), "parameter": names},
    )
