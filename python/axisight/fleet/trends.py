"""Causes that grow: the size of a cause over the cases of one machine, in order."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]

# With fewer cases chance alone gives a monotonic order too often: five rise by chance once in 60.
_FEWEST = 5
# Probability of a false alarm over all series (Bonferroni).
_FALSE_ALARMS = 0.05


@dataclass(frozen=True)
class Trend:
    """A cause of a machine over its cases: ``sizes`` (n_cases,), zero in cases without the cause.

    - ``axis``: from 1, None for the arm.
    - ``per_case``: median slope per case (Theil-Sen), with its 95 % interval from ``low`` to ``high``.
    - ``p_value``: of Kendall's rank correlation with time.
    - ``changes``: whether ``p_value`` is small for the number of series.
    """

    machine: str
    effect: str
    axis: int | None
    parameter: str
    unit: str
    cases: tuple[str, ...]
    sizes: Array
    per_case: float
    low: float
    high: float
    p_value: float
    changes: bool


def trends(table: pd.DataFrame) -> list[Trend]:
    """Return the causes of a fleet's table over the cases of each machine, the most significant first.

    Only machines with at least five cases that have a verdict count. A size is the absolute value of the
    cause's first parameter. The order of case names is the order in time.
    """
    found = [t for _, own in table.groupby("machine", sort=True) for t in _of_machine(own)]
    level = _FALSE_ALARMS / max(len(found), 1)
    sure = [replace(t, changes=t.p_value < level) for t in found]
    return sorted(sure, key=lambda t: (t.p_value, t.machine, t.effect, t.axis or 0))


def _of_machine(own: pd.DataFrame) -> list[Trend]:
    judged = own[own["verdict"] != "error"]
    cases = tuple(sorted(judged["case"].unique()))
    if len(cases) < _FEWEST:
        return []
    causes = judged.dropna(subset=["effect"])
    keys = causes.groupby(["effect", "axis", "parameter", "unit"], dropna=False, sort=True)
    return [_trend(str(own["machine"].iloc[0]), key, rows, cases) for key, rows in keys]


def _trend(
    machine: str, key: tuple[object, ...], rows: pd.DataFrame, cases: tuple[str, ...]
) -> Trend:
    effect, axis, parameter, unit = key
    by_case = rows.set_index("case")["value"].abs()
    sizes = np.array([float(by_case.get(case, 0.0)) for case in cases])
    time = np.arange(len(cases), dtype=np.float64)
    slope = scipy.stats.theilslopes(sizes, time)
    rank = scipy.stats.kendalltau(time, sizes)
    return Trend(
        machine=machine,
        effect=str(effect),
        axis=None if pd.isna(axis) else int(str(axis)),  # type: ignore[call-overload]
        parameter=str(parameter),
        unit=str(unit),
        cases=cases,
        sizes=sizes,
        per_case=float(slope.slope),
        low=float(slope.low_slope),
        high=float(slope.high_slope),
        # Equal sizes have no rank correlation.
        p_value=float(np.nan_to_num(rank.pvalue, nan=1.0)),
        changes=False,
    )
